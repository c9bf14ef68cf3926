/* The frame of a knob (label, what it is for, what is wrong), and the line of text and the slider of a number.

Model: a control has an `element` and `show(value, around)`; it writes with `writer.write(path, value, settled)`, a
value of undefined being the default. `around` has what lies beside it: `siblings`, and `complete`, the value that the
service takes where nothing is written.
Limits: text that is refused stays, with the sentence what to write, until it is mended or the value changes. */

import { make } from "./element.js";
import { checkNumber, unitBeside } from "./fields.js";
import { same } from "./merge.js";
import { sliderOf } from "./slider.js";
import { showQuantity, siValue, unitIn } from "./units.js";

const STEPS = 1000; // of a slider
const PLACEHOLDER_DIGITS = 5; // of a default; what is written keeps all of its digits

/** The id that labels, hints and tests know the control of the field at `path` by. */
export const idOf = (path) => `knob-${path.join("-")}`;

/** What a field's value looks like in words. */
export function shown(value, field, siblings, digits = 12) {
  if (typeof value === "number") return showQuantity(value, unitBeside(field, siblings), digits);
  return value === null || value === undefined ? "" : String(value);
}

/** The frame that each control stands in: label, what it is for, and a place for what is wrong. */
export class Knob {
  constructor(field, writer) {
    this.field = field;
    this.writer = writer;
    this.id = idOf(field.path);
    this.hint = make("p.hint", { id: `${this.id}-hint` });
    this.fault = make("p.fault", { id: `${this.id}-fault`, role: "alert", hidden: true });
    this.label = make("label", { for: this.id, text: field.label });
    this.element = make("div.knob", { "data-path": field.path.join(".") });
    writer.register(this);
  }

  describe(note = "") {
    this.hint.textContent = [this.field.hint, this.field.unit === null ? "" : rangeIn(this.field), note]
      .filter(Boolean)
      .join(" ");
  }

  /** Tell what is wrong with the field, a sentence; null: nothing is. */
  refuse(sentence) {
    this.fault.hidden = !sentence;
    this.fault.textContent = sentence ?? "";
    for (const part of this.element.querySelectorAll(`#${CSS.escape(this.id)}`))
      part.setAttribute("aria-invalid", String(Boolean(sentence)));
  }
}

const rangeIn = (field) =>
  field.alternatives.some(({ kind }) => kind === "number") && field.allowed ? `Range: ${field.allowed}.` : "";

/** A number: text with its unit, and a slider where the range allows one. */
export class NumberControl {
  #held;

  constructor(knob) {
    this.knob = knob;
    const { field, id } = knob;
    this.range = field.alternatives.find(({ kind }) => kind === "number");
    this.slider = field.unit === null ? null : sliderOf(this.range, !field.unit);
    this.text = make("input", {
      id,
      type: "text",
      autocomplete: "off",
      spellcheck: "false",
      enterkeyhint: "done",
      "aria-describedby": `${id}-hint ${id}-fault`,
      change: () => this.#read(),
    });
    this.element = make("div.number", {}, this.text);
    if (!this.slider) return;
    this.track = make("input", {
      type: "range",
      min: 0,
      max: STEPS,
      step: 1,
      "aria-label": `${field.label}, slider`,
      input: () => this.#slide(false),
      change: () => this.#slide(true),
    });
    this.element.append(this.track);
  }

  #read() {
    const { knob, text } = this;
    if (!text.value.trim()) return this.#write(undefined, true);
    const si = unitBeside(knob.field, this.siblings);
    const read = checkNumber(knob.field, text.value, si, unitIn(text.defaultValue || text.placeholder, si));
    if (read.fault) return knob.refuse(read.fault);
    this.#write(read.value, true);
  }

  #slide(settled) {
    const value = this.slider.value(this.track.value / STEPS);
    this.#write(this.knob.field.unit ? showQuantity(value, this.knob.field.unit) : value, settled);
  }

  #write(value, settled) {
    this.knob.refuse(null);
    this.#held = NaN;
    this.knob.writer.write(this.knob.field.path, value, settled);
  }

  show(value, { siblings, complete }) {
    const { field } = this.knob;
    this.siblings = siblings;
    const si = unitBeside(field, siblings);
    const fallback = complete ?? field.fallback;
    this.text.placeholder = fallback === null ? "not set" : shown(fallback, field, siblings, PLACEHOLDER_DIGITS);
    if (this.track) this.#place(siValue(value ?? fallback, si), si);
    if (same(value, this.#held)) return;
    this.#held = value;
    this.knob.refuse(null);
    this.text.value = this.text.defaultValue = shown(value, field, siblings);
  }

  #place(value, si) {
    const known = Number.isFinite(value);
    if (document.activeElement !== this.track) this.track.value = known ? this.slider.place(value) * STEPS : 0;
    this.track.setAttribute("aria-valuetext", known ? showQuantity(value, si, 3) : "not set");
  }
}
