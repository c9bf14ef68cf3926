/* A form for all fields of a scene, made from its JSON Schema. Each section of the scene can be opened and closed.

Model: the form shows the scene of a SceneState and writes to it; it has no scene of its own.
Limits: the form checks single fields only. `refuse` shows errors of the service beside the fields. */

import { controlOf } from "./field_control.js";
import { make } from "../dom.js";
import { readField } from "./schema_fields.js";
import { displaced } from "../scene/merge.js";

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

  /** For the controls: adds a FieldBox, or removes that of a path. */
  register(box) {
    this.#boxes.set(box.field.path.join("."), box);
  }

  forget(path) {
    this.#boxes.delete(path);
  }

  /** For the controls: returns which fields of the scene setting the field at `path` removes, a sentence or "". */
  note(path) {
    const [section, name] = path;
    if (path.length !== 2 || (section === "texture" && name === "kind")) return "";
    const gone = displaced(section, this.state.scene[section] ?? {}, name, undefined).filter((other) => other !== name);
    return gone.length ? `Replaces ${gone.join(" and ").replaceAll("_", " ")}.` : "";
  }

  #section(name, part) {
    const field = readField(part, this.schema, [name]);
    const settings = field.alternatives.filter(({ kind }) => kind === "settings");
    const count = make("span.count");
    const details = make(
      "details.section",
      { id: `section-${name}` },
      make("summary", {}, make("h3", { text: field.label }), count),
      make("p.hint", { text: field.hint }),
    );
    const controls =
      settings.length === 1
        ? settings[0].fields.map((one) => [one.name, controlOf(one, this)])
        : [[null, controlOf(field, this)]];
    details.append(make("div.fields", {}, ...controls.map(([, control]) => control.element)));
    this.element.append(details);
    return { name, details, controls, count };
  }

  #show() {
    const { scene, defaults } = this.state;
    for (const { name, controls, count } of this.#sections) {
      const siblings = scene[name] ?? {};
      const complete = defaults[name] ?? {};
      for (const [field, control] of controls) {
        if (field === null) control.show(scene[name], { siblings: {}, complete: defaults[name] });
        else
          control.show(siblings[field] ?? undefined, {
            siblings: { ...complete, ...siblings },
            complete: complete[field],
          });
      }
      const written = Object.values(siblings).filter((value) => value !== null).length;
      count.textContent = written ? `${written} set` : "";
    }
  }
}
