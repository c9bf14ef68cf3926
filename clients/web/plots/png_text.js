/* A text in a PNG file, as a chunk iTXt after its header.

Source: W3C, "Portable Network Graphics (PNG) Specification", third edition, sections 5.3, 5.5 and 11.3.3.4. */

const HEAD = 33; // bytes: signature and the chunk IHDR
const POLYNOMIAL = 0xedb88320; // of CRC-32

/** Returns the PNG file `blob` with `text` under `keyword`, 1 to 79 Latin letters. */
export async function withText(blob, keyword, text) {
  const encoder = new TextEncoder();
  const content = encoder.encode(`iTXt${keyword}\0\0\0\0\0${text}`); // not compressed, no language, no translation
  const chunk = new Uint8Array(content.length + 8);
  const view = new DataView(chunk.buffer);
  view.setUint32(0, content.length - 4);
  chunk.set(content, 4);
  view.setUint32(content.length + 4, crcOf(content));
  return new Blob([blob.slice(0, HEAD), chunk, blob.slice(HEAD)], { type: "image/png" });
}

function crcOf(bytes) {
  let crc = 0xffffffff;
  for (const byte of bytes) {
    crc ^= byte;
    for (let bit = 0; bit < 8; bit++) crc = crc & 1 ? (crc >>> 1) ^ POLYNOMIAL : crc >>> 1;
  }
  return (crc ^ 0xffffffff) >>> 0;
}
