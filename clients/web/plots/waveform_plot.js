/* The plot of a frozen waveform: all samples of the last second, of which the live span is shown first. */

import { inWords, quantityOf } from "../scene/quantities.js";

const ROOM = 1.12; // range of the axis over the largest value

/** Returns the plot of a snapshot (toolbar.js). Time is 0 at the frame where the live trace began. */
export function waveformPlot(snapshot) {
  const { samples, rate, quantity, fullScale, begin, span, known, firstFrame } = snapshot;
  const { name, unit } = quantityOf(quantity);
  const xs = Float64Array.from(samples, (_, index) => (index - begin) / rate);
  const largest = samples.reduce((most, value) => Math.max(most, Math.abs(value)), 0);
  const range = ROOM * (largest || fullScale);
  return {
    ...{ kind: "waveform", snapshot, title: capital(name), acrossTitle: "time", begin: [0, span] },
    across: { low: Math.min(0, xs[0]), high: Math.max(span, xs.at(-1)), unit: "s", log: false },
    up: { low: -range, high: range, unit, log: false },
    lines: [{ xs, ys: samples, colour: "signal", legend: "felt" }],
    bounds: range > fullScale ? [fullScale, -fullScale] : [],
    told: `waveform of the ${name}, ${inWords(samples.length / rate, "s")}; the largest value is ${inWords(largest, unit)}.`,
    describe: (time, value) => `${inWords(time, "s", 4)}: ${inWords(value, unit, 4)}`,
    columns: ["frame", "time_s", nameOfColumn(quantity, unit)],
    rows: (low, high) =>
      rowsWithin(xs, low, high, (index) => [
        index < known ? "" : firstFrame + index - known,
        Number(xs[index].toPrecision(12)),
        samples[index],
      ]),
  };
}

/** Returns `name` with its first letter in capitals. */
export function capital(name) {
  return name[0].toUpperCase() + name.slice(1);
}

/** Returns the name of a column with its unit: "acceleration_m/s2". */
export function nameOfColumn(quantity, unit) {
  return unit ? `${quantity}_${unit.replace("²", "2")}` : quantity;
}

/** Returns rows(index) of the rising `xs` from `low` to `high`. */
export function rowsWithin(xs, low, high, row) {
  const rows = [];
  for (const [index, x] of xs.entries()) if (x >= low && x <= high) rows.push(row(index));
  return rows;
}
