/* The box of a field (label, description, error), the control of a number (a line of text and a slider), and that of
text.

Model: a control has an `element` and `show(value, around)`. It calls `writer.write(path, value, settled)`; undefined
restores the default. `around` has `siblings`, the values of the same object, and `complete`, the default in this scene.
Invalid text stays, with an error message, until it is corrected or the value changes. */

import { make } from "../dom.js";
import { checkNumber, unitBeside } from "./schema_fields.js";
import { same } from "../scene/merge.js";
import { sliderOf } from "./slider_scale.js";
import { showQuantity, siValue, unitIn } from "../scene/units.js";

const STEPS = 1000; // of a slider
const PLACEHOLDER_DIGITS = 5; // of a default; entered text keeps all digits

/** Returns the id of the control of the field at `path`. */
const idOf = (path) => `field-${path.join("-")}`;

/** Returns a field's value as text. */
export function shown(value, field, siblings, digits = 12) {
  if (typeof value === "number") return showQuantity(value, unitBeside(field, siblings), digits);
  return value === null || value === undefined ? "" : String(value);
}

/** Label, description and error message of a field. */
export class FieldBox {
  constructor(field, writer) {
    this.field = field;
    this.writer = writer;
    this.id = idOf(field.path);
    this.hint = make("p.hint", { id: `${this.id}-hint` });
    this.fault = make("p.fault", { id: `${this.id}-fault`, role: "alert", hidden: true });
    this.label = make("label", { for: this.id, text: field.label });
    this.element = make("div.field", { "data-path": field.path.join(".") });
    writer.register(this);
  }

  describe(note = "") {
    this.hint.textContent = [this.field.hint, this.field.unit === null ? "" : rangeIn(this.field), note]
      .filter(Boolean)
      .join(" ");
  }

  /** Shows `sentence` as the error of the field; null: no error. */
  refuse(sentence) {
    this.fault.hidden = !sentence;
    this.fault.textContent = sentence ?? "";
    for (const part of this.element.querySelectorAll(`#${CSS.escape(this.id)}`))
      part.setAttribute("aria-invalid", String(Boolean(sentence)));
  }
}

const rangeIn = (field) =>
  field.alternatives.some(({ kind }) => kind === "number") && field.allowed ? `Range: ${field.allowed}.` : "";

/** A number: text with its unit, and a slider if the range permits one. */
export class NumberControl {
  #held;

  constructor(box) {
    this.box = box;
    const { field, id } = box;
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
    const { box, text } = this;
    if (!text.value.trim()) return this.#write(undefined, true);
    const si = unitBeside(box.field, this.siblings);
    const read = checkNumber(box.field, text.value, si, unitIn(text.defaultValue || text.placeholder, si));
    if (read.fault) return box.refuse(read.fault);
    this.#write(read.value, true);
  }

  #slide(settled) {
    const value = this.slider.value(this.track.value / STEPS);
    this.#write(this.box.field.unit ? showQuantity(value, this.box.field.unit) : value, settled);
  }

  #write(value, settled) {
    this.box.refuse(null);
    this.#held = NaN;
    this.box.writer.write(this.box.field.path, value, settled);
  }

  show(value, { siblings, complete }) {
    const { field } = this.box;
    this.siblings = siblings;
    const si = unitBeside(field, siblings);
    const fallback = complete ?? field.fallback;
    this.text.placeholder = fallback === null ? "not set" : shown(fallback, field, siblings, PLACEHOLDER_DIGITS);
    if (this.track) this.#place(siValue(value ?? fallback, si), si);
    if (same(value, this.#held)) return;
    this.#held = value;
    this.box.refuse(null);
    this.text.value = this.text.defaultValue = shown(value, field, siblings);
  }

  #place(value, si) {
    const known = Number.isFinite(value);
    if (document.activeElement !== this.track) this.track.value = known ? this.slider.place(value) * STEPS : 0;
    this.track.setAttribute("aria-valuetext", known ? showQuantity(value, si, 3) : "not set");
  }
}

/** Text, such as an address. */
export class TextControl {
  constructor(box, { pattern }) {
    const { id, field } = box;
    this.text = make("input", {
      id,
      type: "text",
      autocomplete: "off",
      spellcheck: "false",
      placeholder: "not set",
      "aria-describedby": `${id}-hint ${id}-fault`,
      change: () => {
        const text = this.text.value.trim();
        const allowed = !text || new RegExp(pattern).test(text);
        box.refuse(allowed ? null : `Allowed: ${field.allowed}.`);
        if (allowed) box.writer.write(field.path, text || undefined, true);
      },
    });
    this.element = make("div", {}, this.text);
  }

  show(value) {
    this.text.value = value ?? "";
  }
}
