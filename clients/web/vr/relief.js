/* The mesh of a swatch whose texture is along a line, from its heights; `area_relief` has those over an area.

Model: heights vary along the stroke only, so the top is a strip of quads with the periodic, magnified heights and their
normals. The long sides reach down to the board and show the profile. Crests are light and valleys dark. The highest
crest is in the plane y = 0, where a touch begins.
Limits: at most MOST_POINTS along the stroke; finer profiles are drawn with fewer points. */

const POINTS_PER_PERIOD = 16;
const COARSE_POINTS = 400; // along a swatch with few periods, so that long waves are smooth
const MOST_POINTS = 1800; // at most 10800 triangles per swatch; those of the catalogue have half
const ROWS = [
  // rows of vertices along the stroke: side (0 back, 1 front), on the profile or on the board, direction of the normal
  { across: 0, profile: true, faces: "up" },
  { across: 1, profile: true, faces: "up" },
  { across: 1, profile: true, faces: 1 },
  { across: 1, profile: false, faces: 1 },
  { across: 0, profile: false, faces: -1 },
  { across: 0, profile: true, faces: -1 },
];
const DARKEST = 0.5; // shade of the deepest valley

/** @param {number[]} heights of one period @returns {(turns: number) => number} height at a place, in periods,
 *  interpolated linearly */
function profileOf(heights) {
  return (turns) => {
    const place = (turns - Math.floor(turns)) * heights.length;
    const index = Math.floor(place) % heights.length;
    return heights[index] + (place - Math.floor(place)) * (heights[(index + 1) % heights.length] - heights[index]);
  };
}

/**
 * @param {{heights: number[], period: number, along: number, up: number, length: number, width: number, raised:
 *   number}} surface heights of one period (m), magnification of widths and heights, size of the swatch and its height
 *   over the board (m)
 * @returns {{positions: Float32Array, normals: Float32Array, colours: Float32Array, indices: Uint16Array}} colours are
 *   grey, 0 to 1
 */
export function relief({ heights, period, along, up, length, width, raised }) {
  const periods = length / (period * along);
  const inPeriod = Math.min(heights.length, Math.max(POINTS_PER_PERIOD, COARSE_POINTS / periods));
  const points = Math.max(2, Math.min(MOST_POINTS, Math.ceil(periods * inPeriod)));
  const at = profileOf(heights);
  const top = heights.reduce((most, height) => Math.max(most, height), -Infinity);
  const low = heights.reduce((least, height) => Math.min(least, height), Infinity);
  const step = length / (points - 1);
  const mesh = {
    positions: new Float32Array(points * ROWS.length * 3),
    normals: new Float32Array(points * ROWS.length * 3),
    colours: new Float32Array(points * ROWS.length * 3),
    indices: new Uint16Array(((points - 1) * 3 + 2) * 6),
  };
  for (let point = 0; point < points; point++) {
    const turns = (place) => (place * step) / (period * along);
    const height = at(turns(point));
    const slope = ((at(turns(point + 0.5)) - at(turns(point - 0.5))) * up) / step;
    const norm = Math.hypot(1, slope);
    const shade = top > low ? DARKEST + (1 - DARKEST) * ((height - low) / (top - low)) : 1;
    ROWS.forEach(({ across, profile, faces }, row) => {
      const place = (point * ROWS.length + row) * 3;
      const y = profile ? (height - top) * up : -raised;
      mesh.positions.set([point * step - length / 2, y, (across - 0.5) * width], place);
      mesh.normals.set(faces === "up" ? [-slope / norm, 1 / norm, 0] : [0, 0, faces], place);
      mesh.colours.fill(faces === "up" ? shade : DARKEST, place, place + 3);
    });
  }
  mesh.indices.set(faces(points));
  return mesh;
}

/** @param {number} points along the stroke @returns {number[]} corners of the triangles: top, front, back and both ends
 *  */
function faces(points) {
  const corners = [];
  const width = ROWS.length;
  for (let first = 0; first < (points - 1) * width; first += width) {
    for (const row of [0, 2, 4]) {
      const [a, b, c, d] = [first + row, first + row + 1, first + width + row, first + width + row + 1];
      corners.push(a, b, c, c, b, d);
    }
  }
  const last = (points - 1) * width;
  corners.push(5, 4, 2, 2, 4, 3, last + 2, last + 3, last + 5, last + 5, last + 3, last + 4);
  return corners;
}
