/* The levels of a relief's texture: heights and slopes of one period, each level half as fine as the one before.

Model: a texel is (height, slope along x, slope along y, mean of the squared slopes). Heights go from 0 (deepest) to 1
(highest), slopes are those of the surface. A coarser texel is the mean of the finer ones, so ridges that are finer than a
pixel become an even shade instead of false stripes. What the mean slopes lose is left in the fourth number.
Limits: heights are resampled linearly to a power of two. */

const [FEWEST, MOST] = [4, 2048]; // heights along a side

/** Returns {levels: [{width, height, texels: Float32Array of 4 numbers each}], low, high (m), slope (rms)}.
 *  heights: m, over one period (m). area: rows of heights (m) over a period across (m); null for a line. */
export function heightLevels({ heights, period, area = null, across = null }) {
  const rows = area ? resampled(area, sizeOf(area.length)) : [heights];
  const fields = rows.map((row) => resampled(row, sizeOf(row.length)));
  let [low, high] = [Infinity, -Infinity];
  for (const row of fields) for (const height of row) [low, high] = [Math.min(low, height), Math.max(high, height)];
  const levels = [finest(fields, { low, high, period, across })];
  while (levels.at(-1).width > 1 || levels.at(-1).height > 1) levels.push(halved(levels.at(-1)));
  return { levels, low, high, slope: Math.sqrt(levels.at(-1).texels[3]) };
}

const sizeOf = (count) => Math.min(MOST, Math.max(FEWEST, 2 ** Math.round(Math.log2(count))));

/** Returns periodic `values`, numbers or rows of numbers, at `count` places. */
function resampled(values, count) {
  if (values.length === count) return values;
  return Array.from({ length: count }, (_, index) => {
    const place = (index / count) * values.length;
    const first = Math.floor(place);
    return between(values[first], values[(first + 1) % values.length], place - first);
  });
}

const between = (first, next, part) =>
  typeof first === "number"
    ? first + part * (next - first)
    : first.map((value, index) => value + part * (next[index] - value));

function finest(rows, { low, high, period, across }) {
  const [width, height] = [rows[0].length, rows.length];
  const [alongX, alongY] = [(2 * period) / width, across ? (2 * across) / height : Infinity];
  const span = high - low || 1;
  const texels = new Float32Array(4 * width * height);
  let place = 0;
  for (let y = 0; y < height; y++) {
    const [row, under, over] = [rows[y], rows[(y + height - 1) % height], rows[(y + 1) % height]];
    for (let x = 0; x < width; x++) {
      const slopeX = (row[(x + 1) % width] - row[(x + width - 1) % width]) / alongX;
      const slopeY = (over[x] - under[x]) / alongY;
      texels.set([(row[x] - low) / span, slopeX, slopeY, slopeX ** 2 + slopeY ** 2], place);
      place += 4;
    }
  }
  return { width, height, texels };
}

function halved({ width, height, texels }) {
  const [wide, high] = [Math.max(1, width / 2), Math.max(1, height / 2)];
  const [stepX, stepY] = [width / wide, height / high];
  const mean = new Float32Array(4 * wide * high);
  for (let y = 0; y < height; y++)
    for (let x = 0; x < width; x++)
      for (let part = 0; part < 4; part++)
        mean[4 * (Math.floor(y / stepY) * wide + Math.floor(x / stepX)) + part] +=
          texels[4 * (y * width + x) + part] / (stepX * stepY);
  return { width: wide, height: high, texels: mean };
}
