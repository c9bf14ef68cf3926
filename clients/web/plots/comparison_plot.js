/* The plot of the spectra that were last felt with the slots A and B, with the difference of their levels over threshold in
words.

Model: the level of a spectrum is that of its line that is highest over the detection threshold, in dB. Where there is
no threshold the level is that of the largest line, and only the difference is told.
Limits: A and B must be of the same quantity. */

import { inWords, quantityOf } from "../scene/quantities.js";
import { levelAt } from "../views/spectrum.js";
import { decibels, overThreshold, spectrumOf, spectrumPlot, thresholdLine } from "./spectrum_plot.js";
import { nameOfColumn, rowsWithin } from "./waveform_plot.js";

const LOOKS = { A: { colour: "signal" }, B: { colour: "other", dash: [3, 2] } };

/** Returns the plot of `slots`, {A, B}: snapshots (toolbar.js), undefined where none is kept. */
export function comparisonPlot(slots) {
  const [first] = ["A", "B"].filter((slot) => slots[slot]);
  const base = spectrumPlot(slots[first]);
  const kept = Object.entries(LOOKS).filter(([slot]) => slots[slot]?.quantity === slots[first].quantity);
  const spectra = kept.map(([slot]) => [slot, spectrumOf(slots[slot])]);
  const { unit } = quantityOf(slots[first].quantity);
  const words = wordsOf(slots);
  const plots = kept.map(([slot]) => spectrumPlot(slots[slot]));
  const high = Math.max(...plots.map(({ up }) => up.high));
  const least = Math.min(...spectra.map(([, { amplitudes }]) => amplitudes.reduce((a, b) => Math.max(a, b), 0)));
  const shown = least > 0 ? 10 ** (Math.floor(Math.log10(least)) - 1) : high; // a decade of the weaker one, at least
  const { levels } = slots[first];
  const lines = spectra.map(([slot, { frequencies, amplitudes }], index) => ({
    ...{ xs: frequencies.slice(1), ys: amplitudes.slice(1), legend: slot, ...LOOKS[slot] },
    describe: plots[index].describe,
  }));
  const rows = (least, most) =>
    rowsWithin(lines[0].xs, least, most, (index) => {
      const frequency = lines[0].xs[index];
      const threshold = levelAt(levels, frequency);
      return [frequency, ...lines.map(({ xs, ys }) => valueAt(xs, ys, frequency)), threshold || ""];
    });
  return {
    ...{ ...base, kind: "comparison", snapshot: slots[first], snapshots: slots, marks: [], words },
    up: { ...base.up, high, low: Math.min(shown, ...plots.map(({ up }) => up.low)) },
    lines: [...lines, ...(levels.length ? [thresholdLine(levels)] : [])],
    told: words.join(" "),
    describe: (frequency) =>
      `${inWords(frequency, "Hz", 4)}: ` +
      lines.map(({ legend, xs, ys }) => `${legend} ${inWords(valueAt(xs, ys, frequency), unit)}`).join(", "),
    columns: [
      "frequency_Hz",
      ...lines.map(({ legend }) => nameOfColumn(legend, unit)),
      nameOfColumn("threshold", unit),
    ],
    rows,
  };
}

/** Returns {level (dB), frequency (Hz)} of the line that is highest over threshold; null for silence. */
export function highestOf(snapshot) {
  const { frequencies, amplitudes } = spectrumOf(snapshot);
  const { levels } = snapshot;
  const least = frequencies.findIndex((frequency) => frequency >= 10);
  let best = null;
  for (let bin = least; bin < amplitudes.length; bin++) {
    const threshold = levels.length ? levelAt(levels, frequencies[bin]) : 1;
    const level = threshold ? decibels(amplitudes[bin] / threshold) : null;
    if (level !== null && level > (best?.level ?? -Infinity)) best = { level, frequency: frequencies[bin] };
  }
  return best;
}

function wordsOf(slots) {
  const missing = ["A", "B"].find((slot) => !slots[slot]);
  if (missing) return [`Nothing was felt with ${missing} pressed yet.`];
  if (slots.A.quantity !== slots.B.quantity)
    return [`A is ${quantityOf(slots.A.quantity).name} and B ${quantityOf(slots.B.quantity).name}: stroke one again.`];
  const [a, b] = [highestOf(slots.A), highestOf(slots.B)];
  if (!a || !b) return [`${a ? "B" : "A"} is silent.`];
  const known = slots.A.levels.length > 0;
  const told = (slot, { level, frequency }) =>
    `${slot}: ${known ? `${overThreshold(level)} ` : ""}at ${inWords(frequency, "Hz")}.`;
  const apart = b.level - a.level;
  const side = apart < 0 ? "lower" : "higher";
  const over = known ? " over threshold" : "";
  return [`${told("A", a)} ${told("B", b)}`, `B is ${Math.abs(apart).toFixed(1)} dB ${side}${over} than A.`];
}

/** Returns the value of a line at `x`: that of its nearest point. */
function valueAt(xs, ys, x) {
  return ys[Math.min(ys.length - 1, Math.max(0, Math.round((x - xs[0]) / (xs[1] - xs[0]))))];
}
