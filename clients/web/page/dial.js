/* A slider of a quantity of the scan with its value beside it: the load and the speed under the pad.

Model: the dial shows what the scene holds and writes what it is moved to; it holds nothing itself. The slider is
logarithmic, three significant digits; a value beyond its ends is told as it is, with the slider at its end.
Limits: a recorded motion has no one load and no one speed: the dial says so, and what is written replaces it. */

import { byId } from "../knobs/element.js";
import { sliderOf } from "../knobs/slider.js";
import { showQuantity, siValue } from "../knobs/units.js";

const STEPS = 1000; // of the slider, as in the markup

/** The dial of the elements `name` and `name-value`, of the field `name` of the scan in the SI unit `unit`. */
export class Dial {
  #value;
  #sliding = false;

  /** state: the SceneState. minimum, maximum: ends of the slider. usual: the value where the scene tells none. */
  constructor(name, { state, minimum, maximum, unit, usual, onChange = () => {} }) {
    Object.assign(this, { name, state, minimum, maximum, unit, onChange });
    this.#value = usual;
    this.usual = usual;
    this.track = byId(name);
    this.output = byId(`${name}-value`);
    this.scale = sliderOf({ minimum, maximum, whole: false }, false);
    this.track.addEventListener("input", () => this.#slide(false));
    this.track.addEventListener("change", () => this.#slide(true));
    for (const kind of ["change", "learn"]) state.addEventListener(kind, () => this.#show());
    this.#show();
  }

  /** What a hand is led with: the last value of the scene that could be read. */
  get value() {
    return this.#value;
  }

  /** Write `value` into the scene. settled: false while more of the same change follows. */
  write(value, settled = true) {
    this.state.write(this.state.scanPath(this.name), showQuantity(value, this.unit), settled);
  }

  #slide(settled) {
    this.#sliding = !settled;
    this.write((this.#value < 0 ? -1 : 1) * this.scale.value(this.track.value / STEPS), settled);
  }

  #show() {
    const { state, unit, usual } = this;
    const held = state.isRecorded ? usual : (state.valueAt(state.scanPath(this.name)) ?? usual);
    const value = siValue(held, unit);
    const known = Number.isFinite(value);
    this.output.textContent = known ? showQuantity(value, unit, 3) : String(held);
    if (state.isRecorded) this.output.textContent = "as recorded";
    this.track.setAttribute("aria-valuetext", this.output.textContent);
    if (!known) return;
    const size = Math.max(this.minimum, Math.abs(value));
    if (!this.#sliding) this.track.value = this.scale.place(size) * STEPS;
    if (value === this.#value) return;
    this.#value = value;
    this.onChange(value);
  }
}
