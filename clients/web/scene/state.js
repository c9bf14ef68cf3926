/* The scene of the page. Sliders, form, link, files, undo, views and sound read and change it here.

Model: a scene with values as text with units; fields without a value have their defaults. It begins as START_SCENE.
Settled changes can be undone.
Events: "change" {scene, fixed: it requires a new session, chosen: it is of another texture or another scene, not the
present one with other numbers, settled: false while a slider moves}; "defaults": the service has reported the values of
fields without a value.
Limits: nothing is validated; the service validates the scene. */

import { START_SCENE } from "./start_scene.js";
import { UndoHistory } from "./undo.js";
import { changesWhatIsFixed, copyOf, same, sameTexture, unwritten, withField } from "./merge.js";

export class SceneState extends EventTarget {
  #scene = START_SCENE;
  #defaults = {};
  #history = new UndoHistory(START_SCENE);

  /** A copy of the scene. */
  get scene() {
    return copyOf(this.#scene);
  }

  /** Values of the fields that the scene leaves to their defaults, as far as the service has reported them. */
  get defaults() {
    return this.#defaults;
  }

  get canUndo() {
    return this.#history.canUndo;
  }

  get canRedo() {
    return this.#history.canRedo;
  }

  /** Sets the field at `path`; undefined restores its default. */
  write(path, value, settled = true) {
    this.take(withField(this.#scene, path, value), settled);
  }

  /** Replaces the scene. settled: false while more of the same change follows. other: it is another scene, of a link or
   *  a file. */
  take(scene, settled = true, other = false) {
    const before = this.#scene;
    if (same(before, scene) && !settled) return;
    this.#scene = copyOf(scene);
    if (settled) this.#history.push(this.scene);
    const detail = {
      scene: this.scene,
      fixed: changesWhatIsFixed(before, scene),
      chosen: other || !sameTexture(before, scene),
      settled,
    };
    this.dispatchEvent(new CustomEvent("change", { detail }));
  }

  /** Takes the first scene of the page, before which there is nothing to undo. */
  begin(scene) {
    this.#history = new UndoHistory(copyOf(scene));
    this.take(scene);
  }

  /** Takes the values of defaults from `complete`, the complete scene that the service made of `scene`. */
  setDefaults(scene, complete) {
    this.#defaults = unwritten(complete, scene);
    this.dispatchEvent(new CustomEvent("defaults"));
  }

  /** Undoes the last settled change; returns whether there was one. */
  undo() {
    return this.#go(this.#history.undo());
  }

  redo() {
    return this.#go(this.#history.redo());
  }

  /** Returns the path of `name`, "speed" or "load", in the scan of the scene. */
  scanPath(name) {
    return this.#scene.scan?.stroke ? ["scan", "stroke", name] : ["scan", name];
  }

  /** Returns the value at `path`: that of the scene, its default, or undefined. */
  valueAt(path) {
    const at = (place) => path.reduce((inner, name) => inner?.[name] ?? undefined, place);
    return at(this.#scene) ?? at(this.#defaults);
  }

  /** Whether the scan is a trajectory, which has no single speed or load. */
  get isRecorded() {
    return Boolean(this.#scene.scan?.trajectory);
  }

  #go(scene) {
    if (scene) this.take(scene);
    return Boolean(scene);
  }
}
