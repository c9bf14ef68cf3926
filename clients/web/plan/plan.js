/* The plan of a scene as a person reads it: what is simulated and what is left out, why, and what it costs.

Source: the answer of `POST /v1/explain`, or the `plan` of a live session, which has neither `scene` nor `cost`.
Limits: an effect's settings are not repeated here, since the form shows them with their units. */

import { inWords, QUANTITIES } from "../sight/scale.js";

/** Returns a new element of `tag` with properties set and children (elements or text) in it. */
export function element(tag, properties = {}, ...children) {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children.filter((child) => child !== null && child !== ""));
  return made;
}

/** Returns the name of a field as words: "contact_growth" -> "contact growth". */
export function words(name) {
  return QUANTITIES[name]?.name ?? name.replaceAll("_", " ");
}

/** Returns a number of bytes as a person reads it. */
export function bytesInWords(bytes) {
  return inWords(bytes, "B", 2);
}

/** Returns the cost of a plan in words: [[what, how much]]. */
export function costInWords(cost) {
  return [
    ["set-up", inWords(cost.setup_seconds, "s", 2)],
    ["a frame", inWords(cost.ns_per_frame * 1e-9, "s", 2)],
    ["speed", `${Number(cost.times_real_time.toPrecision(2))} × real time`],
    ["memory", bytesInWords(cost.memory_bytes)],
    ...(cost.process_seconds ? [["once a process", inWords(cost.process_seconds, "s", 2)]] : []),
  ];
}

/** Returns a relative number in words: 0.0012 -> "0.12 %", 2e-6 -> "2e-6". */
export function shareInWords(share) {
  if (share >= 1e-4) return `${Number((100 * share).toPrecision(2))} %`;
  return share ? share.toExponential(0).replace("-", "−") : "0";
}

/** Shows one plan inside `element`. */
export class PlanView {
  #element;

  constructor(place) {
    this.#element = place;
    place.classList.add("plan");
  }

  /** Shows a plan; numbers a person may follow stand beside each part. */
  show(plan) {
    this.#element.replaceChildren(
      ...plan.warnings.map((warning) => element("p", { className: "plan-warning" }, warning)),
      element("h3", {}, "Simulated"),
      plan.simulated.length
        ? element("ol", {}, ...plan.simulated.map((part) => item(words(part.name), part.reason, priceOf(part))))
        : element("p", {}, "Nothing: there is nothing to feel."),
      element("h3", {}, "Left out"),
      plan.left_out.length
        ? element(
            "ul",
            {},
            ...grouped(plan.left_out).map(({ names, reason, effect }) => item(names.join(", "), reason, effect)),
          )
        : element("p", {}, "Nothing."),
      ...numbers(
        "Estimated error, of peak to peak",
        Object.entries(plan.estimated_error).map(([name, error]) => [words(name), shareInWords(error)]),
      ),
      ...numbers("Contact", contactOf(plan.response)),
      ...(plan.cost ? numbers("Cost on the service’s machine", costInWords(plan.cost)) : []),
      ...numbers("How it is computed", responseOf(plan.response)),
    );
  }
}

function item(name, reason, beside) {
  return element(
    "li",
    {},
    element("strong", {}, name),
    beside ? element("span", { className: "plan-beside" }, beside) : null,
    element("p", {}, reason),
  );
}

function priceOf({ price }) {
  return price ? `${inWords(price.ns_per_frame * 1e-9, "s", 2)} a frame, ${bytesInWords(price.memory_bytes)}` : "";
}

/** Parts that are left out for the same reason stand together. */
function grouped(parts) {
  const groups = new Map();
  for (const { name, reason, effect_on_output: change } of parts) {
    const effect = change === null ? "costs nothing" : `would change ${shareInWords(change)}`;
    const key = `${reason}|${effect}`;
    if (!groups.has(key)) groups.set(key, { names: [], reason, effect });
    groups.get(key).names.push(words(name));
  }
  return [...groups.values()];
}

function numbers(title, rows) {
  if (!rows.length) return [];
  return [
    element("h3", {}, title),
    element("dl", {}, ...rows.flatMap(([name, value]) => [element("dt", {}, name), element("dd", {}, value)])),
  ];
}

/** The contact at the scan's own load; a live session's plan has no such numbers, and a silent scene none of some. */
function contactOf({ stiffness, contact_fraction: touching, rms, sensation_level_db: level }) {
  const known = (value) => value !== undefined && value !== null;
  return [
    ...(known(stiffness) ? [["stiffness", inWords(stiffness, "N/m")]] : []),
    ...(known(touching) ? [["touching", shareInWords(touching)]] : []),
    ...Object.entries(rms ?? {}).map(([name, value]) => [`${words(name)}, rms`, inWords(value, QUANTITIES[name].unit)]),
    ...(known(level) ? [["above the threshold by", `${Math.round(level)} dB`.replace("-", "−")]] : []),
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
