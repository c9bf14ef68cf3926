/* The entries of the list of textures by their groups. */

/** Returns [group, entries] for each group, in the order of its first entry. `Map.groupBy` is missing in browsers that the
 *  page supports (docs/touch-page.md). */
export function byGroup(entries) {
  const groups = new Map();
  for (const entry of entries) groups.set(entry.group, [...(groups.get(entry.group) ?? []), entry]);
  return [...groups];
}
