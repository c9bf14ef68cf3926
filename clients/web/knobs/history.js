/* Undo and redo of scenes.

Limits: the last 200 scenes, kept whole: a scene is a few hundred bytes. */

import { same } from "./merge.js";

const LONGEST = 200; // scenes kept; more only costs memory

/** The scenes that were, the one that is, and those that were undone. */
export class History {
  #past = [];
  #future = [];
  #present;

  /** @param {object} scene the first scene */
  constructor(scene) {
    this.#present = scene;
  }

  /** The scene that is. */
  get present() {
    return this.#present;
  }

  get canUndo() {
    return this.#past.length > 0;
  }

  get canRedo() {
    return this.#future.length > 0;
  }

  /** Take `scene` as the one that is; what was undone is forgotten. An equal scene changes nothing. */
  push(scene) {
    if (same(scene, this.#present)) return;
    this.#past.push(this.#present);
    if (this.#past.length > LONGEST) this.#past.shift();
    this.#present = scene;
    this.#future = [];
  }

  /** Go back by one; returns the scene that is then, or null where there is none. */
  undo() {
    if (!this.canUndo) return null;
    this.#future.push(this.#present);
    this.#present = this.#past.pop();
    return this.#present;
  }

  /** Go forward again by one; returns the scene that is then, or null where there is none. */
  redo() {
    if (!this.canRedo) return null;
    this.#past.push(this.#present);
    this.#present = this.#future.pop();
    return this.#present;
  }
}
