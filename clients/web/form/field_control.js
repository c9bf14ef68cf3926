/* The control of any field: a number, or a menu of words and kinds with the control of the chosen kind.

Model: see number_control.js. If a number or points are chosen in the menu, their control opens before it has a value.
Limits: a value of a kind that is not in the schema is shown as the default. */

import { make } from "../dom.js";
import { alternativeOf, readField, startingValue } from "./schema_fields.js";
import { ListControl, PointsControl } from "./list_control.js";
import { same } from "../scene/merge.js";
import { FieldBox, NumberControl, TextControl, shown } from "./number_control.js";

/** The controls of the fields of an object. */
class SettingsControl {
  constructor(box, { fields }) {
    this.controls = fields.map((field) => [field.name, controlOf(field, box.writer)]);
    this.element = make(
      "div.settings",
      { role: "group", "aria-label": box.field.label },
      ...this.controls.map(([, control]) => control.element),
    );
  }

  show(value, { complete }) {
    const siblings = typeof value === "object" && value !== null ? value : {};
    const whole = typeof complete === "object" && complete !== null ? complete : {};
    for (const [name, control] of this.controls)
      control.show(siblings[name], { siblings: { ...whole, ...siblings }, complete: whole[name] });
  }
}

/** A menu of words and of other kinds of value. */
class ChoiceControl {
  constructor(box) {
    this.box = box;
    const { field, id } = box;
    this.choices = choicesOf(field, box.writer.schema);
    this.bodies = field.alternatives
      .filter(({ kind }) => kind !== "words")
      .map((alternative) => ({ alternative, control: bodyOf(box, alternative) }));
    this.menu = make(
      "select",
      {
        id: this.bodies.some(({ control }) => control.text?.id === id) ? `${id}-kind` : id,
        "aria-describedby": `${id}-hint ${id}-fault`,
        change: () => this.#choose(),
      },
      ...this.choices.map(({ label }, index) => make("option", { value: index, text: label })),
    );
    box.label.htmlFor = this.menu.id;
    this.element = make(
      "div.choice",
      {},
      this.menu,
      box.hint,
      box.fault,
      ...this.bodies.map(({ control }) => control.element),
    );
    for (const { text } of this.bodies.map(({ control }) => control)) {
      text?.setAttribute("aria-label", text.getAttribute("aria-label") ?? `${field.label}, value`);
    }
  }

  #choose() {
    const { value, begin, alternative } = this.choices[this.menu.value];
    if (begin === "draft") return this.#open(alternative);
    this.box.writer.write(this.box.field.path, begin ? begin() : value, true);
  }

  #open(alternative) {
    this.draft = alternative;
    for (const body of this.bodies) body.control.element.hidden = body.alternative !== alternative;
    this.bodies.find((body) => body.alternative === alternative).control.text?.focus();
  }

  show(value, around) {
    const { field } = this.box;
    const written = value === undefined || value === null ? null : alternativeOf(field, value);
    if (written || !same(value ?? null, this.held ?? null)) this.draft = null;
    this.held = value;
    const chosen = written ?? this.draft ?? null;
    const index = this.choices.findIndex((choice) =>
      chosen?.kind === "words" ? same(choice.value, value) : choice.alternative === (chosen ?? undefined),
    );
    this.menu.value = String(Math.max(0, index));
    const told = [around.complete, field.fallback].find((one) => isSingle(one));
    this.menu.options[0].textContent =
      told === undefined ? this.choices[0].label : `default (${shown(told, field, around.siblings)})`;
    for (const { alternative, control } of this.bodies) {
      control.element.hidden = alternative !== chosen;
      control.show(alternative === chosen ? value : undefined, around);
    }
  }
}

const isSingle = (value) => value !== null && value !== undefined && typeof value !== "object";

function choicesOf(field, root) {
  const absent = field.alternatives.some(({ kind }) => kind === "settings") ? "off" : "none";
  const choices = [{ label: field.fallback !== null ? "default" : absent, value: undefined }];
  for (const alternative of field.alternatives) {
    if (alternative.kind === "words")
      choices.push(...alternative.words.map((word) => ({ label: String(word), value: word })));
    if (alternative.kind === "number") choices.push({ label: "a number", alternative, begin: "draft" });
    if (alternative.kind === "points") choices.push({ label: "points", alternative, begin: "draft" });
    if (alternative.kind === "list") {
      const size = Math.max(1, alternative.minimum);
      const item = () => startingValue(readField(alternative.items, root), root);
      choices.push({ label: "a list", alternative, begin: () => Array.from({ length: size }, item) });
    }
    if (alternative.kind === "settings")
      choices.push({
        label: alternative.tag?.[1] ?? "on, with settings",
        alternative,
        begin: () => (alternative.tag ? Object.fromEntries([alternative.tag]) : {}),
      });
  }
  return choices;
}

const KINDS = {
  number: NumberControl,
  points: PointsControl,
  list: ListControl,
  settings: SettingsControl,
  text: TextControl,
};

const bodyOf = (box, alternative) => new KINDS[alternative.kind](box, alternative, controlOf);

/** Returns the control of `field`. writer: the Form. */
export function controlOf(field, writer) {
  const box = new FieldBox(field, writer);
  const [only] = field.alternatives;
  const single = field.alternatives.length === 1 && ["number", "text"].includes(only.kind);
  const control = single ? new KINDS[only.kind](box, only) : new ChoiceControl(box);
  box.describe();
  box.element.append(box.label, control.element, ...(single ? [box.hint, box.fault] : []));
  return {
    element: box.element,
    show: (value, around) => {
      box.describe(box.writer.note?.(field.path) ?? "");
      control.show(value, around);
    },
  };
}
