/* The automatic stroke: back and forth over a length, with constant speed and load.

Limits: it turns abruptly; the service smooths the motion. Each update has the time of its position, so a late timer
delays an update but does not falsify it. */

const INTERVAL = 8; // ms between updates; more than 125 per second have no benefit (docs/live-motion.md)

export class AutomaticStroke {
  /** Whether the stroke runs. */
  running = false;
  #timer = 0;
  #distance = 0; // m since the start
  #time = 0; // s

  /** length: m, > 0. speed: m/s. load: N. onMove({position, load, time}): m from 0 to length, N, s. onLift(). The
   *  numbers may be changed during the stroke. */
  constructor({ length, speed, load, onMove, onLift = () => {}, clock = () => performance.now() / 1e3 }) {
    Object.assign(this, { length, speed, load, onMove, onLift, clock });
  }

  /** Puts the finger down at position 0 and starts. */
  start() {
    if (this.running) return;
    this.running = true;
    this.#distance = 0;
    this.#time = this.clock();
    this.#tell();
    this.#timer = setInterval(() => this.step(), INTERVAL);
  }

  /** Moves to the present time; the timer calls it. */
  step() {
    const time = this.clock();
    this.#distance += Math.abs(this.speed) * (time - this.#time);
    this.#time = time;
    this.#tell();
  }

  /** Lifts the finger. */
  stop() {
    if (!this.running) return;
    this.running = false;
    clearInterval(this.#timer);
    this.onLift();
  }

  #tell() {
    const place = this.#distance % (2 * this.length);
    const position = place <= this.length ? place : 2 * this.length - place;
    this.onMove({ position, load: this.load, time: this.#time });
  }
}
