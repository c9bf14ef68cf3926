/* The plan of a scene as text: what is simulated, what is left out, why, and at what cost.

Source: the answer of `POST /v1/explain`, or the `plan` of a live session, which has neither `scene` nor `cost`.
Limits: settings of effects are not shown; the form shows them. */

import { make } from "../dom.js";
import { inWords, quantityOf } from "../scene/quantities.js";

/** Returns the name of a field as text: "contact_growth" -> "contact growth". */
export function words(name) {
  return quantityOf(name).name;
}

/** Returns a number of bytes as text. */
export function bytesInWords(bytes) {
  return inWords(bytes, "B", 2);
}

/** Returns the cost of a plan as text: [[name, value]]. */
export function costInWords(cost) {
  return [
    ["set-up", inWords(cost.setup_seconds, "s", 2)],
    ["per frame", inWords(cost.ns_per_frame * 1e-9, "s", 2)],
    ["speed", `${Number(cost.times_real_time.toPrecision(2))} × real time`],
    ["memory", bytesInWords(cost.memory_bytes)],
    ...(cost.process_seconds ? [["once per process", inWords(cost.process_seconds, "s", 2)]] : []),
  ];
}

/** Returns a fraction as text: 0.0012 -> "0.12 %", 2e-6 -> "2e−6". */
export function shareInWords(share) {
  if (share >= 1e-4) return `${Number((100 * share).toPrecision(2))} %`;
  return share ? share.toExponential(0).replace("-", "−") : "0";
}

export class PlanView {
  #element;

  /** place: the element that shows the plan. */
  constructor(place) {
    this.#element = place;
    place.classList.add("plan");
  }

  /** Shows a plan. */
  show(plan) {
    this.#element.replaceChildren(
      ...plan.warnings.map((warning) => make("p.plan-warning", {}, warning)),
      make("h3", {}, "Simulated"),
      plan.simulated.length
        ? make("ol", {}, ...plan.simulated.map((part) => item(words(part.name), part.reason, priceOf(part))))
        : make("p", {}, "Nothing, because there is no vibration."),
      make("h3", {}, "Left out"),
      plan.left_out.length
        ? make(
            "ul",
            {},
            ...grouped(plan.left_out).map(({ names, reason, effect }) => item(names.join(", "), reason, effect)),
          )
        : make("p", {}, "Nothing."),
      ...numbers(
        "Estimated error, relative to peak-to-peak",
        Object.entries(plan.estimated_error).map(([name, error]) => [words(name), shareInWords(error)]),
      ),
      ...numbers("Contact", contactOf(plan.response)),
      ...(plan.cost ? numbers("Cost on the service’s machine", costInWords(plan.cost)) : []),
      ...numbers("Computation", responseOf(plan.response)),
    );
  }
}

function item(name, reason, beside) {
  return make(
    "li",
    {},
    make("strong", {}, name),
    beside ? make("span.plan-beside", {}, beside) : null,
    make("p", {}, reason),
  );
}

function priceOf({ price }) {
  return price ? `${inWords(price.ns_per_frame * 1e-9, "s", 2)} per frame, ${bytesInWords(price.memory_bytes)}` : "";
}

/** Groups parts that are left out for the same reason. */
function grouped(parts) {
  const groups = new Map();
  for (const { name, reason, effect_on_output: change } of parts) {
    const effect = change === null ? "changes nothing" : `changes the output by ${shareInWords(change)}`;
    const key = `${reason}|${effect}`;
    if (!groups.has(key)) groups.set(key, { names: [], reason, effect });
    groups.get(key).names.push(words(name));
  }
  return [...groups.values()];
}

function numbers(title, rows) {
  if (!rows.length) return [];
  return [
    make("h3", {}, title),
    make("dl", {}, ...rows.flatMap(([name, value]) => [make("dt", {}, name), make("dd", {}, value)])),
  ];
}

/** Returns the contact at the load of the scan. Plans of live sessions and of silent scenes lack some of its numbers.
 *  */
function contactOf({ stiffness, contact_fraction: touching, rms, sensation_level_db: level }) {
  const known = (value) => value !== undefined && value !== null;
  return [
    ...(known(stiffness) ? [["stiffness", inWords(stiffness, "N/m")]] : []),
    ...(known(touching) ? [["contact fraction", shareInWords(touching)]] : []),
    ...Object.entries(rms ?? {}).map(([name, value]) => [`${words(name)}, rms`, inWords(value, quantityOf(name).unit)]),
    ...(known(level) ? [["sensation level", `${Math.round(level)} dB`.replace("-", "−")]] : []),
  ];
}

function responseOf(response) {
  const counts = { harmonics: "count", phases_solved: "count", rows: "count", steps_a_frame: "count" };
  const shown = { method: "", solver: "", fundamental_hz: "Hz", ...counts };
  const values = { ...response, ...response.simulation };
  return Object.entries(shown)
    .filter(([name]) => values[name] !== undefined && values[name] !== null)
    .map(([name, unit]) => {
      const value = values[name];
      const told = unit === "count" || typeof value === "string" ? String(value) : inWords(value, unit);
      return [words(name.replace("_hz", "")), told];
    });
}
