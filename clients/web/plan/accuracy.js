/* The accuracy control: how exact a scene is to be, what that costs as far as the plan knows, and what it costs
measured.

The slider is the tolerance, the largest error relative to the peak-to-peak; "exact" and "imperceptible" are the scene's
own words. The predicted cost is that of `POST /v1/explain`; a measurement is `POST /v1/accuracy`, up to a minute.
Limits: timings are those of the service's machine while it does whatever else it does. */

import { inWords } from "../sight/scale.js";
import { bytesInWords, costInWords, element, shareInWords, words } from "./plan.js";
import { costOf, drawErrorPlot, plotInWords, seriesOf } from "./error_plot.js";

const LEAST = 1e-7;
const MOST = 0.03;
const STEPS_A_DECADE = 10;
const CHOICES = {
  tolerance: "within a tolerance",
  exact: "exact: to round-off",
  imperceptible: "imperceptible: errors below what is felt",
};
const WAIT = 250; // ms of rest before a cost is asked for

/** The control inside `place`. call(method, path, body): as in service.js. Events: "change" {tolerance}: a number or a
 *  word; "plan" {scene, plan}: what the service answered for a scene, unless a later one was asked for meanwhile;
 *  "refused" {problem, sentence}: likewise, or what came of a measurement. */
export class AccuracyControl extends EventTarget {
  #call;
  #scene = null;
  #timer = 0;
  #asked = 0;
  #radios = {};

  constructor(place, { call }) {
    super();
    this.#call = call;
    place.classList.add("accuracy");
    const steps = (value) => Math.round(Math.log10(value) * STEPS_A_DECADE);
    this.slider = element("input", { type: "range", min: steps(LEAST), max: steps(MOST), step: 1, value: steps(1e-3) });
    this.slider.setAttribute("aria-label", "Tolerance: largest error, of peak to peak");
    this.reading = element("output");
    this.cost = element("dl");
    this.button = element("button", { type: "button" }, "Measure every method");
    this.status = element("p", { className: "accuracy-status" });
    this.status.setAttribute("role", "status");
    this.figure = element("div");
    place.replaceChildren(
      element(
        "fieldset",
        {},
        this.#choices(),
        element("div", { className: "accuracy-slide" }, this.slider, this.reading),
      ),
      this.cost,
      this.status,
      this.button,
      this.figure,
    );
    this.slider.addEventListener("input", () => this.#choose());
    this.button.addEventListener("click", () => this.measure());
    this.#tell();
  }

  /** A number (relative to the peak-to-peak), "exact" or "imperceptible". */
  get tolerance() {
    const word = ["exact", "imperceptible"].find((name) => this.#radios[name].checked);
    return word ?? Math.min(MOST, Math.max(LEAST, Number((10 ** (this.slider.value / STEPS_A_DECADE)).toPrecision(2))));
  }

  set tolerance(value) {
    this.#radios[typeof value === "string" ? value : "tolerance"].checked = true;
    if (typeof value !== "string") this.slider.value = Math.round(Math.log10(value) * STEPS_A_DECADE);
    this.#tell();
  }

  /** Shows a scene: its tolerance, and, after a moment, its predicted cost. */
  show(scene) {
    this.#scene = scene;
    this.tolerance = scene.accuracy?.tolerance ?? 1e-3;
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => this.predict(), WAIT);
  }

  /** Asks for the plan's cost and shows it; returns the plan, null where it was overtaken or refused. */
  async predict() {
    const asked = ++this.#asked;
    const scene = this.#sceneNow();
    try {
      const plan = await this.#call("POST", "/v1/explain", scene);
      if (asked !== this.#asked) return null;
      const errors = Object.entries(plan.estimated_error).map(([name, error]) => [
        `error, ${words(name)}`,
        shareInWords(error),
      ]);
      const rows = [...(plan.cost ? costInWords(plan.cost) : []), ...errors];
      const shown = rows.map(([name, value]) => element("div", {}, element("dt", {}, name), element("dd", {}, value)));
      this.cost.replaceChildren(...shown);
      this.#say("");
      this.dispatchEvent(new CustomEvent("plan", { detail: { scene, plan } }));
      return plan;
    } catch (error) {
      if (asked === this.#asked) this.#refuse(error);
      return null;
    }
  }

  /** Measures every method and draws it; returns the document, null where it was refused. */
  async measure() {
    this.button.disabled = true;
    this.#say("Measuring: it takes up to a minute.");
    try {
      const measured = await this.#call("POST", "/v1/accuracy", this.#sceneNow());
      this.#say(
        `Measured ${measured.methods.length} methods for the ${words(measured.quantity)}, on the service’s machine.`,
      );
      this.draw(measured);
      return measured;
    } catch (error) {
      this.#refuse(error);
      return null;
    } finally {
      this.button.disabled = false;
    }
  }

  /** Draws a measurement: the figure, what its colours mean, and the table. */
  draw(measured) {
    const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    svg.setAttribute("class", "error-plot");
    svg.setAttribute("role", "img");
    svg.setAttribute("aria-label", plotInWords(measured));
    const kinds = new Map(seriesOf(measured).map((series) => [series.name, series]));
    const legend = element(
      "ul",
      { className: "error-legend" },
      ...[...kinds.values()].map(({ family, name, open }) =>
        element("li", { className: `family-${family}` }, element("i", { className: open ? "open" : "" }), name),
      ),
    );
    legend.append(
      element("li", {}, element("i", { className: "ring" }), "the plan’s choice"),
      element("li", {}, element("i", { className: "front" }), "nothing is both nearer and cheaper"),
    );
    this.figure.replaceChildren(
      svg,
      legend,
      element("details", {}, element("summary", {}, "All methods as a table"), tableOf(measured)),
    );
    new ResizeObserver(() => drawErrorPlot(svg, measured)).observe(svg);
  }

  #choices() {
    const box = element("div", { className: "accuracy-choice" });
    box.setAttribute("role", "radiogroup");
    box.setAttribute("aria-label", "How exact");
    const group = `accuracy-${Math.random().toString(36).slice(2)}`;
    for (const [name, told] of Object.entries(CHOICES)) {
      const radio = element("input", { type: "radio", name: group, value: name, checked: name === "tolerance" });
      radio.addEventListener("change", () => this.#choose());
      this.#radios[name] = radio;
      box.append(element("label", {}, radio, ` ${told}`));
    }
    return box;
  }

  #choose() {
    this.#tell();
    this.dispatchEvent(new CustomEvent("change", { detail: { tolerance: this.tolerance } }));
    if (this.#scene) this.show(this.#sceneNow());
  }

  #sceneNow() {
    return { ...this.#scene, accuracy: { ...this.#scene?.accuracy, tolerance: this.tolerance } };
  }

  #tell() {
    const { tolerance } = this;
    const number = typeof tolerance === "number";
    this.slider.disabled = !number;
    this.reading.textContent = number ? shareInWords(tolerance) : "";
    this.slider.setAttribute("aria-valuetext", number ? `${shareInWords(tolerance)} of peak to peak` : tolerance);
  }

  #refuse({ message: sentence, problem = null }) {
    this.#say(sentence, true);
    this.dispatchEvent(new CustomEvent("refused", { detail: { problem, sentence } }));
  }

