/* A form for all fields of a scene, made from its JSON Schema. Each section of the scene can be opened and closed.

Model: the form shows the scene of a SceneState and writes to it; it has no scene of its own. A field that needs another
kind of finger or texture is hidden, unless the scene has it. A section names those of its hidden fields that need
something of another section.
Limits: the form checks single fields only. `refuse` shows errors of the service beside the fields. */

import { controlOf } from "./field_control.js";
import { make } from "../dom.js";
import { readField } from "./schema_fields.js";
import { displaced, same } from "../scene/merge.js";

const MOST_NAMED = 3; // values in "Only with"; if more are possible, "Not with" names the present value

export class Form {
  #boxes = new Map();
  #refused = new Set();
  #sections = [];

  /**
   * @param {HTMLElement} element receives the sections
   * @param {object} schema the JSON Schema of a scene
   * @param {SceneState} state
   */
  constructor(element, schema, state) {
    Object.assign(this, { element, schema, state });
    for (const [name, part] of Object.entries(schema.properties)) this.#sections.push(this.#section(name, part));
    for (const kind of ["change", "defaults"]) state.addEventListener(kind, () => this.#show());
    this.#show();
  }

  /** For the controls: sets the field at `path`; undefined restores its default. */
  write(path, value, settled = true) {
    this.state.write(path, value, settled);
  }

  /**
   * Shows errors of the service beside the fields and removes earlier ones.
   * @param {{pointer: string, allowed: string, hint: string}[]} errors of a problem document
   */
  refuse(errors) {
    for (const box of this.#refused) box.refuse(null);
    this.#refused.clear();
    for (const { pointer, allowed, hint } of errors) {
      const steps = pointer
        .split("/")
        .slice(1)
        .map((step) => step.replaceAll("~1", "/").replaceAll("~0", "~"));
      while (steps.length && !this.#boxes.has(steps.join("."))) steps.pop();
      const box = this.#boxes.get(steps.join("."));
      if (!box) continue;
      this.#refused.add(box);
      box.refuse(`Allowed: ${allowed}. ${hint}`);
      box.element.closest("details").open = true;
    }
  }

  /** Opens or closes all sections. */
  set open(open) {
    for (const { details } of this.#sections) details.open = open;
  }

  /** Puts the sections and fields that the scene sets before the others. */
  setFirst() {
    const { scene } = this.state;
    const isSet = ({ name }) => Object.values(scene[name] ?? {}).some((value) => value !== null);
    const order = (list, first) => [...list.filter(first), ...list.filter((one) => !first(one))];
    this.element.append(...order(this.#sections, isSet).map(({ details }) => details));
    for (const { fields, controls } of this.#sections)
      fields.append(...order(controls, ({ field }) => isWritten(scene, field)).map(({ control }) => control.element));
  }

  /** Shows only fields with all words of `text` in their name or description, in open sections; "" shows all. */
  search(text) {
    const words = text.toLowerCase().split(/\s+/).filter(Boolean);
    for (const { name, details, controls } of this.#sections) {
      let found = 0;
      for (const { field, control } of controls) {
        const told = `${name} ${field.name} ${field.label} ${field.hint}`.toLowerCase();
        const fits = words.every((word) => told.includes(word));
        control.element.toggleAttribute("data-unfound", !fits);
        if (fits && !control.element.hidden) found++;
      }
      details.toggleAttribute("data-unfound", !found);
      if (words.length && found) details.open = true;
    }
  }

  /** For the controls: adds a FieldBox, or removes that of a path. */
  register(box) {
    this.#boxes.set(box.field.path.join("."), box);
  }

  forget(path) {
    this.#boxes.delete(path);
  }

  /** For the controls: returns the fields of the scene that setting the field at `path` removes, and the fields of
   *  other sections that need one of its values, as sentences; "" for none. */
  note(path) {
    const [section, name] = path;
    if (path.length !== 2 || (section === "texture" && name === "kind")) return "";
    const { scene } = this.state;
    const gone = displaced(section, scene[section] ?? {}, name, undefined).filter((other) => other !== name);
    const replaces = gone.length ? [`Replaces ${gone.join(" and ").replaceAll("_", " ")}.`] : [];
    return [...replaces, ...this.#neededBy(scene, path)].join(" ");
  }

  #neededBy(scene, path) {
    const others = this.#sections.filter(({ name }) => name !== path[0]).flatMap(({ controls }) => controls);
    const written = others.map(({ field }) => field).filter((field) => isWritten(scene, field));
    return written.flatMap(({ label, needs }) => {
      const values = needs.find((need) => same(need.path, path))?.values;
      return values ? [`${label} needs ${either(values)}.`] : [];
    });
  }

  #section(name, part) {
    const field = readField(part, this.schema, [name]);
    const settings = field.alternatives.filter(({ kind }) => kind === "settings");
    const count = make("span.count");
    const absent = make("p.hint", { id: `section-${name}-absent`, hidden: true });
    const details = make(
      "details.section",
      { id: `section-${name}` },
      make("summary", {}, make("h3", { text: field.label }), count),
      make("p.hint", { text: field.hint }),
      absent,
    );
    const shown = settings.length === 1 ? settings[0].fields : [field];
    const controls = shown.map((one) => ({ field: one, control: controlOf(one, this) }));
    const fields = make("div.fields", {}, ...controls.map(({ control }) => control.element));
    details.append(fields);
    this.element.append(details);
    return { name, details, fields, controls, count, absent };
  }

  /** Returns the needs of `field` that `scene` does not meet. A field that is in the scene has no unmet needs, so
   *  that it can be removed. */
  #lacks(scene, field) {
    if (isWritten(scene, field)) return [];
    return field.needs.filter(({ path, values }) => !values.includes(this.#present(path)));
  }

  #present(path) {
    return this.state.valueAt(path) ?? this.#boxes.get(path.join("."))?.field.fallback;
  }

  #hide(scene, { name, controls, absent }) {
    const elsewhere = new Map(); // need of a value in another section, in words -> labels of the fields with that need
    for (const { field, control } of controls) {
      const lacks = this.#lacks(scene, field);
      control.element.hidden = lacks.length > 0;
      for (const { path, values } of lacks.filter(({ path }) => path[0] !== name)) {
        const only =
          values.length > MOST_NAMED
            ? `Not with ${words(path)} ${this.#present(path)}`
            : `Only with ${words(path)} ${either(values)}`;
        elsewhere.set(only, [...(elsewhere.get(only) ?? []), field.label]);
      }
    }
    absent.textContent = [...elsewhere].map(([only, labels]) => `${only}: ${labels.join(", ")}.`).join(" ");
    absent.hidden = !absent.textContent;
  }

  #show() {
    const { scene, defaults } = this.state;
    for (const section of this.#sections) {
      const { name, controls, count } = section;
      const siblings = scene[name] ?? {};
      const complete = defaults[name] ?? {};
      for (const { field, control } of controls) {
        if (field.path.length === 1) control.show(scene[name], { siblings: {}, complete: defaults[name] });
        else
          control.show(siblings[field.name] ?? undefined, {
            siblings: { ...complete, ...siblings },
            complete: complete[field.name],
          });
      }
      this.#hide(scene, section);
      const written = Object.values(siblings).filter((value) => value !== null).length;
      count.textContent = written ? `${written} set` : "";
    }
  }
}

const isWritten = (scene, { path }) => (path.reduce((inner, name) => inner?.[name], scene) ?? null) !== null;

const words = (path) => path.join(" ").replaceAll("_", " ");

const either = (values) => values.join(" or ");
