/* Undo and redo of the last 200 scenes. */

import { same } from "./merge.js";

const LONGEST = 200; // scenes; each has a few hundred bytes

export class UndoHistory {
  #past = [];
  #future = [];
  #present;

  /** @param {object} scene the first scene */
  constructor(scene) {
    this.#present = scene;
  }

  get canUndo() {
    return this.#past.length > 0;
  }

  get canRedo() {
    return this.#future.length > 0;
  }

  /** Makes `scene` the present scene and clears redo. An equal scene has no effect. */
  push(scene) {
    if (same(scene, this.#present)) return;
    this.#past.push(this.#present);
    if (this.#past.length > LONGEST) this.#past.shift();
    this.#present = scene;
    this.#future = [];
  }

  /** Returns the previous scene, which is then the present one; null if there is none. */
  undo() {
    if (!this.canUndo) return null;
    this.#future.push(this.#present);
    this.#present = this.#past.pop();
    return this.#present;
  }

  /** Returns the scene that was undone, which is then the present one; null if there is none. */
  redo() {
    if (!this.canRedo) return null;
    this.#past.push(this.#present);
    this.#present = this.#future.pop();
    return this.#present;
  }
}
