/* The scene of the page, in one place: sliders, knobs, link, files, undo, pictures and sound read and change it here.

Model: a scene as it is written, with units as text; a field without a value has its default. What was settled can be
undone. Events: "change" {scene, partial, fixed: it needs a new session, settled: false while a slider moves};
"learn": the service told what stands where nothing is written.
Limits: nothing is checked; the service reads the scene. */

import { History } from "./history.js";
import { changesWhatIsFixed, partBetween, same, unwritten, withField } from "./merge.js";

export class SceneState extends EventTarget {
  #scene = {};
  #unwritten = {};
  #history = new History({});

  /** The scene as it is written. */
  get scene() {
    return structuredClone(this.#scene);
  }

  /** What stands where nothing is written, as far as the service has told. */
  get unwritten() {
    return this.#unwritten;
  }

  get canUndo() {
    return this.#history.canUndo;
  }

  get canRedo() {
    return this.#history.canRedo;
  }

  /** Change the scene by setting the field at `path`; undefined is its default. */
  write(path, value, settled = true) {
    this.take(withField(this.#scene, path, value), settled);
  }

  /** Take `scene`, changed as a whole. settled: false while more of the same change follows. */
  take(scene, settled = true) {
    const before = this.#scene;
    if (same(before, scene) && !settled) return;
    this.#scene = structuredClone(scene);
    if (settled) this.#history.push(this.scene);
    const detail = {
      scene: this.scene,
      partial: partBetween(before, scene),
      fixed: changesWhatIsFixed(before, scene),
      settled,
    };
    this.dispatchEvent(new CustomEvent("change", { detail }));
  }

  /** Learn from `complete`, the complete scene that the service made of `scene`, what stands where nothing is written. */
  learn(scene, complete) {
    this.#unwritten = unwritten(complete, scene);
    this.dispatchEvent(new CustomEvent("learn"));
  }

  /** Go back, or forward again, by one settled change; returns whether there was one. */
  undo() {
    return this.#go(this.#history.undo());
  }

  redo() {
    return this.#go(this.#history.redo());
  }

  /** The path of `name`, "speed" or "load", in the scan that the scene has. */
  scanPath(name) {
    return this.#scene.scan?.stroke ? ["scan", "stroke", name] : ["scan", name];
  }

  /** What the scene holds at `path`: what is written, what stands where nothing is, or undefined. */
  valueAt(path) {
    const at = (place) => path.reduce((inner, name) => inner?.[name] ?? undefined, place);
    return at(this.#scene) ?? at(this.#unwritten);
  }

  /** Whether the scan is one of recorded points, which have neither one speed nor one load. */
  get isRecorded() {
    return Boolean(this.#scene.scan?.trajectory);
  }

  #go(scene) {
    if (scene) this.take(scene);
    return Boolean(scene);
  }
}
