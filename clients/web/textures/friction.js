/* The friction of textures that are felt by it, such as glass: the effect of their everyday scan comes and goes with them.

Limits: a friction that was written in the scene remains, unless it is that of a texture of the list. */

import { same, withField } from "../scene/merge.js";

const PATH = ["effects", "stick_slip"];

const frictionOf = (entry) => entry?.everyday?.effects?.stick_slip;

/** Returns `scene` with the friction of `entry`, or without that of another entry. entries: of the TextureList. */
export function withFriction(scene, entry, entries) {
  const [own, present] = [frictionOf(entry), scene.effects?.stick_slip];
  if (own) return withField(scene, PATH, own);
  const brought = present && entries.some((one) => frictionOf(one) && same(frictionOf(one), present));
  return brought ? withField(scene, PATH, undefined) : scene;
}
