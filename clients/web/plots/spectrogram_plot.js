/* The spectrogram: the spectrum of short windows over the last seconds.

Model: the flat-top transform of the live spectrum, over WINDOW frames every HOP frames, so that a sinusoid of amplitude
A has the colour of A. Its time is the middle of the window; 0 is the newest sample. Colours are linear in dB, from the
ground to the colour of the signal over RANGE_DB below the largest amplitude.
Limits: KEPT s from the moment on at which the view is opened; HIGHEST Hz. */

import { inWords, quantityOf } from "../scene/quantities.js";
import { FourierTransform, LINE_WIDTH } from "../views/fourier_transform.js";
import { capital, nameOfColumn } from "./waveform_plot.js";

const WINDOW = 4096; // frames: lines of 12 Hz at 48 kHz, 5 bins wide to each side
const HOP = 1024; // frames
const KEPT = 5; // s
const HIGHEST = 1000; // Hz
const RANGE_DB = 60;

/** Keeps the newest samples, SI, of a stream. */
export class SampleKeeper {
  #rate = 0;
  #parts = [];
  #length = 0;

  /** Begins with `samples`, SI, at `rate` Hz. */
  constructor(samples, rate) {
    this.#rate = rate;
    this.push(samples);
  }

  /** Adds samples, SI. */
  push(samples) {
    this.#parts.push(samples);
    this.#length += samples.length;
    while (this.#length - this.#parts[0].length >= KEPT * this.#rate) this.#length -= this.#parts.shift().length;
  }

  /** The newest samples in order. */
  get samples() {
    const all = new Float64Array(this.#length);
    let place = 0;
    for (const part of this.#parts) {
      all.set(part, place);
      place += part.length;
    }
    return all;
  }
}

/** Returns the plot of `samples`, SI, the newest of which is that of `snapshot` (toolbar.js). ground and signal:
 *  colours [red, green, blue] of the least and the largest amplitude. */
export function spectrogramPlot(snapshot, samples, ground, signal) {
  const { rate, quantity } = snapshot;
  const { name, unit } = quantityOf(quantity);
  const transform = new FourierTransform(WINDOW);
  const bins = Math.floor((HIGHEST * WINDOW) / rate);
  const columns = [];
  for (let end = samples.length; end >= WINDOW; end -= HOP) {
    const amplitudes = transform.amplitudes(samples.subarray(end - WINDOW, end));
    columns.unshift({ time: (end - WINDOW / 2 - samples.length) / rate, amplitudes: amplitudes.slice(0, bins + 1) });
  }
  const largest = columns.reduce((most, { amplitudes }) => amplitudes.reduce((a, b) => Math.max(a, b), most), 0);
  const frequencies = Float64Array.from({ length: bins + 1 }, (_, bin) => (bin * rate) / WINDOW);
  const half = HOP / 2 / rate;
  const bin = rate / WINDOW;
  return {
    ...{ kind: "spectrogram", snapshot, transform: WINDOW, title: "Frequency", acrossTitle: "time" },
    across: { low: -KEPT, high: 0, unit: "s", log: false },
    up: { low: 0, high: HIGHEST, unit: "Hz", log: false },
    lines: [strongest(columns, frequencies)],
    image: columns.length && {
      ...{ picture: pictureOf(columns, largest, ground, signal), low: -bin / 2, high: (bins + 0.5) * bin },
      ...{ left: columns[0].time - half, right: columns.at(-1).time + half },
    },
    words: [`${capital(name)}: colours from ${inWords(largest, unit)} down by ${RANGE_DB} dB`],
    largest,
    told: `spectrogram of the ${name} over ${KEPT} s; the largest amplitude is ${inWords(largest, unit)}.`,
    describe: (time, frequency) => `${inWords(time, "s")}: strongest at ${inWords(frequency, "Hz")}`,
    columns: ["time_s", "frequency_Hz", nameOfColumn(quantity, unit)],
    rows: (low, high) =>
      columns
        .filter(({ time }) => time >= low && time <= high)
        .flatMap(({ time, amplitudes }) => Array.from(amplitudes, (value, index) => [time, frequencies[index], value])),
  };
}

/** Returns the line of the strongest frequency of each column, which the cursor follows. */
function strongest(columns, frequencies) {
  const loudest = ({ amplitudes }) => {
    const most = amplitudes.slice(LINE_WIDTH).reduce((a, b) => Math.max(a, b), 0); // below it is the mean
    return amplitudes.indexOf(most, LINE_WIDTH);
  };
  return {
    xs: columns.map(({ time }) => time),
    ys: columns.map((column) => frequencies[Math.max(0, loudest(column))]),
    hidden: true,
  };
}

/** Returns a canvas with a pixel for each column and bin, the lowest frequency at the bottom. */
function pictureOf(columns, largest, ground, signal) {
  const bins = columns[0].amplitudes.length;
  const picture = document.createElement("canvas");
  [picture.width, picture.height] = [columns.length, bins];
  const context = picture.getContext("2d");
  const pixels = context.createImageData(columns.length, bins);
  columns.forEach(({ amplitudes }, column) => {
    amplitudes.forEach((amplitude, bin) => {
      const level = amplitude > 0 ? 1 + (20 * Math.log10(amplitude / largest)) / RANGE_DB : 0;
      const part = Math.max(0, level);
      const colour = ground.map((from, index) => from + part * (signal[index] - from));
      pixels.data.set([...colour, 255], 4 * ((bins - 1 - bin) * columns.length + column));
    });
  });
  context.putImageData(pixels, 0, 0);
  return picture;
}
