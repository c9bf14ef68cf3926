/* The waveform in physical units, standing still at constant speed.

Model: as in an oscilloscope, the trace begins at a rising crossing of a trigger level. The level is zero at first, and
moves to the mean if that is far from it. Of all recent crossings, the one whose trace is most similar to the previous
trace is chosen. Crossings are interpolated between samples. The scale is the full scale divided by 1, 2, 5, 10 and so
on, or multiplied where the vibration exceeds it; the full scale is marked if it is visible. A vibration below FLOOR
is not magnified, and one below NONE is none.
Limits: one channel; the last second. Samples are joined by lines, or by their range in each pixel. */

import { inWords, quantityOf } from "../scene/quantities.js";
import { drawAxes, linearAxis, roundAbove } from "./axes.js";
import { Panel } from "./panel.js";

const KEPT = 1; // s
const PERIODS = 4; // shown at least, after a new choice of the span
const FEW = 2.5; // periods: with fewer, or more than MANY, the span is chosen again
const MANY = 12;
const POINTS = 128; // of a trace, compared with the previous one
const MOST_CROSSINGS = 160; // compared per drawing
const QUIET = 1e-4; // of full scale; smaller vibrations do not trigger
const FLOOR = 1e-3; // of full scale; smaller vibrations, magnified, look like those that are heard
const NONE = 1e-5; // of full scale: at rest only rounding is left
const OFF = 0.1; // of peak-to-peak: distance of the mean from the trigger level at which the level moves to it
const ROOM = 1.12; // scale relative to the largest value
const SHRINK_AFTER = 1000; // ms with too large a scale

export class Waveform {
  #kept = new Float32Array(0);
  #written = 0;
  #before = null;
  #level = 0;
  #magnified = { by: 1, since: 0 };

