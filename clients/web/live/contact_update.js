/* Contact updates as bytes (docs/live.md), little-endian: a position or a speed in 28 bytes, `struct` format
`<BBHIddf`; a place in 40 bytes, `<BBHIdddff`, which version 2 of the protocol reads. Credit is a u32 after either.

Model: a position is how far the surface has moved under the finger. A place is where the finger is on the surface. Each
is the negative of the other. */

const [VERSION, PLACE_VERSION] = [1, 2];
const [IS_SPEED, NO_LOAD, NO_DIRECTION] = [1, 2, 4];
const [BYTES, PLACE_BYTES, CREDIT_BYTES] = [28, 40, 4];

const isGiven = (value) => value !== undefined && value !== null;

/** Returns the bytes of one update.
 *  seq: integer, 0 to 2**32 - 1. time: s, of any origin. position: m, or speed: m/s, or x and y: m. direction: rad, with
 *  x and y; absent: unchanged. load: N; absent: unchanged. more: credit, frames; absent: none. */
export function packContact(contact) {
  const { seq, time, position, speed, x, y, direction, load } = contact;
  const isPlace = isGiven(x) && isGiven(y);
  const ways = [isGiven(position), isGiven(speed), isGiven(x) || isGiven(y)].filter(Boolean).length;
  if (ways !== 1 || isGiven(x) !== isGiven(y) || (isGiven(direction) && !isPlace)) {
    throw new TypeError("A contact update has a position, a speed, or x and y: pass exactly one of them.");
  }
  const size = isPlace ? PLACE_BYTES : BYTES;
  const view = new DataView(new ArrayBuffer(contact.more ? size + CREDIT_BYTES : size));
  view.setUint8(0, isPlace ? PLACE_VERSION : VERSION);
  view.setUint8(1, flagsOf(contact, isPlace));
  view.setUint16(2, 0, true);
  view.setUint32(4, seq, true);
  view.setFloat64(8, time, true);
  view.setFloat64(16, x ?? speed ?? position, true);
  if (isPlace) {
    view.setFloat64(24, y, true);
    view.setFloat32(32, direction ?? 0, true);
  }
  view.setFloat32(isPlace ? 36 : 24, load ?? 0, true);
  if (contact.more) view.setUint32(size, contact.more, true);
  return view.buffer;
}

function flagsOf({ speed, direction, load }, isPlace) {
  const noDirection = isPlace && !isGiven(direction) ? NO_DIRECTION : 0;
  return (isGiven(speed) ? IS_SPEED : 0) | (isGiven(load) ? 0 : NO_LOAD) | noDirection;
}

/** Returns a contact as a texture along a line takes it: with a position in place of x, y and the direction. */
export function alongLine({ x, y, direction, ...rest }) {
  return x === undefined ? rest : { ...rest, position: 0 - x }; // a difference, because -x would make -0 of 0
}

/** Converts a contact of the page to one of the stream. position: m, of the finger on the texture. y: m across, 0 if
 *  absent. direction: rad, or speed: m/s, of the finger. */
export function placed({ position, speed, y = 0, direction, ...rest }) {
  if (speed !== undefined) return { ...rest, speed: -speed };
  return { ...rest, x: position, y, ...(direction === undefined ? {} : { direction }) };
}
