/* The controls of lists: rows of numbers as text, a line each; and items, each with controls of its own.

Limits: items are told apart by their place: taking one out moves those behind it up. */

import { make } from "./element.js";
import { checkPoints, readField, startingValue } from "./fields.js";
import { same } from "./merge.js";

/** Points: a line each. */
export class PointsControl {
  #held;

  constructor(knob, points) {
    const { id, field } = knob;
    this.knob = knob;
    this.text = make("textarea", {
      id: `${id}-points`,
      rows: 5,
      spellcheck: "false",
      "aria-label": `${field.label}: a line a point`,
      "aria-describedby": `${id}-hint ${id}-fault`,
      change: () => {
        const read = checkPoints(points, this.text.value);
        knob.refuse(read.fault ?? null);
        if (!read.fault) knob.writer.write(field.path, read.value, true);
      },
    });
    this.element = make("div", {}, this.text);
  }

  show(value) {
    if (same(value, this.#held)) return;
    this.#held = value;
    this.text.value = (value ?? []).map((row) => row.join(", ")).join("\n");
  }
}

/** A list of items; `build(field, writer)` makes the control of one. */
export class ListControl {
  #items = [];

  constructor(knob, list, build) {
    Object.assign(this, { knob, list, build });
    this.rows = make("div.rows");
    this.more = make("button", {
      type: "button",
      text: "Add one",
      click: () => this.#write([...this.value, startingValue(readField(list.items, knob.writer.schema))]),
    });
    this.element = make("div", { role: "group", "aria-label": knob.field.label }, this.rows, this.more);
  }

  #write(value) {
    this.knob.writer.write(this.knob.field.path, value, true);
  }

  show(value, { complete }) {
    this.value = value ?? [];
    while (this.#items.length > this.value.length) this.#remove();
    while (this.#items.length < this.value.length) this.#add();
    this.more.disabled = this.value.length >= this.list.maximum;
    this.#items.forEach(({ control, drop }, index) => {
      drop.disabled = this.value.length <= this.list.minimum;
      control.show(this.value[index], { siblings: {}, complete: complete?.[index] });
    });
  }

  #add() {
    const index = this.#items.length;
    const field = readField(this.list.items, this.knob.writer.schema, [...this.knob.field.path, index]);
    field.label = `${this.knob.field.label}, ${index + 1}`;
    const control = this.build(field, this.knob.writer);
    const drop = make("button.drop", {
      type: "button",
      text: "Remove",
      "aria-label": `Remove ${field.label}`,
      click: () => this.#write(this.value.filter((_, other) => other !== index)),
    });
    const row = make("div.row", {}, control.element, drop);
    this.rows.append(row);
    this.#items.push({ control, drop, row });
  }

  #remove() {
    const { row } = this.#items.pop();
    for (const part of row.querySelectorAll("[data-path]")) this.knob.writer.forget(part.dataset.path);
    row.remove();
  }
}
