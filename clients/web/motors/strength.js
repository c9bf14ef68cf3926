/* The strength of a vibration for motors, which play no waveform: a number from 0 to 1 for each 10 ms of samples.

Model: the spectrum of the last 43 ms, without its mean and with a Hann window, is divided by the detection threshold at
each frequency up to 1 kHz. The sensation level is that of the sum of the powers,

    S = 10 log10( sum over f of (amplitude(f) / threshold(f))^2 ) dB,

so a sinusoid at its threshold has 0 dB. CURVE converts S to the strength (docs/touch-page.md, "Motors").
Source: thresholds of `GET /v1/threshold`. CURVE is an unverified default: thresholds of people differ by some 10 dB,
and motors of gamepads do not start below some 0.2.
Limits: the frequency is lost; masking and temporal summation are neglected. Without a threshold (for a force, or if the
service has none) the level is relative to a hundredth of full scale. */

import { quantityOf } from "../scene/quantities.js";
import { FourierTransform } from "../views/fourier_transform.js";

const SPAN = 0.01; // s
const WINDOW = 0.0427; // s; shorter blurs low frequencies, longer adds delay
const HIGHEST = 1000; // Hz, highest frequency that skin feels
const RELATIVE = 0.01; // of full scale: amplitude of 0 dB without a threshold
/** [sensation level in dB, strength], interpolated linearly; usual strokes have -5 to 40 dB. */
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

/** Returns the threshold at `frequency` (Hz), interpolated linearly on logarithmic scales. */
function thresholdAt({ frequencies, displacement }, frequency) {
  const above = frequencies.findIndex((one) => one >= frequency);
  const at = Math.max(1, above < 0 ? frequencies.length - 1 : above);
  const part = Math.log(frequency / frequencies[at - 1]) / Math.log(frequencies[at] / frequencies[at - 1]);
  return displacement[at - 1] * (displacement[at] / displacement[at - 1]) ** part;
}

export class MotorStrength {
  #span;
  #channels;
  #channel;
  #kept;
  #place = 0;
  #count = 0;
  #transform;
  #window;
  #weights;

  /** rate: Hz. quantities: of the channels; the first one with a threshold is used. fullScale: SI value of 1.0 in each
   *  channel. threshold: answer of `GET /v1/threshold`, or null. */
  constructor({ rate, quantities, fullScale, threshold }) {
    const size = 2 ** Math.max(5, Math.round(Math.log2(WINDOW * rate)));
    const orders = quantities.map((quantity) => quantityOf(quantity).order);
    this.#span = Math.max(1, Math.round(SPAN * rate));
    this.#channels = quantities.length;
    this.#channel = Math.max(
      0,
      orders.findIndex((order) => order !== null),
    );
    this.#kept = new Float64Array(size);
    this.#transform = new FourierTransform(size);
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

  /** Takes samples, channels interleaved, 1.0 = full scale. Returns a strength for each span of 10 ms that they
   *  complete. */
  push(samples) {
    return this.levels(samples).map(strengthOf);
  }

  /** Returns the same as sensation levels, dB; -Infinity is silence. */
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
