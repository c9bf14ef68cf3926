/* How much sound is kept queued ahead: as little as plays without a break, since it is heard before any change.

The queue is watched at its shortest. Where it ran dry it is made longer, by what was missing within limits; where for
two seconds it never came near its end, half of what was to spare is given up. After an underrun nothing is given up for
a while, since what caused it (a page that draws, a machine that is busy) comes again.
Limits: it learns from what happened; the first hiccup of a kind is heard. All times are unverified defaults. */

const START = 0.06; // s; less: gaps while a page that has just begun draws its first pictures
const LEAST = 0.012; // s: less than a device takes at a time is silence
const MOST = 0.15; // s: beyond, a hand no longer believes that it is its own sound
const MARGIN = 0.005; // s left at the shortest moment
const STEP = 0.004; // s that a report of missing samples adds at least,
const LARGEST_STEP = 0.012; // s and at most: one long hiccup is not the rule
const WINDOW = 2; // s watched before anything is given up
const CAUTION = 10; // s after an underrun in which nothing is given up

export class Depth {
  #rate;
  #seconds = START;
  #least = Infinity;
  #watched = 0;
  #caution = 0;

  /** rate: Hz. */
  constructor(rate) {
    this.#rate = rate;
  }

  /** Frames to keep queued or on their way. */
  get frames() {
    return Math.round(this.#seconds * this.#rate);
  }

  /** Notes that `played` frames were played, the queue never shorter than `least`, with `missing` frames of zeros. */
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
