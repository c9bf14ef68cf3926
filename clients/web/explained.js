/* Errors that are written for the reader, and what the reader is told about any other.

Model: an Explained has a sentence: what is wrong, and what to do. Every other exception is written for programmers: the
reader gets the general sentence, or that of the place where it happened, and the console gets the exception. This
module alone reads the text of an error. */

const MISTAKE = "This page made a mistake. Reload it, then try again. The console of the browser has the details.";

/** An error whose text is a sentence for the reader. */
export class Explained extends Error {}

/** Returns the sentence of `error` for the reader. otherwise: the sentence about an error that has none. */
export function explanationOf(error, otherwise = MISTAKE) {
  if (error instanceof Explained) return error.message;
  if (otherwise === MISTAKE) console.error(error);
  else console.warn(error);
  return otherwise;
}
