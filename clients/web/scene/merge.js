/* Changes of scenes: setting a field, merging a partial scene, and the partial scene between two scenes.

Model: JSON merge patch (RFC 7396), where setting some fields removes others (docs/scene.md, "Changing a scene with a
part of one").
Limits: nothing is validated; the service validates the result. */

const AMPLITUDES = { finger: "ridge_amplitude", texture: "amplitude" };

const isObject = (value) => typeof value === "object" && value !== null && !Array.isArray(value);

/** Returns a copy of a JSON value. (`structuredClone` is missing in browsers of before 2022.) */
export function copyOf(value) {
  if (Array.isArray(value)) return value.map(copyOf);
  if (!isObject(value)) return value;
  return Object.fromEntries(Object.entries(value).map(([name, inner]) => [name, copyOf(inner)]));
}

/** Returns whether two JSON values are equal, whatever the order of names. */
export function same(one, other) {
  if (!isObject(one) || !isObject(other)) return JSON.stringify(one) === JSON.stringify(other);
  const names = Object.keys(one);
  return (
    names.length === Object.keys(other).length && names.every((name) => name in other && same(one[name], other[name]))
  );
}

/**
 * Returns the names of the fields of `present`, a section of a scene, that setting `name` to `value` removes.
 * @returns {string[]}
 */
export function displaced(section, present, name, value) {
  const given = Object.keys(present).filter((key) => key !== name && present[key] !== null);
  const among = (...names) => given.filter((key) => names.includes(key));
  if (["finger", "texture"].includes(section) && name === "kind") return given;
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
 * Returns a new scene with the field at `path` (names and indices) set to `value`; undefined removes it. Fields that it
 * displaces and empty sections are removed. A kind that is removed displaces as one that is set: the default kind has
 * other fields.
 */
export function withField(scene, path, value) {
  const changed = copyOf(scene);
  const [section, name] = path;
  if (path.length > 1 && (value !== undefined || name === "kind")) {
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

/** Returns `scene` merged with the partial scene `part`, as the service does. */
function merged(scene, part) {
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
  if (["finger", "texture"].includes(section) && names.includes("kind")) return {};
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
 * Returns the fields of `complete`, the complete scene of `scene`, that `scene` leaves to their defaults.
 * @returns {object} nested objects; items of lists by index
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
 * Returns the partial scene that changes `before` into `after` at the service: the fields that differ, or a whole
 * section
 * if those fields would displace others.
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

/** Returns whether the scenes have the same texture, though its numbers may differ. */
export function sameTexture(one, other) {
  const named = ({ texture }) => {
    const { kind, surface, heights } = texture ?? {};
    return [kind ?? "sinusoid", surface ?? null, heights ?? null];
  };
  return same(named(one), named(other));
}

/** Returns whether `scene` states the full scale of each of its own channels. */
export function hasFullScale({ output }) {
  const { channels, full_scale: scale } = output ?? {};
  return Boolean(channels ? channels.every(({ full_scale: one }) => one) : scale);
}

/** Returns `scene` with the full scales of the channels of a stream, SI; without any for null. */
export function withFullScales(scene, scales) {
  const { channels } = scene.output ?? {};
  if (!channels) return withField(scene, ["output", "full_scale"], scales?.[0]);
  const scaled = channels.map(({ quantity }, index) =>
    scales ? { quantity, full_scale: scales[index] } : { quantity },
  );
  return withField(scene, ["output", "channels"], scaled);
}

/** Returns whether the scenes differ in what is fixed for a session: rate, channels, quantities, full scale. */
export function changesWhatIsFixed(before, after) {
  const kept = (scene) => {
    const effects = scene.effects ?? {};
    const { quantity, channels, sample_rate: rate, full_scale: scale } = scene.output ?? {};
    return [
      quantity ?? "acceleration",
      channels ?? null,
      rate ?? 48000,
      scale ?? null,
      isObject(effects.tangential),
      effects.tangential?.full_scale ?? null,
      isObject(effects.propagation),
      effects.propagation?.quantity ?? null,
      effects.propagation?.full_scale ?? null,
    ];
  };
  return !same(kept(before), kept(after));
}
