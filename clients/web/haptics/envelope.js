/* How strong a vibration feels, for motors that take a strength and no waveform: samples in, one number each 10 ms out.

Model: the spectrum of the last 43 ms or so, under a Hann window and without its mean, is weighted by what a fingertip
just feels at each frequency up to 1 kHz. The sensation level is the sum of the powers,

    S = 10 log10( sum over f of (amplitude(f) / threshold(f))^2 ) dB,

so a sinusoid at its threshold has 0 dB. CURVE leads from S to the strength (docs/touch-page.md, "Motors").
Source: thresholds of `GET /v1/threshold`. CURVE is an unverified default: thresholds of people differ by some 10 dB, and
motors of gamepads do not start below some 0.2.
Limits: the pitch is lost; masking and the time that a feeling takes to build up are left out. A quantity without a
threshold (a force), or a page without a curve, is heard in dB over a hundredth of full scale. */

import { QUANTITIES } from "../sight/scale.js";
import { Transform } from "../sight/transform.js";

const SPAN = 0.01; // s
const WINDOW = 0.0427; // s, about: shorter blurs what is slow, longer comes late
const HIGHEST = 1000; // Hz: what skin feels ends here
const RELATIVE = 0.01; // of full scale: 0 dB where there is no threshold
/** [sensation level in dB, strength], in straight lines; an everyday stroke has -5 to 40 dB. */
export const CURVE = [
  [-15, 0],
  [-5, 0.25],
  [40, 0.8],
  [60, 1],
];

/** Returns the strength, 0 to 1, of a sensation level in dB. */
export function strengthOf(level) {
  if (!(level > CURVE[0][0])) return 0;
  const next = CURVE.findIndex(([end]) => level <= end);
  if (next < 0) return 1;
  const [[from, low], [to, high]] = [CURVE[next - 1], CURVE[next]];
  return low + ((high - low) * (level - from)) / (to - from);
}

/** Returns the threshold at `frequency` (Hz), in straight lines over the logarithms. */
function thresholdAt({ frequencies, displacement }, frequency) {
  const above = frequencies.findIndex((one) => one >= frequency);
  const at = Math.max(1, above < 0 ? frequencies.length - 1 : above);
  const part = Math.log(frequency / frequencies[at - 1]) / Math.log(frequencies[at] / frequencies[at - 1]);
  return displacement[at - 1] * (displacement[at] / displacement[at - 1]) ** part;
}

export class Envelope {
  #span;
  #channels;
  #channel;
  #kept;
  #place = 0;
  #count = 0;
  #transform;
  #window;
  #weights;

  /** rate: Hz. quantities: of the channels, interleaved; the first that has a threshold is heeded. fullScale: what is
   *  1.0 in each channel, SI. threshold: the curve of `GET /v1/threshold`, null where there is none. */
  constructor({ rate, quantities, fullScale, threshold }) {
    const size = 2 ** Math.max(5, Math.round(Math.log2(WINDOW * rate)));
    const orders = quantities.map((quantity) => QUANTITIES[quantity]?.order ?? null);
    this.#span = Math.max(1, Math.round(SPAN * rate));
    this.#channels = quantities.length;
    this.#channel = Math.max(
      0,
      orders.findIndex((order) => order !== null),
    );
    this.#kept = new Float64Array(size);
    this.#transform = new Transform(size);
    this.#window = Float64Array.from({ length: size }, (_, index) => Math.sin((Math.PI * index) / size) ** 2);
    const power = this.#window.reduce((sum, value) => sum + value * value, 0);
    const order = threshold ? orders[this.#channel] : null;
    const scale = fullScale[this.#channel];
    const bins = Math.min(size / 2, Math.floor((HIGHEST * size) / rate) + 1);
    this.#weights = Float64Array.from({ length: bins }, (_, bin) => {
      const frequency = (bin * rate) / size;
      if (!bin) return 0;
      const felt =
        order === null ? RELATIVE * scale : thresholdAt(threshold, frequency) * (2 * Math.PI * frequency) ** order;
      return (4 * (scale / felt) ** 2) / (size * power);
    });
  }

  /** Takes samples in units of full scale; returns the strengths, 0 to 1, of the spans that they complete. */
  push(samples) {
    return this.levels(samples).map(strengthOf);
  }

  /** The same as sensation levels, dB; -Infinity is silence. */
  levels(samples) {
    const levels = [];
    for (let place = this.#channel; place < samples.length; place += this.#channels) {
      this.#kept[this.#place] = samples[place];
      this.#place = (this.#place + 1) % this.#kept.length;
      this.#count += 1;
      if (this.#count < this.#span) continue;
      this.#count = 0;
      levels.push(this.#level());
    }
    return levels;
  }

  #level() {
    const { length } = this.#kept;
    const mean = this.#kept.reduce((sum, value) => sum + value, 0) / length;
    const newest = Float64Array.from({ length }, (_, index) => this.#kept[(this.#place + index) % length] - mean);
    const { real, imaginary } = this.#transform.complex(newest, this.#window);
    let sum = 0;
    for (let bin = 1; bin < this.#weights.length; bin += 1)
      sum += this.#weights[bin] * (real[bin] ** 2 + imaginary[bin] ** 2);
    return 10 * Math.log10(sum);
  }
}
