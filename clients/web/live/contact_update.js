/* Contact updates as bytes: 28 bytes, little-endian, `struct` format `<BBHIddf` (docs/live.md). */

const VERSION = 1;
const IS_SPEED = 1;
const NO_LOAD = 2;
const BYTES = 28;

/** Returns the bytes of one update.
 *  seq: integer, 0 to 2**32 - 1. time: s, of any origin. position: m, or speed: m/s. load: N; absent: unchanged. */
export function packContact({ seq, time, position, speed, load }) {
  const isSpeed = speed !== undefined && speed !== null;
  const hasLoad = load !== undefined && load !== null;
  if (isSpeed === (position !== undefined && position !== null)) {
    throw new TypeError("A contact update has either a position or a speed: pass exactly one of them.");
  }
  const view = new DataView(new ArrayBuffer(BYTES));
  view.setUint8(0, VERSION);
  view.setUint8(1, (isSpeed ? IS_SPEED : 0) | (hasLoad ? 0 : NO_LOAD));
  view.setUint16(2, 0, true);
  view.setUint32(4, seq, true);
  view.setFloat64(8, time, true);
  view.setFloat64(16, isSpeed ? speed : position, true);
  view.setFloat32(24, hasLoad ? load : 0, true);
  return view.buffer;
}

/** Converts a contact between position of the finger on the texture (page) and position of the texture under the finger
 *  (protocol): each is the negative of the other. */
export function negated({ position, speed, ...rest }) {
  return {
    ...rest,
    ...(position === undefined ? {} : { position: -position }),
    ...(speed === undefined ? {} : { speed: -speed }),
  };
}
