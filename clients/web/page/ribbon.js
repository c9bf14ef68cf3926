/* The ribbon over the pad of a narrow screen: the last quarter of a second of the vibration, without axes.

Model: each column shows the range of its samples. The scale is that of the largest sample in view. */

import { Panel } from "../views/panel.js";

const SPAN = 0.25; // s
const ROOM = 0.9; // part of the height that the largest sample takes
const LEAST = 1e-3; // of full scale; smaller vibrations are not magnified further

export class Ribbon {
  #kept = new Float32Array(0);
  #written = 0;

  constructor(canvas) {
    this.panel = new Panel(canvas, "Ribbon of the waveform.", () => this.#draw()).moving();
  }

  /** Adds samples of one channel, 1.0 = full scale. rate: Hz. */
  push(samples, rate) {
    const frames = Math.ceil(SPAN * rate);
    if (frames !== this.#kept.length) [this.#kept, this.#written] = [new Float32Array(frames), 0];
    for (const sample of samples) this.#kept[this.#written++ % frames] = sample;
    this.panel.request();
  }

  /** Shows silence. */
  rest() {
    this.#kept.fill(0);
    this.panel.request();
  }

  #draw() {
    const { context, width, height } = this.panel;
    const frames = this.#kept.length;
    if (!frames) return;
    const largest = this.#kept.reduce((most, sample) => Math.max(most, Math.abs(sample)), LEAST);
    const up = (ROOM * height) / 2 / largest;
    context.fillStyle = this.panel.colour("signal");
    for (let x = 0; x < width; x++) {
      const [from, to] = [x, x + 1].map((edge) => Math.floor((edge / width) * frames));
      let [low, high] = [Infinity, -Infinity];
      for (let frame = from; frame <= Math.min(to, frames - 1); frame++) {
        const sample = this.#kept[(this.#written + frame) % frames];
        [low, high] = [Math.min(low, sample), Math.max(high, sample)];
      }
      context.fillRect(x, height / 2 - high * up - 0.75, 1, (high - low) * up + 1.5);
    }
  }
}
