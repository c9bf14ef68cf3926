/* All fingertips of a moment: which swatch each touches, what is felt and seen of it.

Model: a fingertip is known by its id from frame to frame; one that is no longer told of is lifted and hidden. */

import { TipFollower } from "./touch.js";
import { Toucher } from "./toucher.js";

export class Hands {
  /**
   * @param {object} parts
   * @param {Room} parts.room
   * @param {{name: string, scene: object}[]} parts.swatches
   * @param {(scene: object) => Promise<Finger | null>} parts.open an opened Finger, null where sound has not begun
   * @param {(hand: string, finger: Finger, samples: Float32Array) => void} parts.onBlock what a touching fingertip
   *   gets; `hand`: "left", "right", or empty where it is no hand of a headset
   * @param {(hand: string) => void} parts.onLift
   * @param {(error: Error) => void} parts.onProblem
   * @param {(reduction: number) => void} parts.onLimited the limiter turns a fingertip down, dB
   */
  constructor({ room, swatches, open, onBlock, onLift, onProblem, onLimited }) {
    Object.assign(this, { room, swatches, open, onBlock, onLift, onProblem, onLimited });
    this.known = new Map();
  }

  /**
   * @param {{id: string, hand?: string, centre: {x, y, z}, radius: number}[]} tips centres in the table's frame (m)
   * @param {number} time (s)
   * @returns {{index: number, position: number, load: number}[]} the touches of now: m, N
   */
  step(tips, time) {
    const touches = [];
    const told = new Set();
    for (const tip of tips) {
      told.add(tip.id);
      const hand = this.#hand(tip);
      const { x, y, z } = tip.centre;
      const under = hand.follower.follow({ x, y: y - tip.radius, z });
      hand.toucher.follow(under, time);
      if (under && under.load > 0) touches.push(under);
      else if (hand.touched) this.onLift(hand.name);
      hand.touched = Boolean(under && under.load > 0);
      this.room.showTip(tip.id, tip, under ? under.load : 0);
    }
    for (const [id, hand] of this.known) if (!told.has(id)) this.#lose(id, hand, time);
    this.room.light(new Set(touches.map(({ index }) => index)));
    return touches;
  }

  /** Gives each fingertip that the limiter turned down a larger full scale. */
  rescale() {
    for (const { toucher } of this.known.values()) toucher.rescale();
  }

  /** Lifts every fingertip and ends its session. */
  close() {
    for (const [id, hand] of this.known) {
      this.#lose(id, hand, 0);
      hand.toucher.close();
    }
    this.room.light(new Set());
  }

  #hand({ id, hand: name = "" }) {
    if (!this.known.has(id)) {
      const hand = { name, follower: new TipFollower(this.room.layout), touched: false };
      const { swatches, open, onProblem, onLimited } = this;
      const onBlock = (samples, finger) => hand.touched && this.onBlock(name, finger, samples);
      hand.toucher = new Toucher({ swatches, open, onBlock, onProblem, onLimited });
      this.known.set(id, hand);
    }
    return this.known.get(id);
  }

  #lose(id, hand, time) {
    hand.follower.follow(null);
    hand.toucher.follow(null, time);
    if (hand.touched) this.onLift(hand.name);
    hand.touched = false;
    this.room.showTip(id, null);
  }
}
