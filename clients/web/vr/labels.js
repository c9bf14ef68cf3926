/* The labels of all swatches, as one texture and one mesh, which need one draw call.

Model: each label is a cell of the texture, shown by a quad in front of its swatch.
Limits: text that is longer than its cell is drawn smaller. */

import { LABEL, LENGTH, RAISED, WIDTH, labelLines } from "./table_layout.js";

const CELL = { width: 768, height: Math.round((768 * LABEL) / LENGTH) }; // px of 0.18 mm, finer than a headset shows
const COLUMNS = 2;
const SIZES = [54, 46, 46]; // pixels, of each line
const BASELINES = [56, 122, 182]; // pixels from the top of a cell
const LARGE = { size: 84, baselines: [84, 176] }; // pixels, for a small picture: the title alone, in two lines
const BEHIND = 0.004; // m between a swatch and its label
const OVER_BOARD = 5e-4; // m, enough for the depth buffer to separate label and board

/**
 * @param {object} three the module
 * @param {{title: string, wave: number, rough: boolean, height: number}[]} swatches lengths in m
 * @param {{x: number, z: number}[]} places centres of the swatches (m)
 * @param {{ink: string, faint: string}} colours CSS colours of the first line and of the others
 * @param {boolean} large whether the title alone is written, in large letters
 * @returns {Mesh} in coordinates of the table
 */
export function labelMesh(three, swatches, places, { ink, faint }, large = false) {
  const rows = Math.max(1, Math.ceil(swatches.length / COLUMNS));
  const picture = document.createElement("canvas");
  picture.width = CELL.width * COLUMNS;
  picture.height = CELL.height * rows;
  const pen = picture.getContext("2d");
  const [positions, places2d, corners] = [[], [], []];
  swatches.forEach((swatch, index) => {
    const [column, row] = [index % COLUMNS, Math.floor(index / COLUMNS)];
    const lines = labelLines(swatch);
    const baselines = large ? LARGE.baselines : BASELINES;
    (large ? wrapped(pen, lines[0]) : lines).forEach((line, number) => {
      const size = large ? LARGE.size : SIZES[number];
      pen.font = fontOf(size, large || !number);
      pen.font = fontOf(size * Math.min(1, (CELL.width - 8) / pen.measureText(line).width), large || !number);
      pen.fillStyle = number && !large ? faint : ink;
      pen.fillText(line, column * CELL.width, row * CELL.height + baselines[number]);
    });
    const [u, v] = [column / COLUMNS, 1 - row / rows];
    places2d.push(u, v, u + 1 / COLUMNS, v, u, v - 1 / rows, u + 1 / COLUMNS, v - 1 / rows);
    const left = places[index].x - LENGTH / 2;
    const back = places[index].z + WIDTH / 2 + BEHIND;
    const front = back + LABEL;
    const y = OVER_BOARD - RAISED;
    positions.push(left, y, back, left + LENGTH, y, back, left, y, front, left + LENGTH, y, front);
    const first = index * 4;
    corners.push(first, first + 2, first + 1, first + 1, first + 2, first + 3);
  });
  const geometry = new three.BufferGeometry();
  geometry.setAttribute("position", new three.Float32BufferAttribute(positions, 3));
  geometry.setAttribute("uv", new three.Float32BufferAttribute(places2d, 2));
  geometry.setIndex(corners);
  const texture = new three.CanvasTexture(picture);
  texture.colorSpace = three.SRGBColorSpace;
  texture.anisotropy = 8;
  return new three.Mesh(geometry, new three.MeshBasicMaterial({ map: texture, transparent: true, depthWrite: false }));
}

const fontOf = (size, bold) => `${bold ? "600 " : ""}${size}px system-ui, sans-serif`;

/** Returns `text` in at most two lines, the first as long as fits. */
function wrapped(pen, text) {
  pen.font = fontOf(LARGE.size, true);
  const words = text.split(" ");
  let first = words.shift();
  while (words.length && pen.measureText(`${first} ${words[0]}`).width < CELL.width - 8) first += ` ${words.shift()}`;
  return [first, words.join(" ")].filter(Boolean);
}
