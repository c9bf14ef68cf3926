/* What the toolbars of waveform and spectrum do (toolbar.js), loaded with their first use. */

import { exportPlot } from "./export_plot.js";
import { followGestures } from "./gestures.js";
import { PlotPanel } from "./plot_panel.js";
import { lineInWords, LOWEST, spectrumOf, spectrumPlot } from "./spectrum_plot.js";
import { waveformPlot } from "./waveform_plot.js";
import { orTell } from "../page/notice.js";
import { inWords, quantityOf } from "../scene/quantities.js";
import { largestLine } from "../views/fourier_transform.js";

const EVERY = 150; // ms between drawings of the live spectrogram
const FURTHER = {
  spectrogram: () => import("./spectrogram_view.js"),
  comparison: () => import("./comparison_plot.js"),
};
const MAKERS = { waveform: waveformPlot, spectrum: spectrumPlot };

export class PlotSession {
  /** name -> the PlotPanel over that plot. */
  panels = {};
  #plots;
  #tools; // name -> {canvas, place}
  #gestures = {};
  #frozen = {}; // name -> {snapshot, by: "button" or "lift"}
  #view = "spectrum";
  #slots = {};
  #further = null; // the view that is open in place of the spectrum

  /** plots: of toolbar.js, which makes snapshots. tools: name -> {canvas, place} of each toolbar. */
  constructor(plots, tools) {
    [this.#plots, this.#tools] = [plots, tools];
    for (const [name, { canvas }] of Object.entries(tools)) {
      this.panels[name] = new PlotPanel(canvas, () => this.#live(name));
      this.#gestures[name] = followGestures(canvas, this.panels[name], () => this.#freeze(name));
    }
  }

  /** Forwards the event that loaded this module. */
  enter(name, event) {
    this.#gestures[name](event);
  }

  /** The hand has lifted: freezes what was felt, and keeps it for a slot, "A" or "B". */
  lifted(snapshot, slot) {
    this.#slots[slot] = snapshot;
    this.#plots.onFelt(feltOf(snapshot));
    for (const name of Object.keys(this.#tools)) this.#freeze(name, "lift", snapshot);
    if (this.#view === "comparison") this.#show("spectrum");
  }

  /** A hand touches: what was frozen by a lift is live again. */
  touched() {
    for (const [name, { by }] of Object.entries(this.#frozen)) if (by === "lift") this.#thaw(name);
  }

  /** Does what a control of the toolbar `name` says. */
  act(name, action, value) {
    const panel = this.panels[name];
    if (action === "freeze") return this.#frozen[name] ? this.#thaw(name) : this.#freeze(name);
    if (action === "view") return this.#choose(value);
    if (action === "in" || action === "out") {
      this.#freeze(name);
      return panel.zoom(action === "in" ? 2 : 0.5);
    }
    return this.#export(name, action);
  }

  #freeze(name, by = "button", snapshot = this.#plots.snapshot()) {
    if (!snapshot) return this.#say(name, "Stroke the pad first: there is nothing to freeze.");
    if (this.#frozen[name]) return;
    this.#frozen[name] = { snapshot, by };
    this.#further?.pause(name === "spectrum");
    this.#press(name, true);
    this.#show(name);
  }

  #thaw(name) {
    delete this.#frozen[name];
    if (name === "spectrum") this.#further?.pause(false);
    this.#press(name, false);
    this.#show(name);
  }

  /** Shows what the toolbar says: the view of the spectrum, or the frozen or the live plot. */
  #show(name) {
    const frozen = this.#frozen[name];
    const panel = this.panels[name];
    if (name === "spectrum" && this.#view === "comparison") return this.#further?.show(panel, this.#slots);
    if (name === "spectrum" && this.#view === "spectrogram") return this.#further?.show(panel, Boolean(frozen));
    panel.show(frozen ? MAKERS[name](frozen.snapshot) : null, frozen && badgeOf(frozen.by));
  }

  /** Chooses the view of the spectrum. The others are loaded with their first use. */
  async #choose(view) {
    this.#view = view;
    this.#further?.close();
    this.#further = null;
    const loaded = view in FURTHER ? await orTell(FURTHER[view]()) : null;
    if (this.#view !== view) return;
    if (view in FURTHER && !loaded) this.#view = this.#tools.spectrum.place.querySelector("select").value = "spectrum";
    else if (view === "spectrogram")
      this.#further = new loaded.SpectrogramView(this.#plots, EVERY, this.#frozen.spectrum?.snapshot);
    else if (view === "comparison") this.#compare(loaded.comparisonPlot);
    this.#show("spectrum");
  }

  #compare(comparisonPlot) {
    const show = (panel, slots) => {
      const plot = slots.A || slots.B ? comparisonPlot(slots) : null;
      panel.show(plot);
      if (plot) this.#say("spectrum", plot.told);
    };
    this.#further = { show, pause() {}, close() {} };
    if (!this.#slots.A && !this.#slots.B)
      this.#say("spectrum", "Stroke with A pressed above the textures, then with B.");
  }

  async #export(name, format) {
    const panel = this.panels[name];
    const snapshot = this.#frozen[name]?.snapshot ?? this.#plots.snapshot();
    if (!panel.plot && !snapshot) return this.#say(name, "Stroke the pad first: there is nothing to export.");
    const plot = panel.plot ?? MAKERS[name](snapshot);
    const window = panel.window ?? plot.begin ?? [plot.across.low, plot.across.high];
    const { width, height } = panel.panel;
    const [colour, font] = ["colour", "font"].map((method) => panel.panel[method].bind(panel.panel));
    await exportPlot(format, plot, { width, height, colour, font }, window);
  }

  /** Returns {plot, axes} of a live view, null before its first drawing. */
  #live(name) {
    const view = this.#plots.views[name];
    if (!view.axes || !view.drawn) return null;
    const { drawn, axes, quantity } = view;
    const { unit } = quantityOf(quantity);
    const [xs, ys] = name === "waveform" ? [drawn.times, drawn.values] : [drawn.frequencies, drawn.amplitudes];
    const describe = (x, y) =>
      name === "spectrum" ? lineInWords(x, y, unit, view.levels) : `${inWords(x, "s", 4)}: ${inWords(y, unit, 4)}`;
    return { plot: { lines: [{ xs, ys }], across: axes.across, describe }, axes };
  }

  #press(name, frozen) {
    this.#tools[name].place.querySelector('[data-action="freeze"]').setAttribute("aria-pressed", String(frozen));
  }

  #say(name, sentence) {
    this.panels[name].status.textContent = sentence;
  }
}

/** Returns the spectrum of a snapshot as the answer in words reads it (page/answer.js). */
function feltOf(snapshot) {
  const { frequencies, amplitudes } = spectrumOf(snapshot);
  const first = frequencies.findIndex((frequency) => frequency >= LOWEST);
  const drawn = {
    frequencies: frequencies.slice(first),
    amplitudes: amplitudes.slice(first),
    threshold: snapshot.levels,
    largest: largestLine(amplitudes, snapshot.rate, LOWEST),
  };
  return { drawn, fullScale: snapshot.fullScale, quantity: snapshot.quantity };
}

function badgeOf(by) {
  return by === "lift" ? "frozen at the lift" : "frozen";
}