  #say(sentence, bad = false) {
    this.status.textContent = sentence;
    this.status.toggleAttribute("data-bad", bad);
  }
}

function tableOf(measured) {
  const head = ["method", "largest error", "set-up", "per second of sound", "set-up included", "memory"];
  const rows = measured.methods.map((row) => [
    row.method,
    row.max_error.toExponential(1),
    inWords(row.setup_seconds, "s", 2),
    inWords(row.seconds_per_second, "s", 2),
    inWords(costOf(measured, row), "s", 2),
    bytesInWords(row.memory_bytes),
  ]);
  const table = element(
    "table",
    {},
    element(
      "caption",
      {},
      `What each method errs by and costs, ${words(measured.quantity)}; bold is what the plan takes`,
    ),
    element("thead", {}, element("tr", {}, ...head.map((name) => element("th", { scope: "col" }, name)))),
    element(
      "tbody",
      {},
      ...rows.map(([method, ...cells]) => {
        const row = element(
          "tr",
          {},
          element("th", { scope: "row" }, method),
          ...cells.map((cell) => element("td", {}, cell)),
        );
        if (method === measured.chosen) row.setAttribute("aria-current", "true");
        return row;
      }),
    ),
  );
  const compiled = measured.compile_seconds ? `; ${inWords(measured.compile_seconds, "s", 2)} of it compiled them` : "";
  const once = `Once a process: ${inWords(measured.process_seconds, "s", 2)} to start, import, and load its kernels`;
  return element(
    "div",
    { className: "accuracy-table", tabIndex: 0, role: "region", ariaLabel: "Table of methods" },
    table,
    element("p", {}, `${once}${compiled}.`),
  );
}
