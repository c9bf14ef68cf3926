/* The spectrum in physical units, with the detection threshold and the harmonics of the texture.

Model: a flat-top transform (fourier_transform.js) of the newest samples, so that a sinusoid of amplitude A has the
height A. The detection threshold is a displacement; that of velocity is 2 pi f times larger, that of acceleration (2 pi
f)^2 times. Both axes are logarithmic. The upper one reaches the full scale, or the largest line where that is beyond. Each
device pixel shows its largest bin. A band about the threshold shows where people differ (THRESHOLD_SPREAD).
Limits: one channel; a change of the motion is resolved after WINDOW s. A line is 5 bins wide to each side, and the side
lobes of the window are 90 dB below the largest line. */

import { inWords, quantityOf } from "../scene/quantities.js";
import { drawAxes, drawLegend, logAxis } from "./axes.js";
import { Panel } from "./panel.js";
import { largestLine, FourierTransform } from "./fourier_transform.js";

/** The factor, up and down, within which the thresholds of most people are: 5 dB, an unverified default. */
export const THRESHOLD_SPREAD = 10 ** (5 / 20);

const WINDOW = 0.3; // s of sound, at least
const EVERY = 40; // ms between drawings
const SHRINK_AFTER = 1000; // ms with too large a range
const LOWEST = 10; // Hz
const HIGHEST = 5000; // Hz
const DECADES = 5; // of amplitude
const MARK_ROOM = 8; // CSS px between labels of harmonics
const FIRST_LEFT = 8; // CSS px by which the label of the fundamental, which is long, begins to the left of its line
const LINE_ROOM = 8; // CSS px between marks of harmonics
const NARROW = 340; // CSS px: a narrower picture has no room for "amplitude" beside the legend

export class Spectrum {
  #kept = new Float32Array(0);
  #written = 0;
  #transform = null;
  #threshold = null;
  #harmonics = [];
  #top = { high: 0, since: 0 };

