/* One fingertip that is felt: opens a finger of the service for the swatch it comes near, and moves or lifts it.

Model: a swatch that is near gets its session before it is touched, since solving a contact takes a moment. A session is
at rest until it is touched; its full scale is of its own texture, at 80 mm/s and 0.3 N. A finger that nothing is near
to for IDLE is closed.
Limits: a touch that comes before its session is ready is heard from the moment it is. */

import { turned } from "../live/contact.js";

/** m over a swatch from which on its session is opened. */
const NEAR = 0.05;
const IDLE = 5; // s
const PAUSE = 1; // s until another try after a session that could not be opened
const ROOM = 1.25; // between what the limiter called for and a full scale: it told of the past only
const AT_REST = { scan: { speed: 0, load: 0 } };

export class Toucher {
  /**
   * @param {{swatches: {scene: object}[], open: (scene: object) => Promise<Finger | null>, onBlock?: (samples:
   *   Float32Array, finger: Finger) => void, onProblem?: (error: Error) => void, onLimited?: (reduction: number) => void}}
   *   parts `onLimited`: the limiter turns this finger down, dB. `open` gives an opened Finger
   *   for a scene, null where sound has not begun
   */
  constructor({ swatches, open, onBlock = () => {}, onProblem = () => {}, onLimited = () => {} }) {
    Object.assign(this, { swatches, open, onBlock, onProblem, onLimited });
    this.scales = new Map(); // index of a swatch -> the full scale that the limiter called for, SI
    this.reduction = 0; // dB by which the limiter turned this finger down, as it was told last
    this.index = null;
    this.finger = null;
    this.touching = false;
    this.seen = -Infinity;
    this.blocked = -Infinity;
  }

  /**
   * @param {{index: number, position: number, load: number, height: number} | null} under of `TipFollower.follow`: m,
   *   N, m
   * @param {number} time (s)
   */
  follow(under, time) {
    const load = under ? under.load : 0;
    if (under && (load > 0 || under.height < NEAR)) {
      this.seen = time;
      if (under.index !== this.index && time >= this.blocked) this.#begin(under.index, time);
    }
    if (load > 0 && this.finger && under.index === this.index) {
      this.finger.move(turned({ position: under.position, load, time }));
      this.touching = true;
    } else this.lift();
    if (time - this.seen > IDLE) this.close();
  }

  /** Takes the finger off its swatch. */
  lift() {
    if (this.touching) this.finger?.lift();
    this.touching = false;
  }

  /** Ends the session of the finger. */
  close() {
    this.lift();
    this.finger?.close();
    this.finger = null;
    this.index = null;
    this.reduction = 0;
  }

  /** Opens another session for the swatch, with the full scale that the limiter called for, and goes on with it. */
  async rescale() {
    const { finger, index, reduction } = this;
    if (!finger || !reduction) return;
    this.reduction = 0;
    this.scales.set(index, finger.connection.ready.full_scale[0] * 10 ** (reduction / 20) * ROOM);
    try {
      const fresh = await this.open(this.#scene(index));
      if (this.finger !== finger) return fresh?.close();
      if (fresh) this.#go(fresh);
      if (fresh) finger.close();
    } catch (error) {
      this.onProblem(error);
    }
  }

  #scene(index) {
    const scene = { ...this.swatches[index].scene, ...AT_REST };
    const scale = this.scales.get(index);
    return scale ? { ...scene, output: { ...scene.output, full_scale: scale } } : scene;
  }

  #go(finger) {
    finger.addEventListener("block", ({ detail }) => this.onBlock(detail.samples, finger));
    finger.addEventListener("limited", ({ detail }) => {
      if (this.finger !== finger) return;
      this.reduction = detail.gain_reduction_db; // the last: the most may be of a landing
      this.onLimited(this.reduction);
    });
    for (const kind of ["problem", "ended"]) finger.addEventListener(kind, ({ detail }) => this.#fail(finger, detail));
    this.finger = finger;
    this.touching = false;
  }

  async #begin(index, time) {
    this.close();
    this.index = index;
    try {
      const finger = await this.open(this.#scene(index));
      if (this.index !== index || !finger || this.finger) {
        finger?.close();
        if (!finger && this.index === index) this.index = null;
        return;
      }
      this.#go(finger);
    } catch (error) {
      if (this.index === index) this.index = null;
      this.blocked = time + PAUSE;
      this.onProblem(error);
    }
  }

  #fail(finger, { problem, reason }) {
    if (problem) this.onProblem(new Error(problem.detail ?? problem.title));
    if (reason && this.finger === finger) {
      this.touching = false;
      this.close();
    }
  }
}
