/* Reads the triangles of a glTF 2.0 file: GLB, or JSON with its buffers inside.

Source: Khronos Group, "glTF 2.0 Specification", 2021, sections 3.6 (buffers and accessors), 3.7 (geometry), 4 (GLB).
Limits: triangles with POSITION, NORMAL and indices; the name and the base colour of a material. No pictures, skins,
animation, sparse accessors or compression. */

import { Explained } from "../explained.js";

const [MAGIC, JSON_CHUNK, BINARY_CHUNK] = [0x46546c67, 0x4e4f534a, 0x004e4942];
const TYPES = { 5121: Uint8Array, 5123: Uint16Array, 5125: Uint32Array, 5126: Float32Array };
const COUNTS = { SCALAR: 1, VEC3: 3 };
const TRIANGLES = 4;
const GREY = [0.8, 0.8, 0.8];

/** Returns the parts of a file, an ArrayBuffer: [{name: of the material or "", colour: [red, green, blue], geometry: a
 *  BufferGeometry in coordinates of the file, m, y upwards}]. Throws an Explained. */
export function readGltf(three, buffer) {
  const { document, binary } = unpacked(buffer);
  if (!document.asset?.version?.startsWith("2."))
    throw new Explained(`The file is glTF ${document.asset?.version ?? "without a version"}. Export it as glTF 2.0.`);
  const required = document.extensionsRequired ?? [];
  if (required.length) throw new Explained(`The file requires ${required.join(", ")}. Export it without compression.`);
  const reader = { document, buffers: (document.buffers ?? []).map((one) => bufferOf(one, binary)) };
  const parts = [];
  const scene = document.scenes?.[document.scene ?? 0];
  const roots = scene?.nodes ?? (document.nodes ?? []).map((_, index) => index);
  for (const root of roots) collect(three, reader, root, new three.Matrix4(), parts, 0);
  if (!parts.length) throw new Explained("The file has no triangles. Export a mesh.");
  return parts;
}

function unpacked(buffer) {
  const view = new DataView(buffer);
  if (buffer.byteLength < 12 || view.getUint32(0, true) !== MAGIC) return { document: parsed(buffer), binary: null };
  let [document, binary] = [null, null];
  for (let place = 12; place + 8 <= buffer.byteLength; ) {
    const [length, kind] = [view.getUint32(place, true), view.getUint32(place + 4, true)];
    if (place + 8 + length > buffer.byteLength)
      throw new Explained("The GLB file is cut off. Export or download it again.");
    const chunk = buffer.slice(place + 8, place + 8 + length);
    if (kind === JSON_CHUNK) document = parsed(chunk);
    if (kind === BINARY_CHUNK) binary = chunk;
    place += 8 + length;
  }
  if (!document) throw new Explained("The GLB file has no description. Export it again.");
  return { document, binary };
}

function parsed(bytes) {
  try {
    return JSON.parse(new TextDecoder().decode(bytes));
  } catch {
    throw new Explained("This is no glTF file. Export the object as GLB.");
  }
}

function bufferOf({ uri }, binary) {
  if (uri === undefined && binary) return binary;
  const [, text] = /^data:[^,]*;base64,(.*)$/.exec(uri ?? "") ?? [];
  if (text === undefined)
    throw new Explained("The numbers are in another file. Export the object as GLB, which is one file.");
  return Uint8Array.from(atob(text), (byte) => byte.charCodeAt(0)).buffer;
}

function collect(three, reader, index, above, parts, depth) {
  const node = reader.document.nodes?.[index];
  if (!node || depth > 100) throw new Explained("The nodes of the file form no tree. Export it again.");
  const matrix = above.clone().multiply(matrixOf(three, node));
  for (const primitive of reader.document.meshes?.[node.mesh]?.primitives ?? []) {
    if ((primitive.mode ?? TRIANGLES) !== TRIANGLES) continue;
    const { name = "", pbrMetallicRoughness: look } = reader.document.materials?.[primitive.material] ?? {};
    const geometry = geometryOf(three, reader, primitive).applyMatrix4(matrix);
    parts.push({ name, colour: look?.baseColorFactor?.slice(0, 3) ?? GREY, geometry });
  }
  for (const child of node.children ?? []) collect(three, reader, child, matrix, parts, depth + 1);
}

function matrixOf({ Matrix4, Quaternion, Vector3 }, { matrix, translation, rotation, scale }) {
  if (matrix) return new Matrix4().fromArray(matrix);
  const [place, turn, size] = [translation ?? [0, 0, 0], rotation ?? [0, 0, 0, 1], scale ?? [1, 1, 1]];
  return new Matrix4().compose(new Vector3(...place), new Quaternion(...turn), new Vector3(...size));
}

function geometryOf(three, reader, { attributes, indices }) {
  const geometry = new three.BufferGeometry();
  const positions = numbersOf(reader, attributes.POSITION);
  geometry.setAttribute("position", new three.BufferAttribute(positions, 3));
  if (indices !== undefined) geometry.setIndex(new three.BufferAttribute(numbersOf(reader, indices), 1));
  if (attributes.NORMAL === undefined) geometry.computeVertexNormals();
  else geometry.setAttribute("normal", new three.BufferAttribute(numbersOf(reader, attributes.NORMAL), 3));
  const count = positions.length / 3;
  if (geometry.index?.array.some((one) => one >= count))
    throw new Explained("A triangle has a corner that is not there.");
  return geometry;
}

/** Returns the numbers of an accessor. */
function numbersOf({ document, buffers }, index) {
  const accessor = document.accessors?.[index];
  const view = document.bufferViews?.[accessor?.bufferView];
  const Type = TYPES[accessor?.componentType];
  const count = COUNTS[accessor?.type];
  if (!view || !Type || !count || accessor.sparse)
    throw new Explained(
      `The numbers ${index} of the file are of a kind that is not read. Export plain triangles as GLB.`,
    );
  const stride = (view.byteStride ?? 0) / Type.BYTES_PER_ELEMENT || count;
  const begin = (view.byteOffset ?? 0) + (accessor.byteOffset ?? 0);
  const length = (accessor.count - 1) * stride + count;
  const bytes = buffers[view.buffer]?.slice(begin, begin + length * Type.BYTES_PER_ELEMENT);
  if (bytes?.byteLength !== length * Type.BYTES_PER_ELEMENT)
    throw new Explained("The file is shorter than it says. Export or download it again.");
  const all = new Type(bytes);
  if (stride === count) return all;
  return Type.from(
    { length: accessor.count * count },
    (_, place) => all[Math.floor(place / count) * stride + (place % count)],
  );
}
