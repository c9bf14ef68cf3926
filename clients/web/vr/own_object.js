/* The user's own object beside the table, from a glTF file.

Model: a part whose material has the name of a texture of the service is touched with that texture, where its bounding
box lies seen from above. Its position begins at the left end of that box. Other parts are drawn only. The highest
point of the object lies in the plane of the swatches.
Limits: for the finger all parts are flat and in that plane, whatever is drawn; objects up to LARGEST. */

import { Explained } from "../explained.js";
import { START_SCENE } from "../scene/start_scene.js";
import { call } from "../service.js";
import { readGltf } from "./gltf.js";

const LARGEST = 0.5; // m, which a person reaches
const SMALLEST = 0.005; // m, of a part that can be touched
const APART = 0.03; // m from the table

/** Adds the object of `file`, a File, to `room` and its parts to `swatches`; returns the added swatches. Throws an
 *  Error with a sentence; then nothing is added. */
export async function addObject(room, swatches, file) {
  const { three, layout } = room;
  const parts = readGltf(three, await file.arrayBuffer());
  const { textures } = await call("GET", "/v1/textures");
  const known = new Map(textures.map((entry) => [entry.name, entry]));
  if (!parts.some(({ name }) => known.has(name))) throw new Explained(sentenceOf(parts));
  const whole = new three.Box3();
  for (const { geometry } of parts) whole.union(boxOf(geometry));
  const size = whole.getSize(new three.Vector3());
  const most = Math.max(size.x, size.z);
  if (!(most <= LARGEST))
    throw new Explained(
      `The object is ${most.toPrecision(2)} m long. Scale it to at most ${LARGEST} m; glTF is in metres.`,
    );
  const shift = [layout.width / 2 + APART - whole.min.x, -whole.max.y, -(whole.min.z + whole.max.z) / 2];
  const meshes = parts.map(({ geometry, colour }) => {
    geometry.translate(...shift);
    const color = new three.Color(...colour);
    return new three.Mesh(geometry, new three.MeshStandardMaterial({ color, roughness: 0.7, side: three.DoubleSide }));
  });
  const touchable = parts.flatMap(({ name }, index) => {
    const place = placeOf(boxOf(meshes[index].geometry));
    return known.has(name) && Math.min(place.length, place.width) >= SMALLEST
      ? [{ name, mesh: meshes[index], place }]
      : [];
  });
  if (!touchable.length)
    throw new Explained(`No named part is at least ${1e3 * SMALLEST} mm long and wide. Scale it up.`);
  const added = touchable.map(({ name }) => swatchOf(known.get(name), file.name));
  swatches.push(...added);
  room.addObject(meshes, touchable, shift[0] + whole.max.x);
  return added;
}

function boxOf(geometry) {
  geometry.computeBoundingBox();
  return geometry.boundingBox;
}

function placeOf({ min, max }) {
  return { x: (min.x + max.x) / 2, z: (min.z + max.z) / 2, length: max.x - min.x, width: max.z - min.z };
}

function swatchOf({ name, title, scene: textured }, file) {
  return { name, title: `${file}, ${title}`, words: `as ${name}`, own: true, scene: { ...textured, ...START_SCENE } };
}

function sentenceOf(parts) {
  const names = [...new Set(parts.map(({ name }) => `"${name}"`))].slice(0, 4).join(", ");
  return `No material of the file has the name of a texture: it has ${names}. Name one "grating-800um-40um", for example.`;
}
