/* Which swatches lie on the table, where, and how they are drawn.

Model: swatches are LENGTH x WIDTH in rows, all tops in one plane, y = 0 of the table's frame; x runs to the right,
along the strokes, z towards the person, the origin is the middle of the table. A finger scans at true scale: 10 mm
along x is 10 mm of the texture. Only the drawing is magnified, since ridges of 0.8 mm are less than two pixels of a
headset at an arm's length: periods are drawn compressed, and heights HEIGHT_OVER_WIDTH times more than widths.
Limits: at most 4 columns; a period beyond DRAWN_AT_1MM is drawn as it is. */

/** How many swatches lie on the table at most. */
export const MOST = 12;
/** Along the stroke (m). */
export const LENGTH = 0.14;
/** Across the stroke (m). */
export const WIDTH = 0.062;
/** Between swatches (m): room for the label in front of each, and for a finger beside them. */
export const GAP = { x: 0.026, z: 0.056 };
/** Depth of a label (m), which lies in front of its swatch. */
export const LABEL = 0.038;
/** From the outer swatches to the edge of the table (m). */
export const MARGIN = 0.04;
/** Tops of swatches over the board (m). */
export const RAISED = 0.008;
const COLUMNS = 4;
const DRAWN_AT_1MM = 6e-3; // m: the period that 1 mm is drawn as, some ten pixels of a headset at an arm's length
const COMPRESSION = 0.35; // exponent of drawn period over period: fine stays finer than coarse, and all can be seen
const HEIGHT_OVER_WIDTH = 3; // slopes of the catalogue, 2 to 12 in 100, become such that light shows

/**
 * @param {{name: string, title: string, period: number}[]} entries periods in m
 * @param {number} most how many to keep
 * @returns the entries kept, finest first, spread evenly over the logarithm of the period; the outermost are always
 *   kept
 */
export function chooseSwatches(entries, most = MOST) {
  const left = [...entries].sort((a, b) => a.period - b.period || a.name.localeCompare(b.name));
  while (left.length > Math.max(1, most)) {
    const room = (index) => Math.log(left[index + 1].period / left[index - 1].period);
    let crowded = 1;
    for (let index = 2; index < left.length - 1; index++) if (room(index) < room(crowded)) crowded = index;
    left.splice(left.length > 2 ? crowded : 1, 1);
  }
  return left;
}

/**
 * @param {number} count of swatches
 * @returns {{places: {x: number, z: number}[], width: number, depth: number}} middles of the swatches in the table's
 *   frame, the finest far left, and the size of the board (m)
 */
export function layTable(count) {
  const rows = Math.max(1, Math.ceil(count / COLUMNS));
  const step = { x: LENGTH + GAP.x, z: WIDTH + GAP.z };
  const places = [];
  let columns = 1;
  for (let row = 0; row < rows; row++) {
    const inRow = Math.ceil((count - places.length) / (rows - row));
    columns = Math.max(columns, inRow);
    const z = (row - (rows - 1) / 2) * step.z - LABEL / 2;
    for (let column = 0; column < inRow; column++) places.push({ x: (column - (inRow - 1) / 2) * step.x, z });
  }
  return { places, width: columns * step.x - GAP.x + 2 * MARGIN, depth: rows * step.z - GAP.z + LABEL + 2 * MARGIN };
}

/**
 * @param {number} period of the texture (m)
 * @returns {{along: number, up: number}} how many times as wide and as high as it is the surface is drawn
 */
export function magnification(period) {
  const along = Math.max(1, Math.round((DRAWN_AT_1MM / 1e-3) * (period / 1e-3) ** (COMPRESSION - 1)));
  return { along, up: along * HEIGHT_OVER_WIDTH };
}

/** @param {number} metres @returns {string} with three digits at most and the unit that suits it */
export function lengthText(metres) {
  const [factor, unit] = metres < 1e-3 ? [1e6, "µm"] : [1e3, "mm"];
  return `${Number((metres * factor).toPrecision(3))} ${unit}`;
}

/**
 * @param {{title: string, period: number, height: number}} swatch period and height from valley to crest (m)
 * @returns {string[]} the lines of its label: what it is, its size, how it is drawn
 */
export function labelLines({ title, period, height }) {
  const { along, up } = magnification(period);
  const drawn = along > 1 ? `drawn ${along} × as wide, ${up} × as high` : `drawn as wide as it is, ${up} × as high`;
  return [title.split(":")[0], `${lengthText(period)} apart, ${lengthText(height)} high`, drawn];
}
