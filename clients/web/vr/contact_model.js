/* The contact of a fingertip with the table: which swatch it touches, the load, and the place on the swatch.

Model: a swatch is a spring of STIFFNESS: F = k d at a depth d below its top, at most MOST_LOAD. Only a fingertip that
has crossed the top plane from above presses. A hand that comes from below the table, or that is lost and found again
inside it, touches nothing.
Limits: one point per fingertip; no friction; the top is flat, since trackers do not resolve ridges of at most 0.4 mm.
*/

import { LENGTH, WIDTH } from "./table_layout.js";

/** N/m: 5 mm are 1 N, far above the noise of a tracker (1 mm). Unverified default. */
export const STIFFNESS = 200;
/** N, largest load; usual strokes have 0.1 to 2 N. Unverified default. */
export const MOST_LOAD = 3;
/** m below the top at which a fingertip has gone through the table. */
const THROUGH = 0.06;

/** @param {number} depth (m) below the top @param {number} stiffness (N/m) @returns {number} load (N), 0 to MOST_LOAD; 0
 *  for NaN */
function loadOf(depth, stiffness) {
  return depth > 0 ? Math.min(MOST_LOAD, stiffness * depth) : 0;
}

/** @param {number} load (N) @param {number} stiffness (N/m) @returns {number} depth (m) of that load */
export function depthOf(load, stiffness = STIFFNESS) {
  return Math.min(MOST_LOAD, Math.max(0, load)) / stiffness;
}

/**
 * @param {{x: number, z: number, length?: number, width?: number}[]} places centres of the swatches, and their sizes where
 *   they are not LENGTH and WIDTH (m)
 * @param {{x: number, z: number}} point in coordinates of the table (m)
 * @returns {{index: number, position: number, y: number} | null} the swatch at the point, the distance from its left
 *   end, and from its middle away from the person (m)
 */
export function swatchUnder(places, point) {
  for (let index = 0; index < places.length; index++) {
    const along = point.x - places[index].x;
    const across = point.z - places[index].z;
    const { length = LENGTH, width = WIDTH } = places[index];
    if (Math.abs(along) <= length / 2 && Math.abs(across) <= width / 2)
      return { index, position: along + length / 2, y: 0 - across };
  }
  return null;
}

/** Returns the index of the swatch whose edge is nearest to a point of the table (m). */
function nearestSwatch(places, { x, z }) {
  const beyond = (distance, size) => Math.max(0, Math.abs(distance) - size / 2);
  const apart = (place) =>
    Math.hypot(beyond(x - place.x, place.length ?? LENGTH), beyond(z - place.z, place.width ?? WIDTH));
  return places.reduce((best, place, index) => (apart(place) < apart(places[best]) ? index : best), 0);
}

/** The contact of one fingertip. Its state: above the table, pressing, or below without pressing. */
export class FingertipContact {
  /** @param {{places: {x: number, z: number}[], width: number, depth: number}} table result of `layTable` */
  constructor(table) {
    this.table = table;
    this.side = "unknown";
    /** Index of the nearest swatch while the fingertip presses beside all of them; null otherwise. */
    this.beside = null;
  }

  /**
   * @param {{x: number, y: number, z: number} | null} point lowest point of the fingertip in coordinates of the table
   *   (m), null if it is not tracked
   * @param {number} stiffness of the swatches (N/m)
   * @returns {{index: number, position: number, y: number, load: number, height: number} | null} the swatch at the
   *   fingertip, place on it (m), load (N, 0: no touch), height over it (m); null: no swatch
   */
  follow(point, stiffness = STIFFNESS) {
    this.beside = null;
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
    if (!under && over && this.side === "pressing") this.beside = nearestSwatch(places, point);
    if (!under || this.side === "below") return null;
    return { ...under, load: this.side === "pressing" ? loadOf(-point.y, stiffness) : 0, height: point.y };
  }
}
