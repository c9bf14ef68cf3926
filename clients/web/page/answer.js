/* The answer in words: how far the vibration is over the detection threshold, and at which frequency.

Model: of the lines that the spectrum shows up to HIGHEST, the one that is the most above the threshold. Thresholds of people
differ, so within the band that the spectrum shows about the threshold the answer says "near".
Limits: lines are taken one by one; together they may be felt where each alone is not. */

import { byId } from "../dom.js";
import { inWords, quantityOf } from "../scene/quantities.js";
import { THRESHOLD_SPREAD } from "../views/spectrum.js";

const HIGHEST = 1000; // Hz, highest frequency that skin feels
const EVERY = 250; // ms between answers; more often cannot be read
const NEAR = 20 * Math.log10(THRESHOLD_SPREAD); // dB
const SILENT = 1e-6; // of full scale

/** Returns {level (dB), frequency (Hz)} of the line that is the most above the threshold; null for none.
 *  drawn: that of the Spectrum. */
export function strongestFelt({ frequencies, amplitudes, threshold }) {
  if (!threshold.length) return null;
  let best = null;
  let next = 1;
  for (const [index, frequency] of frequencies.entries()) {
    if (frequency < threshold[0][0] || frequency > HIGHEST) continue;
    while (next < threshold.length - 1 && threshold[next][0] < frequency) next++;
    const [[from, low], [to, high]] = [threshold[next - 1], threshold[next]];
    const limit = low * (high / low) ** (Math.log(frequency / from) / Math.log(to / from));
    const level = 20 * Math.log10(amplitudes[index] / limit);
    if (!best || level > best.level) best = { level, frequency };
  }
  return best;
}

/** Returns the answer for what a Spectrum has drawn, as a sentence; "" while its threshold is not loaded. */
export function answerOf({ drawn, fullScale, quantity }) {
  if (!drawn || !(drawn.largest.amplitude > SILENT * fullScale)) return "No vibration.";
  const found = strongestFelt(drawn);
  if (!found) return quantityOf(quantity).order === null ? "This quantity has no threshold." : "";
  const { level, frequency } = found;
  const where = `at ${inWords(Number(frequency.toPrecision(3)), "Hz")}`;
  if (Math.abs(level) < NEAR) return `Near the threshold ${where}`;
  return `${Math.abs(level).toFixed(0)} dB ${level > 0 ? "over" : "under"} threshold ${where}`;
}

/** Keeps the answer up to date from now on. spectrum: the Spectrum. */
export class Answer {
  #seen = null;
  #held = false;

  constructor(spectrum) {
    this.spectrum = spectrum;
    setInterval(() => this.#held || this.#tell(), EVERY);
  }

  /** Keeps the answer while `held`: the plots show what was felt until a lift. */
  hold(held) {
    this.#held = held;
  }

  /** Tells of a spectrum that is not the live one; its members are those that `answerOf` reads. */
  tellOf(spectrum) {
    byId("answer").textContent = answerOf(spectrum);
  }

  #tell() {
    if (this.spectrum.drawn === this.#seen) return;
    this.#seen = this.spectrum.drawn;
    byId("answer").textContent = answerOf(this.spectrum);
  }
}
