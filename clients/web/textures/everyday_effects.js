/* The effects of the everyday scan of a texture, such as the friction of glass: they come and go with the texture.

Limits: an effect that was written in the scene remains, unless it is that of a texture of the list. */

import { same, withField } from "../scene/merge.js";

const effectsOf = (entry) => Object.entries(entry?.everyday?.effects ?? {});

/** Returns `scene` with the effects of `entry` in place of those of other entries. entries: of the TextureList. */
export function withEverydayEffects(scene, entry, entries) {
  let changed = scene;
  for (const [name, settings] of entries.flatMap(effectsOf))
    if (same(settings, changed.effects?.[name] ?? null)) changed = withField(changed, ["effects", name], undefined);
  for (const [name, settings] of effectsOf(entry)) changed = withField(changed, ["effects", name], settings);
  return changed;
}
