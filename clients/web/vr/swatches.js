/* Loads the swatches of the table and their heights: some textures of each group of the catalogue, then the newest of
those that were imported.

Model: a rough texture and an imported one have no visible period. The typical wave is that of the sinusoid with
the same Rq and the same rms slope, 2 pi Rq / slope.
Limits: textures without heights are omitted. */

import { START_SCENE } from "../scene/start_scene.js";
import { call } from "../service.js";
import { offered } from "../textures/texture_list.js";
import { chooseOwn, chooseSwatches, sizeText } from "./table_layout.js";

const POINTS = { periodic: 512, rough: 2048 }; // heights per period; no swatch shows more
const AREA = 128; // heights per side of an area
const FELT = { low: 10, high: 1000 }; // Hz, range of vibration that a fingertip feels

/**
 * @returns {Promise<{name: string, title: string, own: boolean, scene: object, period: number, wave: number, rough: boolean,
 *   height: number, heights: number[], area?: number[][], across?: number, words: string}[]>} those of the catalogue, the
 *   finest first, then the imported ones; period, typical wave, height from valley to crest, and heights of one period
 *   in m; own: whether it was imported; of a texture over an area also rows of heights, and the period across
 */
export async function loadSwatches() {
  const { textures } = await call("GET", "/v1/textures");
  const catalogue = offered(textures.filter(({ stored, everyday }) => !stored && !everyday?.effects)); // has heights
  const listed = chooseSwatches(catalogue).map(picture);
  const own = chooseOwn(textures).map((entry) => picture(entry).catch(() => null)); // a scene may refuse it
  const swatches = (await Promise.all(listed)).filter(Boolean).sort((one, other) => one.wave - other.wave);
  return [...swatches, ...(await Promise.all(own)).filter(Boolean)];
}

/** @returns {Promise<{frequencies: number[], displacement: number[]} | null>} detection threshold, Hz and m; null if
 *  the service has none */
export async function loadThreshold() {
  try {
    return await call("GET", `/v1/threshold?name=fingertip&low=${FELT.low}&high=${FELT.high}&points=100`);
  } catch {
    return null;
  }
}

async function picture({ name, title, stored, scene: textured }) {
  const scene = { ...textured, ...START_SCENE };
  const rough = stored || ["rough", "rough_area"].includes(textured.texture.kind);
  const points = rough ? POINTS.rough : POINTS.periodic;
  // Only the texture is read. Where `textured` names no finger, it has a comb, which is drawn twenty times faster.
  const { texture } = await call("POST", "/v1/picture", { scene: textured, points, phases: 0, area: AREA });
  const { period, heights, area, across } = texture;
  if (!(period > 0) || heights.length < 2) return null;
  const [least, most] = (area?.flat() ?? heights).reduce(
    ([low, high], height) => [Math.min(low, height), Math.max(high, height)],
    [Infinity, -Infinity],
  );
  const height = most - least;
  const wave = rough ? typicalWave(heights, period) : period;
  return {
    name,
    own: Boolean(stored),
    title: stored ? name : title.replace(" um", " µm"),
    scene,
    period,
    wave,
    rough,
    height,
    heights,
    area,
    across,
    words: sizeText({ wave, rough, height }),
  };
}

/** Returns the typical wave (m) of a rough profile; heights: of one period, about their mean. */
function typicalWave(heights, period) {
  const step = period / heights.length;
  const squares = (values) => values.reduce((sum, value) => sum + value ** 2, 0);
  const slopes = heights.map((height, index) => (heights[(index + 1) % heights.length] - height) / step);
  return 2 * Math.PI * Math.sqrt(squares(heights) / squares(slopes));
}
