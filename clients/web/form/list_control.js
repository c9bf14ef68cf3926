/* The controls of lists: points as lines of text, and items with controls of their own. */

import { make } from "../dom.js";
import { checkPoints, readField, startingValue } from "./schema_fields.js";
import { same } from "../scene/merge.js";

/** Points: a line for each. */
export class PointsControl {
  #held;

  constructor(box, points) {
    const { id, field } = box;
    this.box = box;
    this.text = make("textarea", {
      id: `${id}-points`,
      rows: 5,
      spellcheck: "false",
      "aria-label": `${field.label}, one point per line`,
      "aria-describedby": `${id}-hint ${id}-fault`,
      change: () => {
        const read = checkPoints(points, this.text.value);
        box.refuse(read.fault ?? null);
        if (!read.fault) box.writer.write(field.path, read.value, true);
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

/** A list of items. build(field, writer): returns the control of an item. */
export class ListControl {
  #items = [];

  constructor(box, list, build) {
    Object.assign(this, { box, list, build });
    this.rows = make("div.rows");
    this.more = make("button", {
      type: "button",
      text: "Add",
      click: () => {
        const { schema } = box.writer;
        this.#write([...this.value, startingValue(readField(list.items, schema), schema)]);
      },
    });
    this.element = make("div", { role: "group", "aria-label": box.field.label }, this.rows, this.more);
  }

  #write(value) {
    this.box.writer.write(this.box.field.path, value, true);
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
    const field = readField(this.list.items, this.box.writer.schema, [...this.box.field.path, index]);
    field.label = `${this.box.field.label}, ${index + 1}`;
    const control = this.build(field, this.box.writer);
    const drop = make("button.drop", {
      type: "button",
      text: "Remove",
      "aria-label": `Remove ${field.label}`,
      click: () => {
        this.#write(this.value.filter((_, other) => other !== index));
        const next = this.#items[Math.min(index, this.#items.length - 1)]?.drop; // the button with the focus may be gone
        (next && !next.disabled ? next : this.more).focus();
      },
    });
    const row = make("div.row", {}, control.element, drop);
    this.rows.append(row);
    this.#items.push({ control, drop, row });
  }

  #remove() {
    const { row } = this.#items.pop();
    for (const part of row.querySelectorAll("[data-path]")) this.box.writer.forget(part.dataset.path);
    row.remove();
  }
}
