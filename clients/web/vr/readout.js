/* What the table tells in words: the touch, a hint beside the swatches, and the scale. */

import { MOST_LOAD, STIFFNESS } from "./contact_model.js";
import { WIDTH } from "./table_layout.js";

/** Returns the touches as text. touches: {index, position (m), load (N)}. beside: whether a fingertip presses beside the
 *  swatches. */
export function touchesInWords(touches, beside, swatches) {
  if (!touches.length) return beside ? hintOf(beside, swatches) : "";
  return touches
    .map(
      ({ index, position, load }) =>
        `${nameOf(swatches[index])}: ${(position * 1e3).toFixed(0)} mm, ${load.toFixed(2)} N`,
    )
    .join("   ");
}

/** Returns what to do beside the swatches. beside: a Set of the nearest ones. */
export function hintOf(beside, swatches) {
  const [nearest] = beside;
  return nearest === undefined ? "" : `No texture here. Nearest: ${nameOf(swatches[nearest])}`;
}

/** Returns the name of a swatch, without its explanation. */
export const nameOf = ({ title }) => title.split(":")[0];

/** Returns the scale of the table as text. */
export function scaleInWords() {
  const depth = `${(1e3 / STIFFNESS).toFixed(0)} mm of depth are 1 N, up to ${MOST_LOAD} N`;
  return (
    `Swatches are ${(WIDTH * 1e3).toFixed(0)} mm wide and are touched at true scale. Only their drawing is magnified, as ` +
    `the labels say. With a headset, ${depth}; the panel behind the table makes it more or less. Each swatch has its own ` +
    `full scale, so loudness cannot be compared.`
  );
}
