/* The selection of swatches, their places on the table and the magnification of their drawing.

Model: swatches of LENGTH x WIDTH lie in rows, with all tops in the plane y = 0 of the table. x points right, along the
strokes, z towards the person; the origin is the middle of the table. A finger scans at true scale: 10 mm along x are 10
mm of the texture. Only the drawing is magnified, because a ridge of 0.8 mm is less than two pixels of a headset at
arm's length. The magnification is larger for finer textures. Heights are magnified HEIGHT_OVER_WIDTH times more than
widths.
Imported textures have a row of their own in front.
Limits: at most 4 columns; 2 where the picture is taller than wide. */

import { byGroup } from "../textures/groups.js";

/** Largest number of swatches of the catalogue. */
export const MOST = 12;
/** Largest number of swatches of imported textures: a row. */
export const MOST_OWN = 4;
/** Length of a swatch, along the stroke (m). */
export const LENGTH = 0.14;
/** Width of a swatch, across the stroke (m). */
export const WIDTH = 0.062;
/** Distance between swatches (m), with room for labels and a finger. */
export const GAP = { x: 0.026, z: 0.056 };
/** Depth of the label in front of a swatch (m). */
export const LABEL = 0.038;
/** Distance from swatches to the edge of the table (m). */
export const MARGIN = 0.04;
/** Height of the tops of swatches over the board (m). */
export const RAISED = 0.008;
/** Number of swatches in a row, in a wide and in a tall picture. */
export const COLUMNS = { wide: 4, tall: 2 };
const DRAWN_AT_1MM = 6e-3; // m: drawn length of a period of 1 mm, some ten pixels of a headset at arm's length
const COMPRESSION = 0.35; // exponent of drawn period over period; 1 would keep ratios, 0 would draw all alike
const HEIGHT_OVER_WIDTH = 3; // makes slopes of 0.02 to 0.12 visible in the light

/**
 * @param {{name: string, group: string}[]} entries of the catalogue
 * @param {number} most number to keep
 * @returns the kept entries: of each group equally many, or one more, if it has them; spread evenly over the group
 */
export function chooseSwatches(entries, most = MOST) {
  const groups = byGroup(entries).map(([, group]) => group);
  const counts = groups.map(() => 0);
  for (let left = Math.min(most, entries.length); left > 0; ) {
    for (const [index, group] of groups.entries()) {
      if (left > 0 && counts[index] < group.length) {
        counts[index]++;
        left--;
      }
    }
  }
  return groups.flatMap((group, index) => {
    const places = Array.from({ length: counts[index] }, (_, place) => (place + 0.5) / counts[index]);
    return places.map((place) => group[Math.floor(place * group.length)]);
  });
}

/**
 * @param {{stored: boolean, created: string}[]} entries of the service
 * @returns the imported ones, the newest first
 */
export function chooseOwn(entries) {
  const own = entries.filter(({ stored }) => stored);
  return own.sort((one, other) => other.created.localeCompare(one.created)).slice(0, MOST_OWN);
}

/**
 * @param {number} count number of swatches
 * @param {number} own how many of them, the last ones, are imported
 * @param {number} most swatches in a row
 * @returns {{places: {x: number, z: number}[], width: number, depth: number}} centres of the swatches, the finest at
 *   the far left, and the size of the board (m)
 */
export function layTable(count, own = 0, most = COLUMNS.wide) {
  const rows = [...rowsOf(count - own, most), ...rowsOf(own, most)];
  const step = { x: LENGTH + GAP.x, z: WIDTH + GAP.z };
  const places = rows.flatMap((inRow, row) => {
    const z = (row - (rows.length - 1) / 2) * step.z - LABEL / 2;
    return Array.from({ length: inRow }, (_, column) => ({ x: (column - (inRow - 1) / 2) * step.x, z }));
  });
  const columns = Math.max(1, ...rows);
  const depth = Math.max(1, rows.length) * step.z - GAP.z + LABEL + 2 * MARGIN;
  return { places, width: columns * step.x - GAP.x + 2 * MARGIN, depth };
}

/** Returns the numbers of swatches in as few rows as possible, spread evenly. */
function rowsOf(count, most) {
  const rows = Math.ceil(count / most);
  return Array.from({ length: rows }, (_, row) => Math.floor((count + rows - 1 - row) / rows));
}

/**
 * @param {{wave: number, height: number}} swatch period of the texture, or typical wave of a rough one, and height from
 *   valley to crest (m)
 * @returns {{along: number, up: number}} magnification of widths and of heights; no valley is drawn below the board
 */
export function magnification({ wave, height }) {
  const along = Math.max(1, Math.round((DRAWN_AT_1MM / 1e-3) * (wave / 1e-3) ** (COMPRESSION - 1)));
  return { along, up: Math.max(1, Math.min(along * HEIGHT_OVER_WIDTH, Math.floor(RAISED / height))) };
}

/** @param {number} metres @returns {string} text with at most three digits, in µm or mm */
function lengthText(metres) {
  const [factor, unit] = metres < 1e-3 ? [1e6, "µm"] : [1e3, "mm"];
  return `${Number((metres * factor).toPrecision(3))} ${unit}`;
}

/**
 * @param {{wave: number, rough: boolean, height: number}} swatch wave and height from valley to crest (m)
 * @returns {string}
 */
export function sizeText({ wave, rough, height }) {
  return `${rough ? "waves of" : "period"} ${lengthText(wave)}, height ${lengthText(height)}`;
}

/**
 * @param {{title: string, wave: number, rough: boolean, height: number}} swatch as of `sizeText`
 * @returns {string[]} lines of the label: title, size, magnification
 */
export function labelLines({ title, wave, rough, height }) {
  const { along, up } = magnification({ wave, height });
  const drawn = `drawn ${along > 1 ? `${along} × as wide` : "at true width"}, ${up} × as high`;
  return [title.split(":")[0], sizeText({ wave, rough, height }), drawn];
}
