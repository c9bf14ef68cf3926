/* The knobs of a scene: a form made from the scene's JSON Schema, a section a part of the scene.

Model: the form shows the scene of a SceneState and writes to it; it holds none of its own. A change displaces what it
displaces at the service (merge.js).
Limits: what one field alone cannot know (a stroke without room for its turns) is refused by the service, whose answer
`refuse` puts beside the field. */

import { controlOf } from "./controls.js";
import { make } from "./element.js";
import { readField } from "./fields.js";
import { displaced } from "./merge.js";

export class Form {
  #knobs = new Map();
  #refused = new Set();
  #sections = [];

  /**
   * @param {HTMLElement} element that the sections go into
   * @param {object} schema the JSON Schema of a scene
   * @param {SceneState} state what is shown and written to
   */
  constructor(element, schema, state) {
    Object.assign(this, { element, schema, state });
    for (const [name, part] of Object.entries(schema.properties)) this.#sections.push(this.#section(name, part));
    for (const kind of ["change", "learn"]) state.addEventListener(kind, () => this.#show());
    this.#show();
  }

  /** Used by the controls: set the field at `path`; undefined is its default. */
  write(path, value, settled = true) {
    this.state.write(path, value, settled);
  }

  /**
   * Tell beside the fields what the service refuses, in place of what it refused before; an empty list: nothing.
   * @param {{pointer: string, allowed: string, hint: string}[]} errors of a problem document
   */
  refuse(errors) {
    for (const knob of this.#refused) knob.refuse(null);
    this.#refused.clear();
    for (const { pointer, allowed, hint } of errors) {
      const steps = pointer
        .split("/")
        .slice(1)
        .map((step) => step.replaceAll("~1", "/").replaceAll("~0", "~"));
      while (steps.length && !this.#knobs.has(steps.join("."))) steps.pop();
      const knob = this.#knobs.get(steps.join("."));
      if (!knob) continue;
      this.#refused.add(knob);
      knob.refuse(`Allowed: ${allowed}. ${hint}`);
      knob.element.closest("details").open = true;
    }
  }

  /** Open or close all sections. */
  set open(open) {
    for (const { details } of this.#sections) details.open = open;
  }

  /** Used by the controls: the knob of a path is there, or gone. */
  register(knob) {
    this.#knobs.set(knob.field.path.join("."), knob);
  }

  forget(path) {
    this.#knobs.delete(path);
  }

  /** Used by the controls: what writing the field at `path` would take out of the scene, a sentence. */
  note(path) {
    const [section, name] = path;
    if (path.length !== 2 || (section === "texture" && name === "kind")) return "";
    const gone = displaced(section, this.state.scene[section] ?? {}, name, undefined).filter((other) => other !== name);
    return gone.length ? `Writing it replaces ${gone.join(" and ").replaceAll("_", " ")}.` : "";
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
    const { scene, unwritten } = this.state;
    for (const { name, controls, count } of this.#sections) {
      const siblings = scene[name] ?? {};
      const complete = unwritten[name] ?? {};
      for (const [field, control] of controls) {
        if (field === null) control.show(scene[name], { siblings: {}, complete: unwritten[name] });
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
