/* The toolbars of waveform and spectrum: freeze, zoom, export, and the further views of the spectrum.

Model: the buttons are there from the beginning. What they do is loaded with their first use (plot_session.js). This
module notes what a plot needs to know of the past: the frames that were shown without a gap, and the plan of their
stream. When the last finger lifts, both plots freeze at what was felt, and the pressed slot of the page keeps it for "A
against B"; the next touch shows the live plots again.
Limits: the last second of samples; one channel. */

import { make } from "../dom.js";
import { orTell } from "../page/notice.js";

const NONE = 1e-5; // of full scale: less was no vibration, which is not worth a frozen plot
const VIEWS = { spectrum: "Spectrum", spectrogram: "Spectrogram", comparison: "A against B" };
const TOOLS = [
  ["freeze", "Freeze", "Freeze the plot, or show the live plot again"],
  ["out", "−", "Zoom out"],
  ["in", "+", "Zoom in; a live plot freezes"],
  ["svg", "SVG", "Download as SVG"],
  ["png", "PNG", "Download as PNG"],
  ["csv", "CSV", "Download the numbers as CSV"],
];
const ENTERING = ["pointermove", "pointerdown", "focus", "keydown"];

/** Puts a toolbar into each panel of `views`, a LiveViews; returns the Plots. */
export function mountToolbars(views) {
  return new Plots(views);
}

class Plots {
  /** Whether the plots show what was felt until the last finger lifted. */
  lifted = false;
  /** onFelt(spectrum): called with what a lift froze (plot_session.js). */
  onFelt = () => {};
  /** Returns the pressed slot of the page, "A" or "B", whose spectrum a lift keeps. */
  slot = () => "A";
  /** follower(samples, fullScale, quantity, rate): called with what the live plots are given; null: none. */
  follower = null;
  #finger = null; // whose frames are shown
  #frames = { next: 0, run: 0 }; // its next frame, and those before it that came without a gap
  #plans = new WeakMap(); // finger -> plan of its stream
  #touched = false;
  #tools = {};
  #loaded = null;

  constructor(views) {
    this.views = views;
    for (const name of ["waveform", "spectrum"]) this.#tools[name] = this.#mount(name, views[name].panel.canvas);
  }

  /** Notes a block of the finger that is shown: its first frame, and the number of its frames. */
  hear({ frame, frames, ready, finger }) {
    const { next, run } = this.#frames;
    const follows = finger === this.#finger && frame === next;
    this.#frames = { next: frame + frames, run: (follows ? run : 0) + frames };
    this.#finger = finger;
    if (!this.#plans.has(finger)) {
      this.#plans.set(finger, ready.plan);
      finger.addEventListener("scene", ({ detail }) => this.#plans.set(finger, detail.plan));
    }
  }

  /** Notes that the live plots show silence. */
  rest() {
    this.#frames.run = 0;
  }

  /** Notes whether a finger touches. */
  touch(touches) {
    if (touches === this.#touched) return;
    this.#touched = touches;
    if (touches) this.lifted = false;
    if (touches) return this.#loaded && this.#use((plots) => plots.touched());
    const felt = this.snapshot();
    this.lifted = Boolean(felt?.samples.some((value) => Math.abs(value) > NONE * felt.fullScale));
    if (this.lifted) this.#use((plots) => plots.lifted(felt, this.slot()));
  }

  /** Returns what a plot is made of: samples (SI) and their scales, as `Waveform.kept`, with the first frame of the
   *  stream among them and its place, the threshold, the marks, the scene and the plan; null before any sound. */
  snapshot() {
    const { waveform, spectrum } = this.views;
    const finger = this.#finger;
    if (!finger) return null;
    const kept = waveform.kept;
    const known = Math.min(this.#frames.run, kept.samples.length);
    return {
      ...kept,
      firstFrame: this.#frames.next - known,
      known: kept.samples.length - known, // samples before it belong to another stream
      size: spectrum.size,
      levels: spectrum.levels,
      marks: (spectrum.drawn?.marks ?? []).map(({ frequency }) => frequency),
      scene: finger.scene.held,
      plan: this.#plans.get(finger) ?? finger.connection.ready.plan,
    };
  }

  /** Returns the PlotPanel over a plot. */
  panel(name) {
    return this.#use((plots) => plots.panels[name]);
  }

  /** Returns what `act` returns, undefined if the tools do not load: the next use tries again. */
  async #use(act) {
    this.#loaded ??= orTell(import("./plot_session.js").then(({ PlotSession }) => new PlotSession(this, this.#tools)));
    const plots = await this.#loaded;
    if (plots) return act(plots);
    this.#loaded = null;
  }

  #mount(name, canvas) {
    const button = ([action, text, title]) =>
      make("button", { type: "button", "data-action": action, title, "aria-label": title, text });
    const buttons = TOOLS.map(button);
    buttons[0].setAttribute("aria-pressed", "false");
    const place =
      document.querySelector(`.plot-toolbar[data-plot="${name}"]`) ?? make("div.plot-toolbar", { "data-plot": name });
    place.setAttribute("role", "group");
    place.setAttribute("aria-label", `Tools of the ${name}`);
    place.append(...buttons);
    if (name === "spectrum") {
      const options = Object.entries(VIEWS).map(([value, text]) => make("option", { value, text }));
      const view = make("select", { "aria-label": "View", "data-action": "view" }, ...options);
      view.addEventListener("change", () => this.#use((plots) => plots.act(name, "view", view.value)));
      place.prepend(view);
    }
    if (!place.isConnected) canvas.before(place);
    place.addEventListener("click", ({ target }) => {
      const { action } = target.closest("button")?.dataset ?? {};
      if (action) this.#use((plots) => plots.act(name, action));
    });
    canvas.tabIndex = 0;
    canvas.setAttribute("aria-keyshortcuts", "ArrowLeft ArrowRight Home End + - 0 Escape");
    for (const type of ENTERING)
      canvas.addEventListener(type, (event) => this.#loaded ?? this.#use((plots) => plots.enter(name, event)));
    return { canvas, place };
  }
}
