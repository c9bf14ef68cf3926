/* Values with units: "0.8 mm" <-> 0.0008.

Model: a number and a unit of the field's dimension, from the table of docs/scene.md, "How values are written". A scene
stores the text as it was entered, not the converted number. */

/** By SI unit: the number of units in which values are shown (largest first), then [unit, factor to SI]. */
const TABLE = {
  m: [4, ["m", 1], ["mm", 1e-3], ["um", 1e-6], ["nm", 1e-9], ["cm", 1e-2]],
  "m/s": [3, ["m/s", 1], ["mm/s", 1e-3], ["um/s", 1e-6], ["cm/s", 1e-2]],
  "m/s^2": [1, ["m/s^2", 1], ["mm/s^2", 1e-3], ["g", 9.80665], ["m/s2", 1], ["mm/s2", 1e-3]],
  N: [3, ["N", 1], ["mN", 1e-3], ["uN", 1e-6]],
  Pa: [4, ["GPa", 1e9], ["MPa", 1e6], ["kPa", 1e3], ["Pa", 1]],
  Hz: [2, ["kHz", 1e3], ["Hz", 1]],
  s: [3, ["s", 1], ["ms", 1e-3], ["us", 1e-6], ["min", 60], ["h", 3600]],
  kg: [3, ["kg", 1], ["g", 1e-3], ["mg", 1e-6]],
  "N s/m": [2, ["N s/m", 1], ["mN s/m", 1e-3]],
  "N/m": [1, ["N/m", 1], ["N/mm", 1e3], ["kN/m", 1e3]],
  rad: [1, ["rad", 1], ["deg", Math.PI / 180]],
};
const [UNITS, SHOWN] = [{}, {}];
for (const [si, [shown, ...units]] of Object.entries(TABLE)) {
  UNITS[si] = units;
  SHOWN[si] = units.slice(0, shown);
}

const NUMBER = /^\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d{1,4})?)\s*(.*?)\s*$/i;

/** Returns the units for the SI unit `si`, those in which values are shown first. */
export const unitsOf = (si) => (UNITS[si] ?? []).map(([unit]) => unit);

/** Returns `text` with one spelling of each sign: u for micro, - for minus, ^2 for a square. */
const plain = (text) =>
  text
    .replace(/[\u00b5\u03bc]/g, "u")
    .replace(/\u2212/g, "-")
    .replace(/\u00b2/g, "^2");

/**
 * Reads `text` in the SI unit `si` ("" for a number without a unit). A number without a unit is in `unit`.
 * @returns {{text: string, value: number} | null} text for the scene and SI value; null if `text` is invalid
 */
export function readQuantity(text, si, unit = si) {
  const [, digits, written] = NUMBER.exec(plain(text)) ?? [];
  if (digits === undefined) return null;
  if (!si) return written ? null : { text: digits, value: Number(digits) };
  const name = written || unit;
  const factor = UNITS[si].find(([known]) => known === name)?.[1];
  if (factor === undefined) return null;
  return { text: `${digits} ${name}`, value: Number(digits) * factor };
}

const digitsOf = (value, digits) => String(Number(value.toPrecision(digits)));

/** Returns the SI value of a field: of a number, or of text with a unit; else NaN. */
export function siValue(held, si) {
  if (typeof held === "number") return held;
  return typeof held === "string" ? (readQuantity(held, si)?.value ?? NaN) : NaN;
}

/**
 * Returns an SI value as text in a suitable unit: 0.0008, "m" -> "800 um"; 0.08, "m/s" -> "80 mm/s".
 * @param {number} digits largest number of significant digits
 */
export function showQuantity(value, si, digits = 12) {
  const units = SHOWN[si];
  if (!units) return digitsOf(value, digits) + (si && ` ${si}`);
  const size = Math.abs(value);
  const fitting = units.find(([, factor]) => size >= factor * 0.9999999) ?? units.at(-1);
  const [unit, factor] = size ? fitting : units.find(([, one]) => one === 1);
  return `${digitsOf(value / factor, digits)} ${unit}`;
}

/** Returns the unit of `text`, or `fallback`. */
export const unitIn = (text, fallback) => NUMBER.exec(plain(text))?.[2] || fallback;
