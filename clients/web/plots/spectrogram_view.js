/* The live spectrogram: it begins with the last second, and follows the blocks of the finger that is shown. */

import { SampleKeeper, spectrogramPlot } from "./spectrogram_plot.js";

export class SpectrogramView {
  #plots;
  #keeper = null;
  #snapshot = null; // of the newest samples
  #panel = null;
  #paused = false;
  #timer = 0;

  /** plots: of toolbar.js. every: ms between drawings. snapshot: what to begin with. */
  constructor(plots, every, snapshot = plots.snapshot()) {
    this.#plots = plots;
    plots.follower = (...heard) => this.#hear(...heard);
    this.#begin(snapshot);
    this.#timer = setInterval(() => this.#draw(), every);
  }

  /** Shows the spectrogram on `panel`, a PlotPanel. */
  show(panel, frozen) {
    this.#panel = panel;
    this.#paused = false;
    this.#draw(frozen ? "frozen" : "");
    this.#paused = frozen;
  }

  /** Stops or goes on. */
  pause(paused) {
    this.#paused = paused;
  }

  /** Ends the view. */
  close() {
    clearInterval(this.#timer);
    this.#plots.follower = null;
  }

  #begin(snapshot = this.#plots.snapshot()) {
    this.#keeper = snapshot && new SampleKeeper(snapshot.samples, snapshot.rate);
    this.#snapshot = snapshot;
  }

  #hear(samples, fullScale, quantity, rate) {
    const { rate: before, quantity: last } = this.#snapshot ?? {};
    if (rate !== before || quantity !== last) return this.#begin();
    if (!this.#paused) this.#keeper.push(Float64Array.from(samples, (sample) => sample * fullScale));
  }

  #draw(badge = "") {
    if (!this.#panel || this.#paused || !this.#snapshot) return;
    const colours = ["ground", "signal"].map((name) => rgbOf(this.#panel.panel.colour(name)));
    if (!badge) this.#snapshot = this.#plots.snapshot() ?? this.#snapshot;
    this.#panel.show(spectrogramPlot(this.#snapshot, this.#keeper.samples, ...colours), badge);
  }
}

/** Returns [red, green, blue] of a colour "#rrggbb". */
function rgbOf(colour) {
  return [1, 3, 5].map((place) => Number.parseInt(colour.slice(place, place + 2), 16));
}
