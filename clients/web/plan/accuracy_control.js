/* The accuracy control: the tolerance of a scene, its predicted cost, and a measurement of all methods.

Model: the slider sets the tolerance, the largest error relative to peak-to-peak; "exact" and "imperceptible" are other
values of that field. `POST /v1/explain` predicts the cost; `POST /v1/accuracy` measures, in up to a minute.
Limits: timings are those of the service's machine with its present load. */

import { make, whileDisabled } from "../dom.js";
import { explanationOf } from "../explained.js";
import { orTell } from "../page/notice.js";
import { inWords } from "../scene/quantities.js";
import { bytesInWords, costInWords, shareInWords, words } from "./plan_view.js";
import { costOf, drawErrorPlot, plotInWords, seriesOf } from "./error_plot.js";

const LEAST = 1e-7;
const MOST = 0.03;
const STEPS_PER_DECADE = 10;
const CHOICES = {
  tolerance: "within a tolerance",
  exact: "exact, to round-off",
  imperceptible: "imperceptible: errors below the detection threshold",
};
const WAIT = 250; // ms without a change before the plan is requested

/** Events: "change" {tolerance}: number or word; "plan" {scene, plan}: the plan of the newest scene; "refused"
 *  {problem, sentence}: an error for the newest scene or for a measurement. */
export class AccuracyControl extends EventTarget {
  #call;
  #scene = null;
  #timer = 0;
  #request = new AbortController(); // of the newest plan
  #radios = {};
  #plan = null; // the newest, of the scene
  #ofHand = null; // of a stream