  constructor(canvas) {
    this.panel = new Panel(canvas, "Spectrum: no vibration yet.", () => this.#draw(), EVERY).moving();
    /** The last drawing: {frequencies (Hz), amplitudes (SI), threshold: [[Hz, SI]], marks: [{frequency, x, label}],
     * largest: {frequency, amplitude}}. */
    this.drawn = null;
    /** The axes of the last drawing: {box, across, up}; null before it. */
    this.axes = null;
  }

  /** Frames of a transform; 0 before any samples. */
  get size() {
    return this.#transform?.size ?? 0;
  }

  /** Adds samples of one channel, 1.0 = full scale. fullScale: SI value of 1.0. rate: Hz. */
  push(samples, fullScale, quantity, rate) {
    if (rate !== this.rate || quantity !== this.quantity || fullScale !== this.fullScale) {
      if (rate !== this.rate) this.#transform = new FourierTransform(2 ** Math.ceil(Math.log2(WINDOW * rate)));
      Object.assign(this, { rate, quantity, fullScale });
      this.#kept = new Float32Array(this.#transform.size);
      this.#written = 0;
      this.#top.high = 0;
    }
    for (const sample of samples) this.#kept[this.#written++ & (this.#kept.length - 1)] = sample;
    this.panel.request();
  }

  /** Shows silence: the sound has ended. */
  rest() {
    this.#kept.fill(0);
    this.#top.high = 0;
    this.panel.request();
  }

  /** Marks harmonics: frequencies (Hz), the fundamental first; an empty list marks none. */
  mark(harmonics) {
    this.#harmonics = harmonics.filter((frequency) => frequency > 0);
    this.panel.request();
  }

  /** Shows the detection threshold, answer of `GET /v1/threshold`; null hides it. */
  threshold(curve) {
    this.#threshold = curve;
    this.panel.request();
  }

  /** The detection threshold as [[Hz, SI value of the quantity]]; empty if there is none. */
  get levels() {
    const { order } = quantityOf(this.quantity);
    if (!this.#threshold || order === null) return [];
    const { frequencies, displacement } = this.#threshold;
    return frequencies.map((frequency, index) => [frequency, displacement[index] * (2 * Math.PI * frequency) ** order]);
  }

  #draw() {
    if (!this.#transform) return;
    const { panel } = this;
    const size = this.#transform.size;
    const newest = Float64Array.from({ length: size }, (_, index) => this.#kept[(this.#written + index) & (size - 1)]);
    const amplitudes = this.#transform.amplitudes(newest).map((amplitude) => amplitude * this.fullScale);
    const box = { left: 72, top: 40, right: panel.width - 12, bottom: panel.height - 34 };
    const across = logAxis(LOWEST, Math.min(HIGHEST, this.rate / 2), box.left, box.right, "Hz", 48);
    const largest = largestLine(amplitudes, this.rate, LOWEST);
    const { low, high } = this.#range(across, largest.amplitude);
    const up = logAxis(low, high, box.bottom, box.top, quantityOf(this.quantity).unit, 20);
    const marks = this.#marks(across);
    this.axes = { box, across, up };
    const key = [low, high, this.quantity, this.#threshold?.name, marks.map((mark) => mark.x.toFixed(1))].join();
    panel.layer(key, () => this.#drawFrame(box, across, up, marks));
    const trace = this.#trace(amplitudes, across, up, box);
    this.drawn = {
      ...trace,
      threshold: this.levels,
      marks,
      largest,
      low,
      high,
    };
    this.#tell();
  }

  #range(across, largest) {
    const seen = this.levels
      .filter(([frequency]) => frequency >= 40 && frequency <= across.high)
      .map(([, level]) => level);
    const felt = 2 * Math.min(...seen.filter((level) => level > 0), Infinity);
    const top = Math.max(this.fullScale, largest, Number.isFinite(felt) ? felt : 0);
    const wanted = 10 ** Math.ceil(Math.log10(top));
    const now = performance.now();
    if (wanted >= this.#top.high || now - this.#top.since > SHRINK_AFTER) this.#top = { high: wanted, since: now };
    const { high } = this.#top;
    return { high, low: high / 10 ** DECADES };
  }

  #marks(across) {
    const { context } = this.panel;
    const marks = [];
    let free = -Infinity;
    context.font = this.panel.font(11);
    this.#harmonics.forEach((frequency, index) => {
      if (frequency < across.low || frequency > across.high) return;
      const x = across.place(frequency);
      const label = index === 0 ? `u/λ ${inWords(frequency, "Hz")}` : String(index + 1);
      const wide = context.measureText(label).width;
      const left = index === 0 ? x - FIRST_LEFT : x - wide / 2;
      const told = left >= free;
      if (told) free = left + wide + MARK_ROOM;
      if (told || x - (marks.at(-1)?.x ?? -Infinity) >= LINE_ROOM)
        marks.push({ frequency, x, label: told ? label : "" });
    });
    return marks;
  }

  #trace(amplitudes, across, up, box) {
    const { context, ratio } = this.panel;
    const frequencies = [];
    const shown = [];
    const bin = this.rate / this.#transform.size;
    const columns = Math.round((box.right - box.left) * ratio);
    const factor = (across.high / across.low) ** (1 / columns);
    for (let column = 0, frequency = across.low; column < columns; column++, frequency *= factor) {
      const [from, to] = [frequency / bin, (frequency * factor) / bin];
      const first = Math.ceil(from);
      let amplitude = 0;
      for (let k = first; k < to && k < amplitudes.length; k++) amplitude = Math.max(amplitude, amplitudes[k]);
      if (first >= to) amplitude = between(amplitudes, from);
      frequencies.push(first >= to ? frequency : first * bin);
      shown.push(amplitude);
    }
    context.save();
    context.beginPath();
    context.rect(box.left, box.top, box.right - box.left, box.bottom - box.top);
    context.clip();
    context.beginPath();
    frequencies.forEach((frequency, index) => {
      context.lineTo(across.place(frequency), Math.min(box.bottom + 4, up.place(Math.max(shown[index], up.low / 10))));
    });
    context.strokeStyle = this.panel.colour("signal");
    context.lineWidth = 1.4;
    context.lineJoin = "round";
    context.stroke();
    context.lineTo(box.right, box.bottom + 4);
    context.lineTo(box.left, box.bottom + 4);
    context.fillStyle = this.panel.colour("signal-soft");
    context.fill();
    context.restore();
    return { frequencies, amplitudes: shown };
  }

  #drawFrame(box, across, up, marks) {
    const { panel } = this;
    const { context } = panel;
    const quantity = quantityOf(this.quantity);
    const name = quantity.name[0].toUpperCase() + quantity.name.slice(1);
    const upTitle = panel.width < NARROW ? name : `${name} amplitude`;
    const free = drawAxes(panel, box, across, up, { acrossTitle: "frequency", upTitle });
    this.#drawMarks(box, marks);
    context.save();
    context.beginPath();
    context.rect(box.left, box.top, box.right - box.left, box.bottom - box.top);
    context.clip();
    const raised = (factor) => this.levels.map(([frequency, level]) => [frequency, level * factor]);
    context.fillStyle = panel.colour("threshold-soft");
    context.beginPath();
    for (const [frequency, level] of [...raised(THRESHOLD_SPREAD), ...raised(1 / THRESHOLD_SPREAD).reverse()])
      context.lineTo(across.place(frequency), up.place(level));
    context.fill();
    context.strokeStyle = panel.colour("threshold");
    context.lineWidth = 1.6;
    context.setLineDash([6, 4]);
    context.beginPath();
    for (const [frequency, level] of this.levels) context.lineTo(across.place(frequency), up.place(level));
    context.stroke();
    context.restore();
    this.#drawLegend(box, free);
  }

