/* The sliders under the pad: load and speed of the scan.

Model: a slider shows the value of the scene and writes to the scene; it has no value of its own. It is logarithmic,
with three significant digits. A value beyond its ends is shown unchanged, with the slider at its end.
Limits: a trajectory has no single load or speed. The slider then shows "as recorded"; moving it replaces the
trajectory. */

import { byId } from "../dom.js";
import { sliderOf } from "../form/slider_scale.js";
import { showQuantity, siValue } from "../scene/units.js";

const STEPS = 1000; // of the slider, as in the markup

/** The slider `name` of the page, for the field `name` of the scan in the SI unit `unit`. */
export class ScanSlider {
  #value;
  #sliding = false;

  /** state: the SceneState. minimum, maximum: ends of the slider. usual: value if the scene has none. */
  constructor(name, { state, minimum, maximum, unit, usual, onChange = () => {} }) {
    Object.assign(this, { name, state, minimum, maximum, unit, onChange });
    this.#value = usual;
    this.usual = usual;
    this.track = byId(name);
    this.output = byId(`${name}-value`);
    this.scale = sliderOf({ minimum, maximum, whole: false }, false);
    this.track.addEventListener("input", () => this.#slide(false));
    this.track.addEventListener("change", () => this.#slide(true));
    for (const kind of ["change", "defaults"]) state.addEventListener(kind, () => this.#show());
    this.#show();
  }

  /** The newest valid value of the scene, SI. */
  get value() {
    return this.#value;
  }

  /** Writes `value` (SI) into the scene. settled: false while the slider still moves. */
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
