/* The plot of a frozen spectrum: that of the newest samples of a snapshot, with the detection threshold.

Model: the same transform as that of the live view (fourier_transform.js), at all its bins. The threshold is
interpolated logarithmically between its frequencies. */

import { inWords, quantityOf } from "../scene/quantities.js";
import { FourierTransform, largestLine } from "../views/fourier_transform.js";
import { levelAt, THRESHOLD_SPREAD } from "../views/spectrum.js";
import { capital, nameOfColumn, rowsWithin } from "./waveform_plot.js";

export const LOWEST = 10; // Hz, as in the live view
const HIGHEST = 5000; // Hz
const DECADES = 5; // of amplitude

/** Returns the plot of a snapshot (toolbar.js). */
export function spectrumPlot(snapshot) {
  const { quantity, rate, levels, marks, fullScale } = snapshot;
  const { name, unit } = quantityOf(quantity);
  const { frequencies, amplitudes } = spectrumOf(snapshot);
  const largest = largestLine(amplitudes, rate, LOWEST);
  const high = 10 ** Math.ceil(Math.log10(Math.max(fullScale, largest.amplitude)));
  const { xs, ys } = { xs: frequencies.slice(1), ys: amplitudes.slice(1) };
  return {
    ...{
      kind: "spectrum",
      snapshot,
      transform: snapshot.size,
      title: `${capital(name)} amplitude`,
      acrossTitle: "frequency",
    },
    across: { low: LOWEST, high: Math.min(HIGHEST, rate / 2), unit: "Hz", log: true },
    up: { low: high / 10 ** DECADES, high, unit, log: true },
    lines: [
      { xs, ys, colour: "signal", fill: "signal-soft", legend: "felt" },
      ...(levels.length ? [thresholdLine(levels)] : []),
    ],
    marks: marks.map((x, index) => ({ x, label: index ? String(index + 1) : "u/λ" })),
    told: `spectrum of the ${name}; the strongest sinusoid is ${lineInWords(largest.frequency, largest.amplitude, unit, levels)}.`,
    describe: (frequency, amplitude) => lineInWords(frequency, amplitude, unit, levels),
    columns: ["frequency_Hz", nameOfColumn(quantity, unit), nameOfColumn("threshold", unit), "over_threshold_dB"],
    rows: (least, most) =>
      rowsWithin(xs, least, most, (index) => {
        const threshold = levelAt(levels, xs[index]);
        return [xs[index], ys[index], threshold || "", threshold ? decibels(ys[index] / threshold) : ""];
      }),
  };
}

/** Returns the newest spectrum of a snapshot: {frequencies (Hz), amplitudes (SI)} at all bins. */
export function spectrumOf({ samples, size, rate }) {
  const newest = new Float64Array(size);
  newest.set(samples.slice(-size), Math.max(0, size - samples.length));
  const amplitudes = new FourierTransform(size).amplitudes(newest);
  return { frequencies: amplitudes.map((_, bin) => (bin * rate) / size), amplitudes };
}

/** Returns the line of a detection threshold, [[Hz, SI]]. */
export function thresholdLine(levels) {
  const [xs, ys] = [0, 1].map((column) => levels.map((pair) => pair[column]));
  return { xs, ys, colour: "threshold", dash: [6, 4], legend: "threshold", band: THRESHOLD_SPREAD };
}

/** Returns a ratio of amplitudes in dB; null for silence. */
export function decibels(ratio) {
  return ratio > 0 ? 20 * Math.log10(ratio) : null;
}

/** Returns a line of a spectrum as text: its frequency, its amplitude and its level over the threshold. */
export function lineInWords(frequency, amplitude, unit, levels) {
  const threshold = levelAt(levels, frequency);
  const level = threshold ? decibels(amplitude / threshold) : null;
  const over = level === null ? "" : `, ${overThreshold(level)}`;
  return `${inWords(frequency, "Hz", 4)}: ${inWords(amplitude, unit)}${over}`;
}

/** Returns a level over threshold, dB, as text. */
export function overThreshold(level) {
  return `${Math.abs(level).toFixed(0)} dB ${level < 0 ? "below" : "over"} threshold`;
}
