/* The colours of heights seen from above.

Model: the colour changes linearly with the height from `valley` to `crest`. Slopes that face left are lighter and those
that face right darker, by at most RELIEF of that range, in proportion to the steepest slope. */

const RELIEF = 0.28;

/**
 * Returns a canvas with a pixel for each height.
 * @param {ArrayLike<number>[]} rows rows of heights (m), the first at the top. Each has one height more on both sides,
 *   from which the slopes of its ends follow
 * @param {{low: number, high: number, valley: number[], crest: number[]}} range heights (m) and their colours (0 to 255)
 * @param {HTMLCanvasElement} canvas to be used
 */
export function shaded(rows, { low, high, valley, crest }, canvas = document.createElement("canvas")) {
  const count = rows[0].length - 2;
  let steepest = 0;
  for (const row of rows)
    for (let x = 1; x <= count; x++) steepest = Math.max(steepest, Math.abs(row[x + 1] - row[x - 1]));
  const pixels = new ImageData(count, rows.length);
  let place = 0;
  for (const row of rows) {
    for (let x = 1; x <= count; x++) {
      const slope = steepest ? (row[x + 1] - row[x - 1]) / steepest : 0;
      const level = high > low ? (row[x] - low) / (high - low) : 0.5;
      const light = Math.min(1, Math.max(0, level + RELIEF * slope));
      for (let part = 0; part < 3; part++)
        pixels.data[place++] = Math.round(valley[part] + light * (crest[part] - valley[part]));
      pixels.data[place++] = 255;
    }
  }
  Object.assign(canvas, { width: count, height: rows.length });
  canvas.getContext("2d").putImageData(pixels, 0, 0);
  return canvas;
}
