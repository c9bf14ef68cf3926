/* Loads the swatches of the table: textures of the catalogue and their heights. Textures without heights are omitted.
 */

import { START_SCENE } from "../scene/start_scene.js";
import { call } from "../service.js";
import { chooseSwatches, sizeText } from "./table_layout.js";

const POINTS = 512; // heights per period; no swatch shows more
const FELT = { low: 10, high: 1000 }; // Hz, range of vibration that a fingertip feels

/**
 * @returns {Promise<{name: string, title: string, scene: object, period: number, height: number, heights: number[],
 *   words: string}[]>} finest first; period, height from valley to crest, and heights of one period in m
 */
export async function loadSwatches() {
  const { textures } = await call("GET", "/v1/textures");
  const pictured = await Promise.all(textures.map(picture));
  return chooseSwatches(pictured.filter(Boolean));
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

async function picture({ name, title, scene: textured }) {
  const scene = { ...textured, ...START_SCENE };
  const { texture } = await call("POST", "/v1/picture", { scene, points: POINTS, phases: 0 });
  const { period, heights } = texture;
  if (!(period > 0) || heights.length < 2) return null;
  const [least, most] = heights.reduce(
    ([low, high], height) => [Math.min(low, height), Math.max(high, height)],
    [Infinity, -Infinity],
  );
  const height = most - least;
  return {
    name,
    title,
    scene,
    period,
    height,
    heights,
    words: sizeText(period, height),
  };
}
