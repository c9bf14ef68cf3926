/* A contact update as it stands on the wire: 28 bytes, little-endian, `struct` `<BBHIddf` of docs/live.md.

Limits: exactly one of position and speed; the service refuses what is out of its ranges. */

const VERSION = 1;
const IS_SPEED = 1;
const NO_LOAD = 2;
const BYTES = 28;

/** Returns the bytes of one update.
 *  seq: whole, 0 to 2**32 - 1. time: s, of any origin. position: m, or speed: m/s. load: N, absent = as it was. */
export function packContact({ seq, time, position, speed, load }) {
  const isSpeed = speed !== undefined && speed !== null;
  const hasLoad = load !== undefined && load !== null;
  if (isSpeed === (position !== undefined && position !== null)) {
    throw new TypeError("A contact has a position or a speed: give exactly one of them.");
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

/** Returns a contact given by where the finger is on the surface as one given by where the surface stands under the
 *  finger, which is what the protocol counts, or the reverse: one moves as the other does not. */
export function turned({ position, speed, ...rest }) {
  return {
    ...rest,
    ...(position === undefined ? {} : { position: -position }),
    ...(speed === undefined ? {} : { speed: -speed }),
  };
}
