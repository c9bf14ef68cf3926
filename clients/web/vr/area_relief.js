/* The mesh of a swatch whose texture is over an area, from heights of one period in both directions.

Model: the top is a grid of magnified heights with their normals; x begins at the left end, y = 0 is in the middle. Sides
reach from its edge down to the board. Crests are light and valleys dark. The highest crest is in the plane y = 0 of the
table, where a touch begins. Widths are magnified equally in both directions.
Limits: at most MOST_POINTS in the grid; finer areas are drawn with fewer points. */

const POINTS_PER_PERIOD = 16;
const MOST_POINTS = 12_000; // 23,500 triangles
const DARKEST = 0.5; // shade of the deepest valley, and of the sides

/** Returns (column, row) => height (m) at a place of the repeated area, both in periods, interpolated bilinearly. */
function heightsOf(area) {
  const count = area.length;
  const at = (row, column) => area[((row % count) + count) % count][((column % count) + count) % count];
  return (x, y) => {
    const [column, row] = [Math.floor(x * count), Math.floor(y * count)];
    const [right, up] = [x * count - column, y * count - row];
    const along = (line) => at(line, column) + right * (at(line, column + 1) - at(line, column));
    return along(row) + up * (along(row + 1) - along(row));
  };
}

/**
 * @param {{area: number[][], period: number, across: number, along: number, up: number, length: number, width: number,
 *   raised: number}} surface rows of heights (m) and their periods (m), magnification of widths and heights, size of the
 *   swatch and its height over the board (m)
 * @returns {{positions: Float32Array, normals: Float32Array, colours: Float32Array, indices: Uint16Array}} colours are
 *   grey, 0 to 1
 */
export function areaRelief({ area, period, across, along, up, length, width, raised }) {
  const finest = (Math.min(period, across) * along) / POINTS_PER_PERIOD;
  const step = Math.max(finest, Math.sqrt((length * width) / MOST_POINTS));
  const [columns, rows] = [length, width].map((size) => Math.max(2, Math.floor(size / step)));
  const heights = area.flat();
  const top = heights.reduce((most, height) => Math.max(most, height), -Infinity);
  const low = heights.reduce((least, height) => Math.min(least, height), Infinity);
  const at = heightsOf(area);
  const height = (x, z) => at((x + length / 2) / (period * along), -z / (across * along));
  const mesh = { positions: [], normals: [], colours: [], indices: [] };
  const add = (place, normal, shade) => {
    mesh.positions.push(...place);
    mesh.normals.push(...normal);
    mesh.colours.push(shade, shade, shade);
    return mesh.positions.length / 3 - 1;
  };
  const placeOf = (column, row) => {
    const [x, z] = [length * (column / (columns - 1) - 0.5), width * (row / (rows - 1) - 0.5)];
    return [x, (height(x, z) - top) * up, z];
  };
  for (let row = 0; row < rows; row++)
    for (let column = 0; column < columns; column++) {
      const [x, y, z] = placeOf(column, row);
      const slope = (dx, dz) => ((height(x + dx, z + dz) - height(x - dx, z - dz)) * up) / step;
      const [alongX, alongZ] = [slope(step / 2, 0), slope(0, step / 2)];
      const norm = Math.hypot(alongX, 1, alongZ);
      const shade = top > low ? DARKEST + (1 - DARKEST) * (1 + y / (up * (top - low))) : 1;
      add([x, y, z], [-alongX / norm, 1 / norm, -alongZ / norm], shade);
    }
  for (let row = 0; row < rows - 1; row++)
    for (let column = 0; column < columns - 1; column++) {
      const corner = row * columns + column;
      mesh.indices.push(...quad(corner, corner + columns, corner + 1, corner + columns + 1));
    }
  for (const { normal, count, grid } of sidesOf(columns, rows))
    for (let point = 0; point < count; point++) {
      const [x, y, z] = placeOf(...grid(point));
      const upper = add([x, y, z], normal, DARKEST);
      add([x, -raised, z], normal, DARKEST);
      if (point > 0) mesh.indices.push(...quad(upper - 2, upper - 1, upper, upper + 1));
    }
  return {
    positions: new Float32Array(mesh.positions),
    normals: new Float32Array(mesh.normals),
    colours: new Float32Array(mesh.colours),
    indices: new Uint16Array(mesh.indices),
  };
}

/** Returns the corners of the two triangles of a quad, seen with `a` above `b`, and `c` above `d` on their right. */
const quad = (a, b, c, d) => [a, b, c, c, b, d];

/** Returns the sides of a grid: their normals, and the grid's points from left to right as seen from outside. */
function sidesOf(columns, rows) {
  return [
    { normal: [0, 0, 1], count: columns, grid: (point) => [point, rows - 1] },
    { normal: [0, 0, -1], count: columns, grid: (point) => [columns - 1 - point, 0] },
    { normal: [1, 0, 0], count: rows, grid: (point) => [columns - 1, rows - 1 - point] },
    { normal: [-1, 0, 0], count: rows, grid: (point) => [0, point] },
  ];
}
