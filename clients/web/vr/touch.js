/* What a fingertip does on the table: from where it is to which swatch it touches, how hard, and where along it.

Model: a swatch is a spring of STIFFNESS under the fingertip, F = k d for a depth d below its top, and never more than
MOST_LOAD. Depth is counted only for a fingertip that came through the top plane from above, so a hand that comes up
from below the table, or that a tracker loses and finds again inside it, touches nothing.
Limits: one point a fingertip; no friction; the plane is flat, its ridges (0.4 mm at most) are below what a tracker
resolves. */

import { LENGTH, WIDTH } from "./table.js";

/** N per m: 5 mm of depth are 1 N, far above the noise of a tracker (1 mm) and within reach of a hand without a real
 *  surface. */
export const STIFFNESS = 200;
/** N: the most that a fingertip presses with here; strokes of people are 0.1 to 2 N. */
export const MOST_LOAD = 3;
/** m below the top from which a fingertip has gone through the table. */
export const THROUGH = 0.06;

/** @param {number} depth (m) below the top @returns {number} load (N), 0 to MOST_LOAD, 0 for what is no number */
export function loadOf(depth) {
  return depth > 0 ? Math.min(MOST_LOAD, STIFFNESS * depth) : 0;
}

/** @param {number} load (N) @returns {number} depth (m) that presses with it */
export function depthOf(load) {
  return Math.min(MOST_LOAD, Math.max(0, load)) / STIFFNESS;
}

/**
 * @param {{x: number, z: number}[]} places middles of the swatches (m)
 * @param {{x: number, z: number}} point in the table's frame (m)
 * @returns {{index: number, position: number} | null} the swatch under the point, and the distance from its left end
 *   (m)
 */
export function swatchUnder(places, point) {
  for (let index = 0; index < places.length; index++) {
    const along = point.x - places[index].x;
    const across = point.z - places[index].z;
    if (Math.abs(along) <= LENGTH / 2 && Math.abs(across) <= WIDTH / 2) return { index, position: along + LENGTH / 2 };
  }
  return null;
}

/** Follows one fingertip: its state is whether it is above the table, pressing on it, or below it by another way. */
export class TipFollower {
  /** @param {{places: {x: number, z: number}[], width: number, depth: number}} table of `layTable` */
  constructor(table) {
    this.table = table;
    this.side = "unknown";
  }

  /**
   * @param {{x: number, y: number, z: number} | null} point the lowest point of the fingertip in the table's frame (m),
   *   null where it is not tracked
   * @returns {{index: number, position: number, load: number, height: number} | null} the swatch at or under the
   *   fingertip, position (m) on it, load (N; 0 = not touching), height over it (m); null: no swatch
   */
  follow(point) {
    if (!point || ![point.x, point.y, point.z].every(Number.isFinite)) {
      this.side = "unknown";
      return null;
    }
    const { width, depth, places } = this.table;
    const over = Math.abs(point.x) <= width / 2 && Math.abs(point.z) <= depth / 2;
    if (point.y >= 0) this.side = "above";
    else if (point.y < -THROUGH) this.side = "below";
    else if (this.side === "above" && over) this.side = "pressing";
    else if (this.side !== "pressing") this.side = "below";
    const under = swatchUnder(places, point);
    if (!under || this.side === "below") return null;
    return { ...under, load: this.side === "pressing" ? loadOf(-point.y) : 0, height: point.y };
  }
}
