/* A hand that strokes by itself: back and forth over a length, at a set speed and load.

Limits: it turns at once, where a hand slows down; the service smooths what it is told. Times are those of the updates
themselves, so a late timer makes an update late but not wrong. */

const INTERVAL = 8; // ms between updates: 125 a second, beyond which nothing is gained (docs/live-motion.md)

export class Stroker {
  /** Whether it strokes. */
  running = false;
  #timer = 0;
  #way = 0; // m since the start
  #at = 0; // s

  /** length: m, > 0. speed: m/s. load: N. onMove({position, load, time}): m from 0 to length, N, s. onLift(). The
   *  numbers may be changed while it strokes. */
  constructor({ length, speed, load, onMove, onLift = () => {}, clock = () => performance.now() / 1e3 }) {
    Object.assign(this, { length, speed, load, onMove, onLift, clock });
  }

  /** Puts the finger down at the beginning, and strokes. */
  start() {
    if (this.running) return;
    this.running = true;
    this.#way = 0;
    this.#at = this.clock();
    this.#tell();
    this.#timer = setInterval(() => this.step(), INTERVAL);
  }

  /** Goes on to the present time; the timer does so by itself. */
  step() {
    const time = this.clock();
    this.#way += Math.abs(this.speed) * (time - this.#at);
    this.#at = time;
    this.#tell();
  }

  /** Takes the finger off. */
  stop() {
    if (!this.running) return;
    this.running = false;
    clearInterval(this.#timer);
    this.onLift();
  }

  #tell() {
    const place = this.#way % (2 * this.length);
    const position = place <= this.length ? place : 2 * this.length - place;
    this.onMove({ position, load: this.load, time: this.#at });
  }
}
