/* The control of any field: a number's, or a menu of words and kinds with the controls of the kind that is chosen.

Model: as number.js says. A kind that needs something written first (a number, points) is open before it has a value.
Limits: a value of a kind that the schema does not have shows as the default; the service has refused it before. */

import { make } from "./element.js";
import { alternativeOf, readField, startingValue } from "./fields.js";
import { ListControl, PointsControl } from "./lists.js";
import { same } from "./merge.js";
import { Knob, NumberControl, shown } from "./number.js";

/** The fields of settings, as controls in one group. */
class SettingsControl {
  constructor(knob, { fields }) {
    this.controls = fields.map((field) => [field.name, controlOf(field, knob.writer)]);
    this.element = make(
      "div.settings",
      { role: "group", "aria-label": knob.field.label },
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

/** A field with a menu: words, and the kinds of value that it may also have. */
class ChoiceControl {
  constructor(knob) {
    this.knob = knob;
    const { field, id } = knob;
    this.choices = choicesOf(field, knob.writer.schema);
    this.bodies = field.alternatives
      .filter(({ kind }) => kind !== "words")
      .map((alternative) => ({ alternative, control: bodyOf(knob, alternative) }));
    this.menu = make(
      "select",
      {
        id: this.bodies.some(({ control }) => control.text?.id === id) ? `${id}-kind` : id,
        "aria-describedby": `${id}-hint ${id}-fault`,
        change: () => this.#choose(),
      },
      ...this.choices.map(({ label }, index) => make("option", { value: index, text: label })),
    );
    knob.label.htmlFor = this.menu.id;
    this.element = make(
      "div.choice",
      {},
      this.menu,
      knob.hint,
      knob.fault,
      ...this.bodies.map(({ control }) => control.element),
    );
    for (const { text } of this.bodies.map(({ control }) => control)) {
      text?.setAttribute("aria-label", text.getAttribute("aria-label") ?? `${field.label}, value`);
    }
  }

  #choose() {
    const { value, begin, alternative } = this.choices[this.menu.value];
    if (begin === "draft") return this.#open(alternative);
    this.knob.writer.write(this.knob.field.path, begin ? begin() : value, true);
  }

  #open(alternative) {
    this.draft = alternative;
    for (const body of this.bodies) body.control.element.hidden = body.alternative !== alternative;
    this.bodies.find((body) => body.alternative === alternative).control.text?.focus();
  }

  show(value, around) {
    const { field } = this.knob;
    const written = value === undefined || value === null ? null : alternativeOf(field, value);
    if (written || !same(value ?? null, this.held ?? null)) this.draft = null;
    this.held = value;
    const chosen = written ?? this.draft ?? null;
    const index = this.choices.findIndex((choice) =>
      chosen?.kind === "words" ? same(choice.value, value) : choice.alternative === (chosen ?? undefined),
    );
    this.menu.value = String(Math.max(0, index));
    if (field.fallback !== null && typeof field.fallback !== "object") {
      const { complete, siblings } = around;
      const told = complete === undefined || typeof complete === "object" ? field.fallback : complete;
      this.menu.options[0].textContent = `default (${shown(told, field, siblings)})`;
    }
    for (const { alternative, control } of this.bodies) {
      control.element.hidden = alternative !== chosen;
      control.show(alternative === chosen ? value : undefined, around);
    }
  }
}

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
      const item = () => startingValue(readField(alternative.items, root));
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
  text: NumberControl,
};

const bodyOf = (knob, alternative) => new KINDS[alternative.kind](knob, alternative, controlOf);

/** The control of `field` that writes with `writer` (`write`, `register`, `forget`, `schema`). */
export function controlOf(field, writer) {
  const knob = new Knob(field, writer);
  const single = field.alternatives.length === 1 && ["number", "text"].includes(field.alternatives[0].kind);
  const control = single ? new NumberControl(knob) : new ChoiceControl(knob);
  knob.describe();
  knob.element.append(knob.label, control.element, ...(single ? [knob.hint, knob.fault] : []));
  return {
    element: knob.element,
    show: (value, around) => {
      knob.describe(knob.writer.note?.(field.path) ?? "");
      control.show(value, around);
    },
  };
}