  /** place: the element that contains the control. call(method, path, body): that of service.js. */
  constructor(place, { call }) {
    super();
    this.#call = call;
    place.classList.add("accuracy");
    const steps = (value) => Math.round(Math.log10(value) * STEPS_PER_DECADE);
    this.slider = make("input", { type: "range", min: steps(LEAST), max: steps(MOST), step: 1, value: steps(1e-3) });
    this.slider.setAttribute("aria-label", "Tolerance: largest error relative to peak-to-peak");
    this.reading = make("output");
    this.cost = make("dl");
    this.button = make("button", { type: "button" }, "Measure all methods");
    this.status = make("p.accuracy-status");
    this.status.setAttribute("role", "status");
    this.figure = make("div");
    place.replaceChildren(
      make("fieldset", {}, this.#choices(), make("div.accuracy-slide", {}, this.slider, this.reading)),
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
    return (
      word ?? Math.min(MOST, Math.max(LEAST, Number((10 ** (this.slider.value / STEPS_PER_DECADE)).toPrecision(2))))
    );
  }

  set tolerance(value) {
    this.#radios[typeof value === "string" ? value : "tolerance"].checked = true;
    if (typeof value !== "string") this.slider.value = Math.round(Math.log10(value) * STEPS_PER_DECADE);
    this.#tell();
  }

  /** Shows the tolerance of a scene and, after a short delay, its predicted cost. */
  show(scene) {
    this.#scene = scene;
    this.tolerance = scene.accuracy?.tolerance ?? 1e-3;
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => this.predict(), WAIT);
  }

  /** Requests the plan and shows its cost; returns the plan, null if it was refused or a newer request followed. */
  async predict() {
    this.#request.abort(); // the service ends the plan that nobody wants any more
    this.#request = new AbortController();
    const { signal } = this.#request;
    const scene = this.#sceneNow();
    try {
      const plan = await this.#call("POST", "/v1/explain", scene, signal);
      if (signal.aborted) return null;
      this.#plan = plan;
      this.#list();
      this.#say("");
      this.dispatchEvent(new CustomEvent("plan", { detail: { scene, plan } }));
      return plan;
    } catch (error) {
      if (!signal.aborted) this.#refuse(error);
      return null;
    }
  }

  /** Shows the errors of the plan of a stream that follows a hand, under those of the scene. */
  hand(plan) {
    this.#ofHand = plan;
    this.#list();
  }

  #list() {
    const errors = (plan, motion) =>
      Object.entries(plan?.estimated_error ?? {}).map(([name, error]) => [
        `error ${motion}, ${words(name)}`,
        shareInWords(error),
      ]);
    const rows = this.#plan?.cost ? costInWords(this.#plan.cost) : [];
    rows.push(...errors(this.#plan, "at the set speed"), ...errors(this.#ofHand, "under a hand"));
    this.cost.replaceChildren(
      ...rows.map(([name, value]) => make("div", {}, make("dt", {}, name), make("dd", {}, value))),
    );
  }

  /** Measures all methods and draws the result; returns it, null if it was refused. */
  measure() {
    return whileDisabled(this.button, () => this.#measure());
  }

  async #measure() {
    this.#say("Measuring. This takes up to a minute.");
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
    }
  }

  /** Draws a measurement: figure, legend and table. */
  draw(measured) {
    const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    svg.setAttribute("class", "error-plot");
    svg.setAttribute("role", "img");
    svg.setAttribute("aria-label", plotInWords(measured));
    const kinds = new Map(seriesOf(measured).map((series) => [series.name, series]));
    const legend = make(
      "ul.error-legend",
      {},
      ...[...kinds.values()].map(({ family, name, open }) =>
        make(`li.family-${family}`, {}, make(open ? "i.open" : "i"), name),
      ),
    );
    legend.append(
      make("li", {}, make("i.ring"), "the plan’s choice"),
      make("li", {}, make("i.front"), "Pareto front: no other method is both more accurate and cheaper"),
    );
    const tools = make("div.plot-toolbar", { "data-plot": "error", role: "group", "aria-label": "Tools of the plot" });
    const plot = make("div.error-plot-room", {}, svg);
    this.figure.replaceChildren(
      tools,
      plot,
      legend,
      make("details", {}, make("summary", {}, "All methods as a table"), tableOf(measured)),
    );
    const shown = { svg, axes: null, window: null };
    shown.draw = () => {
      shown.axes = drawErrorPlot(svg, measured, shown.window);
    };
    new ResizeObserver(shown.draw).observe(svg);
    orTell(import("./error_plot_tools.js")).then((loaded) => loaded?.mountErrorTools(tools, shown, measured));
  }

  #choices() {
    const box = make("div.accuracy-choice");
    box.setAttribute("role", "radiogroup");
    box.setAttribute("aria-label", "Accuracy");
    const group = `accuracy-${Math.random().toString(36).slice(2)}`;
    for (const [name, told] of Object.entries(CHOICES)) {
      const radio = make("input", { type: "radio", name: group, value: name, checked: name === "tolerance" });
      radio.addEventListener("change", () => this.#choose());
      this.#radios[name] = radio;
      box.append(make("label", {}, radio, ` ${told}`));
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
    this.slider.setAttribute("aria-valuetext", number ? `${shareInWords(tolerance)} of peak-to-peak` : tolerance);
  }

  #refuse(error) {
    const [sentence, problem] = [explanationOf(error), error.problem ?? null];
    this.#say(sentence, true);
    this.dispatchEvent(new CustomEvent("refused", { detail: { problem, sentence } }));
  }

  #say(sentence, bad = false) {
    this.status.textContent = sentence;
    this.status.toggleAttribute("data-bad", bad);
  }
}

function tableOf(measured) {
  const head = ["method", "largest error", "set-up", "per second of sound", "with set-up", "memory"];
  const rows = measured.methods.map((row) => [
    row.method,
    row.max_error.toExponential(1),
    inWords(row.setup_seconds, "s", 2),
    inWords(row.seconds_per_second, "s", 2),
    inWords(costOf(measured, row), "s", 2),
    bytesInWords(row.memory_bytes),
  ]);
  const table = make(
    "table",
    {},
    make("caption", {}, `Error and cost of all methods, ${words(measured.quantity)}. The plan uses the one in bold.`),
    make("thead", {}, make("tr", {}, ...head.map((name) => make("th", { scope: "col" }, name)))),
    make(
      "tbody",
      {},
      ...rows.map(([method, ...cells]) => {
        const row = make("tr", {}, make("th", { scope: "row" }, method), ...cells.map((cell) => make("td", {}, cell)));
        if (method === measured.chosen) row.setAttribute("aria-current", "true");
        return row;
      }),
    ),
  );
  const compiled = measured.compile_seconds
    ? `, of which ${inWords(measured.compile_seconds, "s", 2)} for compilation`
    : "";
  const once = `Once per process: ${inWords(measured.process_seconds, "s", 2)} to start, import and load the kernels`;
  return make(
    "div.accuracy-table",
    { tabindex: 0, role: "region", "aria-label": "Table of methods" },
    table,
    make("p", {}, `${once}${compiled}.`),
  );
}