  constructor(canvas) {
    this.span = 0.05; // s shown
    this.panel = new Panel(canvas, "Waveform: no vibration yet.", () => this.#draw()).moving();
    /** The last drawing: `times` (s) and `values` (SI) of the trace, `peak` and `range` (SI), `begin` (frame), `span`
     *  (s). */
    this.drawn = null;
    /** The axes of the last drawing: {box, across, up}; null before it. */
    this.axes = null;
  }

  /** The newest samples, SI, with their rate, Hz; the frame among them at which the trace begins, and the span, s. */
  get kept() {
    const { rate, quantity, fullScale, span } = this;
    const length = Math.min(this.#written, this.#kept.length);
    const first = this.#written - length;
    const samples = Float64Array.from(
      { length },
      (_, index) => this.#kept[(first + index) % this.#kept.length] * fullScale,
    );
    const begin = Math.max(0, (this.drawn?.begin ?? first) - first);
    return { samples, rate, quantity, fullScale, begin, span };
  }

  /** Adds samples of one channel, 1.0 = full scale. fullScale: SI value of 1.0. rate: Hz. */
  push(samples, fullScale, quantity, rate) {
    if (rate !== this.rate || quantity !== this.quantity || fullScale !== this.fullScale) {
      Object.assign(this, { rate, quantity, fullScale });
      this.#kept = new Float32Array(Math.ceil(KEPT * rate));
      this.#written = 0;
      this.#before = null;
      this.#level = 0;
    }
    for (const sample of samples) this.#kept[this.#written++ % this.#kept.length] = sample;
    this.panel.request();
  }

  /** Shows silence: the sound has ended. */
  rest() {
    this.#kept.fill(0);
    this.#before = null;
    this.#level = 0;
    this.#magnified = { by: 1, since: performance.now() };
    this.panel.request();
  }

  /** Chooses a span for a vibration of `frequency` Hz. The present span stays if it shows FEW to MANY periods. */
  expect(frequency) {
    const shown = this.span * Math.abs(frequency);
    if (shown >= FEW && shown <= MANY) return;
    const span = Math.min(KEPT / 4, Math.max(0.005, roundAbove(PERIODS / Math.abs(frequency))));
    if (!Number.isFinite(span) || span === this.span) return;
    this.span = span;
    this.#before = null;
    this.panel.request();
  }

  #at(frame) {
    const length = this.#kept.length;
    const whole = Math.floor(frame);
    const first = this.#kept[whole % length];
    return first + (frame - whole) * (this.#kept[(whole + 1) % length] - first);
  }

  #begin() {
    const frames = this.span * this.rate;
    const newest = this.#written - 2 - frames;
    const oldest = Math.max(this.#written - this.#kept.length + 1, 0, newest - Math.max(frames, 0.1 * this.rate));
    let [mean, high, low] = [0, -Infinity, Infinity];
    for (let frame = Math.ceil(oldest); frame < this.#written; frame++) {
      const value = this.#kept[frame % this.#kept.length];
      mean += value / (this.#written - Math.ceil(oldest));
      high = Math.max(high, value);
      low = Math.min(low, value);
    }
    if (newest < 0) return { begin: 0, high, low };
    if (Math.abs(mean - this.#level) > OFF * (high - low)) this.#level = mean;
    const level = this.#level;
    let [best, least] = [newest, Infinity];
    if (high - low > QUIET) {
      const armed = level - 0.02 * (high - low);
      let crossing = 0;
      let count = 0;
      for (let frame = Math.floor(newest); frame > oldest && count < MOST_CROSSINGS; frame--) {
        const value = this.#kept[frame % this.#kept.length];
        const next = this.#kept[(frame + 1) % this.#kept.length];
        if (value < level && next >= level) crossing = frame + (level - value) / (next - value);
        if (!crossing || value > armed) continue;
        if (crossing <= newest) {
          count++;
          const miss = this.#unlike(crossing, frames);
          if (miss < least) [best, least] = [crossing, miss];
        }
        crossing = 0;
      }
    }
    this.#before = Float32Array.from({ length: POINTS }, (_, index) => this.#at(best + (index * frames) / POINTS));
    return { begin: best, high, low };
  }

  #unlike(begin, frames) {
    if (!this.#before) return -this.#at(begin + 0.02 * frames); // the steepest rise
    let sum = 0;
    for (let index = 0; index < POINTS; index++) {
      sum += (this.#at(begin + (index * frames) / POINTS) - this.#before[index]) ** 2;
    }
    return sum;
  }

  #scaleBy(peak) {
    const now = performance.now();
    let by = peak > 1 ? 1 / roundAbove(peak) : 1;
    while (peak >= FLOOR && peak * ROOM * nextStep(by) <= 1) by = nextStep(by);
    if (by <= this.#magnified.by) this.#magnified.since = now;
    if (by < this.#magnified.by || now - this.#magnified.since > SHRINK_AFTER) this.#magnified = { by, since: now };
    return this.#magnified.by;
  }

  #draw() {
    if (!this.#written) return;
    const { panel } = this;
    const { begin, high, low } = this.#begin();
    const quantity = quantityOf(this.quantity);
    const peak = Math.max(Math.abs(high), Math.abs(low));
    const by = this.#scaleBy(peak);
    const range = (this.fullScale / by) * ROOM;
    const box = { left: 46, top: 24, right: panel.width - 12, bottom: panel.height - 34 };
    const across = linearAxis(0, this.span, box.left, box.right, "s", Math.max(2, panel.width / 110));
    const up = linearAxis(-range, range, box.bottom, box.top, quantity.unit, Math.max(3, panel.height / 45));
    const note = noteOf(peak, by);
    this.axes = { box, across, up };
    panel.layer(`${range} ${this.span} ${this.quantity} ${note}`, () => this.#drawFrame(box, across, up, by, note));
    const count = Math.min(Math.floor(this.span * this.rate), this.#written - 1);
    this.#trace(begin, count, across, up, box);
    this.drawn.peak = peak * this.fullScale;
    this.drawn.range = range;
    const full = inWords(this.fullScale, quantity.unit);
    panel.say(
      peak < NONE
        ? `Waveform of the ${quantity.name}: no vibration. The full scale is ${full}.`
        : `Waveform of the ${quantity.name}: the largest value is ${inWords(peak * this.fullScale, quantity.unit)}, ` +
            `${Number((100 * peak).toPrecision(2))} % of the full scale, ${full}` +
            `${peak > 1 ? ", to which the sound is limited" : ""}.`,
    );
  }

  #trace(begin, count, across, up, box) {
    const { context, ratio } = this.panel;
    const step = Math.max(1, count / ((box.right - box.left) * ratio)); // frames per device pixel
    const times = [];
    const values = [];
    const scale = this.fullScale;
    if (step > 2) {
      for (let place = 0; place < count; place += step) {
        let [least, most] = [Infinity, -Infinity];
        for (let frame = Math.floor(begin + place); frame <= begin + place + step; frame++) {
          const value = this.#kept[frame % this.#kept.length];
          least = Math.min(least, value);
          most = Math.max(most, value);
        }
        const middle = (place + step / 2) / this.rate;
        times.push(middle, middle);
        values.push(least * scale, most * scale);
      }
    } else {
      for (let place = Math.ceil(begin) - begin; place <= count; place++) {
        times.push(place / this.rate);
        values.push(this.#at(begin + place) * scale);
      }
    }
    context.strokeStyle = this.panel.colour("signal");
    context.lineWidth = 1.6;
    context.lineJoin = "round";
    context.beginPath();
    for (const [index, time] of times.entries()) context.lineTo(across.place(time), up.place(values[index]));
    context.stroke();
    this.drawn = { times, values, begin, span: this.span };
  }

  #drawFrame(box, across, up, by, note) {
    const { panel } = this;
    const { context } = panel;
    const quantity = quantityOf(this.quantity);
    const name = quantity.name[0].toUpperCase() + quantity.name.slice(1);
    const titles = { acrossTitle: `time (${across.unit})`, upTitle: `${name} (${up.unit})` };
    const free = drawAxes(panel, box, across, up, titles);
    const full = inWords(this.fullScale, quantity.unit);
    context.font = panel.font(11);
    context.textAlign = "right";
    context.textBaseline = "alphabetic";
    context.fillStyle = panel.colour("threshold");
    const scale = `${note}full scale ±${full}`;
    context.fillText(scale, box.right, 13, box.right - free);
    if (by > 1) return;
    context.strokeStyle = panel.colour("threshold");
    context.setLineDash([5, 4]);
    context.beginPath();
    for (const level of [this.fullScale, -this.fullScale]) {
      const y = Math.round(up.place(level)) + 0.5;
      context.moveTo(box.left, y);
      context.lineTo(box.right, y);
    }
    context.stroke();
    context.setLineDash([]);
  }
}

/** Returns what is said before the full scale. */
function noteOf(peak, by) {
  if (peak < NONE) return "no vibration · ";
  if (peak < FLOOR) return "below 1/1000 of ";
  return by > 1 ? `× ${by} · ` : "";
}

function nextStep(by) {
  return roundAbove(by * 1.5);
}
