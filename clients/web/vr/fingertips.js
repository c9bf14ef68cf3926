/* All fingertips: the swatch that each one touches, its sound and its drawing.

Model: a fingertip keeps its id from frame to frame. A fingertip that is missing in a frame is lifted and hidden. */

import { FingertipContact, STIFFNESS } from "./contact_model.js";
import { FingertipStream } from "./fingertip_stream.js";
import { directionOf } from "./tracked_fingertips.js";

export class Fingertips {
  /**
   * @param {object} parts
   * @param {Room} parts.room
   * @param {{name: string, scene: object}[]} parts.swatches
   * @param {(scene: object) => Promise<Finger | null>} parts.open returns an open Finger, null before the sound
   *   has begun
   * @param {(hand: string, finger: Finger, samples: Float32Array) => void} parts.onBlock a block of a
   *   touching fingertip; `hand`: "left", "right", or "" without a headset
   * @param {(hand: string) => void} parts.onLift
   * @param {(error: Error) => void} parts.onProblem
   * @param {(reduction: number) => void} parts.onLimited gain reduction of a fingertip, dB
   */
  constructor({ room, swatches, open, onBlock, onLift, onProblem, onLimited }) {
    Object.assign(this, { room, swatches, open, onBlock, onLift, onProblem, onLimited });
    this.known = new Map();
    /** Swatches beside which a fingertip presses: it touches nothing there. */
    this.beside = new Set();
    /** Load per depth of a fingertip (N/m). */
    this.stiffness = STIFFNESS;
  }

  /**
   * @param {{id: string, hand?: string, centre: {x, y, z}, ahead?: {x, y, z}, radius: number}[]} tips in coordinates
   *   of the table (m); ahead: a point 1 m ahead of the finger, absent where its direction is unknown
   * @param {number} time (s)
   * @returns {{index: number, position: number, load: number}[]} present touches: m, N
   */
  step(tips, time) {
    const touches = [];
    const present = new Set();
    this.beside = new Set();
    for (const tip of tips) {
      present.add(tip.id);
      const hand = this.#hand(tip);
      const { x, y, z } = tip.centre;
      const under = hand.follower.follow({ x, y: y - tip.radius, z }, this.stiffness);
      if (hand.follower.beside !== null) this.beside.add(hand.follower.beside);
      hand.stream.follow(under, time, tip.ahead && directionOf(tip.centre, tip.ahead));
      if (under && under.load > 0) touches.push(under);
      else if (hand.touched) this.onLift(hand.name);
      hand.touched = Boolean(under && under.load > 0);
      this.room.showTip(tip.id, tip, under ? under.load : 0);
    }
    for (const [id, hand] of this.known) if (!present.has(id)) this.#lose(id, hand, time);
    this.room.light(new Set(touches.map(({ index }) => index)), this.beside);
    return touches;
  }

  /** Gives each limited fingertip a larger full scale. */
  rescale() {
    for (const { stream } of this.known.values()) stream.rescale();
  }

  /** Lifts all fingertips and ends their sessions. */
  close() {
    for (const [id, hand] of this.known) {
      this.#lose(id, hand, 0);
      hand.stream.close();
    }
    this.room.light(new Set());
  }

  #hand({ id, hand: name = "" }) {
    if (!this.known.has(id)) {
      const hand = { name, follower: new FingertipContact(this.room.layout), touched: false };
      const { swatches, open, onProblem, onLimited } = this;
      const onBlock = (samples, finger) => hand.touched && this.onBlock(name, finger, samples);
      hand.stream = new FingertipStream({ swatches, open, onBlock, onProblem, onLimited });
      this.known.set(id, hand);
    }
    return this.known.get(id);
  }

  #lose(id, hand, time) {
    hand.follower.follow(null);
    hand.stream.follow(null, time);
    if (hand.touched) this.onLift(hand.name);
    hand.touched = false;
    this.room.showTip(id, null);
  }
}
