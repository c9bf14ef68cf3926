/* The length of the queue of samples: as short as possible without underruns, because it delays every change.

Model: after an underrun the queue becomes longer by the missing frames, within limits. If the shortest queue of the
last two seconds was longer than needed, half of the excess is removed. For a while after an underrun nothing is
removed, since its cause (drawing, other load) is likely to return.
Limits: the first interruption of a kind is heard. All times are unverified defaults. */

const START = 0.06; // s; with less, the first drawings of the page cause gaps
const LEAST = 0.012; // s; less than a device requests at once causes gaps
const MOST = 0.15; // s; with more, the sound no longer seems to come from the hand
const MARGIN = 0.005; // s, shortest queue that is aimed at
const STEP = 0.004; // s added per report of missing frames, at least
const LARGEST_STEP = 0.012; // s, and at most: one long interruption is an exception
const WINDOW = 2; // s observed before the queue is shortened
const CAUTION = 10; // s after an underrun without shortening

export class QueueDepth {
  #rate;
  #seconds = START;
  #least = Infinity;
  #watched = 0;
  #caution = 0;

  /** rate: Hz. */
  constructor(rate) {
    this.#rate = rate;
  }

  /** Frames to keep queued or granted. */
  get frames() {
    return Math.round(this.#seconds * this.#rate);
  }

  /** Takes a report. played: frames since the last one. least: shortest queue, frames. missing: frames of underruns. */
  observe({ played, least, missing }) {
    if (missing > 0) {
      this.#set(this.#seconds + Math.min(LARGEST_STEP, Math.max(STEP, missing / this.#rate)));
      this.#caution = CAUTION;
      return;
    }
    const seconds = played / this.#rate;
    this.#caution -= seconds;
    this.#watched += seconds;
    this.#least = Math.min(this.#least, least);
    if (this.#watched < WINDOW) return;
    const spare = this.#least / this.#rate - MARGIN;
    this.#set(this.#seconds - (this.#caution > 0 ? 0 : Math.max(0, spare / 2)));
  }

  #set(seconds) {
    this.#seconds = Math.min(MOST, Math.max(LEAST, seconds));
    this.#watched = 0;
    this.#least = Infinity;
  }
}