  #drawMarks(box, marks) {
    const { context } = this.panel;
    context.strokeStyle = this.panel.colour("mark");
    context.fillStyle = this.panel.colour("mark");
    context.lineWidth = 1;
    context.font = this.panel.font(11);
    context.textBaseline = "alphabetic";
    context.setLineDash([1, 3]);
    context.beginPath();
    for (const { x, label } of marks) {
      context.moveTo(x, label ? box.top - 4 : box.top + 6);
      context.lineTo(x, box.bottom);
      const first = label.startsWith("u");
      context.textAlign = first ? "left" : "center";
      context.fillText(label, first ? x - FIRST_LEFT : x, box.top - 8);
    }
    context.stroke();
    context.setLineDash([]);
  }

  /** Draws the legend between the title of the axis, which ends before `free`, and the right edge of `box`. */
  #drawLegend(box, free) {
    const { context } = this.panel;
    const entries = [["signal", [], "now"]];
    context.font = this.panel.font(11);
    const room = box.right - free - context.measureText("nowdetection threshold").width - 2 * (6 + 18) - 12;
    if (this.levels.length) entries.push(["threshold", [6, 4], room < 0 ? "threshold" : "detection threshold"]);
    context.textAlign = "right";
    context.textBaseline = "middle";
    let right = box.right;
    for (const [colour, dash, words] of entries)
      right = drawLegend(context, this.panel, { right, at: 9, words, colour, dash });
  }

  #tell() {
    const { largest } = this.drawn;
    const { unit, name } = quantityOf(this.quantity);
    const threshold = levelAt(this.levels, largest.frequency);
    const level = 20 * Math.log10(largest.amplitude / threshold);
    const beside = threshold
      ? `, ${Math.abs(level).toFixed(0)} dB ${level < 0 ? "below" : "above"} the detection threshold`
      : "";
    this.panel.say(
      largest.amplitude < this.fullScale * 1e-6
        ? `Spectrum of the ${name}: silence.`
        : `Spectrum of the ${name}: the strongest sinusoid is ${inWords(largest.amplitude, unit)} at ` +
            `${inWords(largest.frequency, "Hz")}${beside}.`,
    );
  }
}

/** Returns the level at a frequency (Hz) of a curve [[Hz, level]], interpolated logarithmically; 0 outside. */
export function levelAt(levels, frequency) {
  const frequencies = levels.map(([one]) => one);
  return between(
    levels.map(([, level]) => level),
    placeIn(frequencies, frequency),
  );
}

/** Returns the value at an index with a fraction, interpolated logarithmically; 0 outside. */
function between(values, place) {
  const index = Math.floor(place);
  if (!(index >= 0) || index >= values.length) return 0;
  const [first, next] = [values[index], values[Math.min(index + 1, values.length - 1)]];
  return first > 0 && next > 0 ? first * (next / first) ** (place - index) : first;
}

/** Returns the index with a fraction of `value` in increasing `values`; NaN outside. */
function placeIn(values, value) {
  const next = values.findIndex((one) => one >= value);
  if (next < 1) return NaN;
  return next - 1 + Math.log(value / values[next - 1]) / Math.log(values[next] / values[next - 1]);
}
