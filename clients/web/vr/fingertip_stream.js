/* The stream of one fingertip: opens a Finger for the nearest swatch, moves and lifts it.

Model: the stream is opened when the fingertip comes near a swatch, because solving the contact takes a moment. It is
silent until the swatch is touched. Its full scale is the automatic one of the texture at 80 mm/s and 0.3 N. It is
closed when no swatch was near for IDLE.
Limits: a touch before the stream is ready is heard from that moment on. */

import { Explained } from "../explained.js";
import { placed } from "../live/contact_update.js";
import { neededFullScale } from "../live/stream_scene.js";

const NEAR = 0.05; // m over a swatch, at which its stream is opened
const IDLE = 5; // s
const PAUSE = 1; // s until another try after an error
const AT_REST = { scan: { speed: 0, load: 0 } };

export class FingertipStream {
  /**
   * @param {{swatches: {scene: object}[], open: (scene: object, signal?: AbortSignal) => Promise<Finger | null>, onBlock?:
   *   (unlimited: Float32Array, finger: Finger) => void, onProblem?: (error: Error) => void, onLimited?: (reduction:
   *   number) => void}}
   *   parts `open` returns an open Finger, null before the sound has begun, and ends the opening at the signal;
   *   `onLimited`: gain reduction, dB
   */
  constructor({ swatches, open, onBlock = () => {}, onProblem = () => {}, onLimited = () => {} }) {
    Object.assign(this, { swatches, open, onBlock, onProblem, onLimited });
    this.scales = new Map(); // index of a swatch -> full scale after rescaling, SI
    this.reduction = 0; // newest gain reduction, dB
    this.index = null;
    this.finger = null;
    this.opening = null; // AbortController of the stream that is being opened
    this.touching = false;
    this.seen = -Infinity;
    this.blocked = -Infinity;
  }

  /**
   * @param {{index: number, position: number, y: number, load: number, height: number} | null} under of
   *   `FingertipContact.follow`: m, m, N, m
   * @param {number} time (s)
   * @param {number} [direction] of the finger from the stroke, counter-clockwise (rad); absent: unknown
   */
  follow(under, time, direction) {
    const load = under ? under.load : 0;
    if (under && (load > 0 || under.height < NEAR)) {
      this.seen = time;
      if (under.index !== this.index && time >= this.blocked) this.#begin(under.index, time);
    }
    if (load > 0 && this.finger && under.index === this.index) {
      this.finger.move(placed({ position: under.position, y: under.y, direction, load, time }));
      this.touching = true;
    } else this.lift();
    if (time - this.seen > IDLE) this.close();
  }

  /** Lifts the finger. */
  lift() {
    if (this.touching) this.finger?.lift();
    this.touching = false;
  }

  /** Closes the stream. */
  close() {
    this.lift();
    this.opening?.abort(); // nobody waits for its stream
    this.opening = null;
    this.finger?.close();
    this.finger = null;
    this.index = null;
    this.reduction = 0;
  }

  /** Replaces the stream by one with the full scale that the limiter called for. */
  async rescale() {
    const { finger, index, reduction } = this;
    if (!finger || !reduction) return;
    this.reduction = 0;
    this.scales.set(index, neededFullScale(finger.connection.ready, reduction));
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
    finger.addEventListener("block", ({ detail }) => this.onBlock(detail.unlimited, finger));
    finger.addEventListener("limited", ({ detail }) => {
      if (this.finger !== finger) return;
      this.reduction = detail.gain_reduction_db; // the newest: the largest may come from the moment of touch-down
      this.onLimited(this.reduction);
    });
    for (const kind of ["problem", "ended"]) finger.addEventListener(kind, ({ detail }) => this.#fail(finger, detail));
    this.finger = finger;
    this.touching = false;
  }

  async #begin(index, time) {
    this.close();
    this.index = index;
    const opening = new AbortController();
    this.opening = opening;
    try {
      const finger = await this.open(this.#scene(index), opening.signal);
      if (this.opening !== opening) return finger?.close();
      if (finger) this.#go(finger);
      else this.index = null;
    } catch (error) {
      if (this.opening !== opening) return;
      this.index = null;
      this.blocked = time + PAUSE;
      this.onProblem(error);
    }
    this.opening = null;
  }

  #fail(finger, { problem, reason }) {
    if (problem) this.onProblem(new Explained(problem.detail ?? problem.title));
    if (reason && this.finger === finger) {
      this.touching = false;
      this.close();
    }
  }
}
