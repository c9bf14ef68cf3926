/* Downloads. */

import { make } from "../dom.js";

/** Downloads `blob` as a file called `name`. */
export function save(blob, name) {
  const url = URL.createObjectURL(blob);
  make("a", { href: url, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 10_000); // by then the browser has begun to read it
}

/** Downloads `text`, JSON, as a file called `name`. */
export const saveText = (text, name) => save(new Blob([text], { type: "application/json" }), name);
