/* The quantities of a sample, and numbers as text with SI prefixes ("20.3 µm"). */

const PREFIXES = [
  [1e9, "G"],
  [1e6, "M"],
  [1e3, "k"],
  [1, ""],
  [1e-3, "m"],
  [1e-6, "µ"],
  [1e-9, "n"],
  [1e-12, "p"],
];

/** Quantities with name, SI unit and order of the time derivative of displacement; null: not the finger's own motion.
 *  Channels that effects add have `added`. */
const QUANTITIES = {
  approach: { name: "approach", unit: "m", order: 0 },
  displacement: { name: "displacement", unit: "m", order: 0 },
  velocity: { name: "velocity", unit: "m/s", order: 1 },
  acceleration: { name: "acceleration", unit: "m/s²", order: 2 },
  tangential_force: { name: "tangential force", unit: "N", order: null, added: true },
  friction_force: { name: "friction force", unit: "N", order: null, added: true },
  friction_force_y: { name: "friction force along y", unit: "N", order: null, added: true },
  propagated_displacement: { name: "propagated displacement", unit: "m", order: null, added: true },
  propagated_velocity: { name: "propagated velocity", unit: "m/s", order: null, added: true },
  propagated_acceleration: { name: "propagated acceleration", unit: "m/s²", order: null, added: true },
};

/** Returns {name, unit, order, added} of a quantity. An effect may add one that this page does not know: its unit is "". */
export function quantityOf(quantity) {
  return QUANTITIES[quantity] ?? { name: quantity.replaceAll("_", " "), unit: "", order: null, added: true };
}

/** Returns {factor, prefix} of the SI prefix for numbers of magnitude `size`: 2e-5 -> 1e-6, "µ". */
export function prefixOf(size) {
  const large = Math.abs(size) * 1.0005;
  const [factor, prefix] = PREFIXES.find(([least]) => large >= least) ?? (size ? PREFIXES.at(-1) : [1, ""]);
  return { factor, prefix };
}

/** Returns a value as text: 0.0000203, "m" -> "20.3 µm". */
export function inWords(value, unit, digits = 3) {
  const { factor, prefix } = prefixOf(value);
  return `${Number((value / factor).toPrecision(digits))} ${prefix}${unit}`.trim().replace("-", "−");
}
