/* A slider of a quantity with its value beside it: the load and the speed of the pad.

Limits: logarithmic, three significant digits; a value from outside is held to the range. */

import { byId } from "../knobs/element.js";
import { sliderOf } from "../knobs/slider.js";
import { showQuantity } from "../knobs/units.js";

const STEPS = 1000; // of the slider, as in the markup

/** The dial of the elements `name` and `name-value`: `value` in the SI unit `unit`, from `minimum` to `maximum`. */
export class Dial {
  #value;

  constructor(name, { minimum, maximum, unit, value, onChange = () => {} }) {
    Object.assign(this, { minimum, maximum, unit, onChange });
    this.track = byId(name);
    this.output = byId(`${name}-value`);
    this.scale = sliderOf({ minimum, maximum, whole: false }, false);
    this.track.addEventListener("input", () => this.#take(this.scale.value(this.track.value / STEPS)));
    this.value = value;
  }

  get value() {
    return this.#value;
  }

  set value(value) {
    this.#take(Math.min(this.maximum, Math.max(this.minimum, value)));
    this.track.value = this.scale.place(this.#value) * STEPS;
  }

  #take(value) {
    this.#value = value;
    this.output.textContent = showQuantity(value, this.unit, 3);
    this.track.setAttribute("aria-valuetext", this.output.textContent);
    this.onChange(value);
  }
}
