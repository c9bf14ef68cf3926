/* Strokes with the keyboard: a button for each swatch, on which arrow keys move a fingertip.

Model: left and right stroke at SPEED while they are held, from the middle of the swatch. Up and down change the load. A
stroke ends at the end of the swatch or when the key is released. The fingertip comes near a swatch when its button has
had the focus for REST: the streams of swatches that the focus only passes are not opened. */

import { LENGTH, WIDTH } from "./table_layout.js";
import { MOST_LOAD, STIFFNESS, depthOf } from "./contact_model.js";

const SPEED = 0.08; // m/s, default of a scene
const HOVER = 0.006; // m over the swatch without a touch
const AWAY = 0.06; // m over the swatch, too far for a stream
const REST = 0.3; // s; a person who presses Tab again and again is faster
const [FIRST_LOAD, LOAD_STEP] = [0.3, 0.1]; // N
const EDGE = 1e-3; // m from an end of the swatch where a stroke stops

export class KeyboardStrokes {
  /**
   * @param {HTMLElement} list receives the buttons
   * @param {{name: string, title: string, words: string}[]} swatches
   * @param {{x: number, z: number}[]} places centres of the swatches (m)
   * @param {() => void} onChange
   */
  constructor(list, swatches, places, onChange) {
    Object.assign(this, { list, places, onChange, stiffness: STIFFNESS });
    this.index = null;
    this.along = 0;
    this.load = FIRST_LOAD;
    this.direction = 0;
    this.rested = 0; // s since the focus came
    this.buttons = swatches.map((swatch, index) => this.#button(list, swatch, index));
    window.addEventListener("blur", () => this.#stop());
  }

  /** Adds the button of a further swatch, whose place is in the places already. */
  add(swatch) {
    this.buttons.push(this.#button(this.list, swatch, this.buttons.length));
  }

  #button(list, { title, words }, index) {
    const button = document.createElement("button");
    button.type = "button";
    const [name, detail] = [document.createElement("strong"), document.createElement("span")];
    name.textContent = title;
    detail.textContent = words;
    button.append(name, detail);
    button.setAttribute("aria-keyshortcuts", "ArrowLeft ArrowRight ArrowUp ArrowDown");
    button.addEventListener("focus", () => this.#focus(index));
    button.addEventListener("blur", () => this.#focus(null));
    button.addEventListener("keydown", (event) => this.#down(event));
    button.addEventListener("keyup", (event) => this.#up(event));
    const item = document.createElement("li");
    item.append(button);
    list.append(item);
    return button;
  }

  /** Returns the lowest point of the fingertip (m), null without a focus. @param {number} passed since the last call
   *  (s) */
  point(passed) {
    if (this.index === null) return null;
    const { length = LENGTH, width = WIDTH } = this.places[this.index];
    const end = length / 2 - EDGE;
    this.along = Math.min(end, Math.max(-end, this.along + this.direction * SPEED * passed));
    if (Math.abs(this.along) === end && Math.sign(this.along) === this.direction) this.direction = 0;
    if (this.rested < REST) this.onChange();
    this.rested += passed;
    const over = this.rested < REST ? AWAY : HOVER;
    const { x, z } = this.places[this.index];
    return { x: x + this.along, y: this.direction ? -depthOf(this.load, this.stiffness) : over, z: z + width / 6 };
  }

  /** Multiplies the load of the strokes. */
  scaleLoad(factor) {
    this.load = Math.min(MOST_LOAD, Math.max(LOAD_STEP, this.load * factor));
  }

  #focus(index) {
    this.index = index;
    this.along = this.rested = 0;
    this.#stop();
  }

  #stop() {
    this.direction = 0;
    this.onChange();
  }

  #down(event) {
    const direction = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    const harder = { ArrowUp: 1, ArrowDown: -1 }[event.key];
    if (!direction && !harder) return;
    event.preventDefault();
    if (harder) this.load = Math.min(MOST_LOAD, Math.max(LOAD_STEP, this.load + harder * LOAD_STEP));
    else if (!event.repeat) this.direction = direction;
    this.onChange();
  }

  #up({ key }) {
    if ({ ArrowLeft: -1, ArrowRight: 1 }[key] === this.direction) this.#stop();
  }
}
