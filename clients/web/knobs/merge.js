/* Scenes changed by fields and by parts: what a change displaces, and the smallest part that tells the service of it.

Model: JSON merge patch (RFC 7396) with the displacements of docs/scene.md, "Changing a scene with a part of one".
Limits: nothing is checked; the service reads the result. */

const AMPLITUDES = { finger: "ridge_amplitude", texture: "amplitude" };

const isObject = (value) => typeof value === "object" && value !== null && !Array.isArray(value);

/** True where two JSON values are equal; the order of an object's names does not count. */
export function same(one, other) {
  if (!isObject(one) || !isObject(other)) return JSON.stringify(one) === JSON.stringify(other);
  const names = Object.keys(one);
  return (
    names.length === Object.keys(other).length && names.every((name) => name in other && same(one[name], other[name]))
  );
}

/**
 * The names of the fields of `present`, a section of a scene, that naming `name` with `value` displaces.
 * @returns {string[]}
 */
export function displaced(section, present, name, value) {
  const given = Object.keys(present).filter((key) => key !== name && present[key] !== null);
  const among = (...names) => given.filter((key) => names.includes(key));
  if (section === "texture" && name === "kind") return given;
  if (section === "scan" && ["stroke", "trajectory"].includes(name))
    return among("speed", "load", "stroke", "trajectory");
  if (section === "scan" && ["speed", "load"].includes(name)) return among("stroke", "trajectory");
  const pair = [AMPLITUDES[section], "roughness"];
  if (AMPLITUDES[section] && pair.includes(name)) return among(...pair);
  if (section === "output" && name === "channels") return among("quantity", "full_scale");
  if (section === "output" && name === "full_scale") return among("channels");
  if (section === "output" && name === "quantity") {
    return among("channels", ...(value === (present.quantity ?? "acceleration") ? [] : ["full_scale"]));
  }
  return [];
}

/**
 * `scene` with the field at `path` (names and indices) set to `value`; undefined takes it out. What it displaces goes.
 * @returns {object} a new scene; empty sections are left out
 */
export function withField(scene, path, value) {
  const changed = structuredClone(scene);
  const [section, name] = path;
  if (path.length > 1 && value !== undefined) {
    const present = changed[section] ?? {};
    const named = path.length === 2 ? value : (present[name] ?? {});
    for (const gone of displaced(section, present, name, named)) delete present[gone];
  }
  let place = changed;
  for (const step of path.slice(0, -1)) {
    if (!isObject(place[step]) && !Array.isArray(place[step])) place[step] = {};
    place = place[step];
  }
  if (value === undefined) delete place[path.at(-1)];
  else place[path.at(-1)] = value;
  for (const key of Object.keys(changed))
    if (isObject(changed[key]) && !Object.keys(changed[key]).length) delete changed[key];
  return changed;
}

/** `scene` merged with the partial scene `part`, as the service merges it. */
export function merged(scene, part) {
  const kept = { ...scene };
  for (const [section, change] of Object.entries(part)) {
    if (!isObject(change) || !isObject(kept[section])) continue;
    const named = Object.entries(change).filter(([, value]) => value !== null);
    kept[section] = pruned(section, kept[section], named);
  }
  return patched(kept, part);
}

function pruned(section, present, named) {
  const names = named.map(([name]) => name);
  if (section === "texture" && names.includes("kind")) return {};
  if (section === "scan" && (names.includes("stroke") || names.includes("trajectory"))) return {};
  if (
    section === "scan" &&
    ["speed", "load"].some((name) => names.includes(name)) &&
    (present.stroke ?? present.trajectory)
  )
    return {};
  const left = { ...present };
  for (const [name, value] of named) {
    if (section === "output" && name === "full_scale") continue;
    if (AMPLITUDES[section] && [AMPLITUDES[section], "roughness"].includes(name)) delete left[name];
    for (const gone of displaced(section, present, name, value)) delete left[gone];
  }
  return left;
}

/** RFC 7396, section 2, for a patch that is an object. */
function patched(target, patch) {
  const result = isObject(target) ? { ...target } : {};
  for (const [name, change] of Object.entries(patch)) {
    if (change === null) delete result[name];
    else result[name] = isObject(change) ? patched(result[name], change) : change;
  }
  return result;
}

/**
 * The fields of `complete`, the complete scene of `scene`, that `scene` leaves out: what it has is no default.
 * @returns {object} objects in objects; the items of a list by their index
 */
export function unwritten(complete, scene) {
  const left = {};
  for (const [name, value] of Object.entries(complete)) {
    const written = scene[name] ?? null;
    if (written === null) left[name] = value;
    else if (isNested(written) && isNested(value)) left[name] = unwritten(value, written);
  }
  return left;
}

const isNested = (value) => typeof value === "object" && value !== null;

function difference(before, after) {
  const part = {};
  for (const name of new Set([...Object.keys(before), ...Object.keys(after)])) {
    if (!(name in after)) part[name] = null;
    else if (!(name in before)) part[name] = after[name];
    else if (!same(before[name], after[name])) {
      part[name] =
        isObject(before[name]) && isObject(after[name]) ? difference(before[name], after[name]) : after[name];
    }
  }
  return part;
}

/**
 * The partial scene that turns `before` into `after` at the service: the fields that differ, and a section whole where
 * the fields alone would displace others.
 */
export function partBetween(before, after) {
  const part = difference(before, after);
  for (const [section, change] of Object.entries(part)) {
    if (
      change === null ||
      same(merged({ [section]: before[section] ?? {} }, { [section]: change }), { [section]: after[section] })
    )
      continue;
    const gone = Object.keys(before[section] ?? {}).filter((name) => !(name in after[section]));
    part[section] = { ...Object.fromEntries(gone.map((name) => [name, null])), ...after[section] };
  }
  return part;
}

/** True where going from `before` to `after` changes what a session keeps: rate, channels, quantities, full scale. */
export function changesWhatIsFixed(before, after) {
  const kept = ({ output = {}, effects = {} }) => {
    const { quantity, channels, sample_rate: rate, full_scale: scale } = output;
    return [
      quantity ?? "acceleration",
      channels ?? null,
      rate ?? 48000,
      scale ?? null,
      isObject(effects.tangential),
      effects.tangential?.full_scale ?? null,
    ];
  };
  return !same(kept(before), kept(after));
}
