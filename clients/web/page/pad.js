/* The pad: pointers, keys and the automatic stroke move fingers over the texture.

Model: the left edge of the pad is position 0. The middle of the pad is y = 0, and y rises upwards. A CSS pixel is 1/96
inch, divided by the magnification. The load of a pen is load * 2 * pressure, so that half of its pressure is the load
of the slider.
A finger that was lifted with space stays up until space, a finger that was lifted otherwise until an arrow.
Limits: browsers do not know the real size of a pixel, so "true to size" is approximate. */

import { followPointers } from "../hand/pointers.js";
import { AutomaticStroke } from "../hand/automatic_stroke.js";
import { byId } from "../dom.js";
import { ScanSlider } from "./scan_slider.js";

const PIXEL = 0.0254 / 96; // m
const MAGNIFIED = 5; // at first; a brisk stroke of 1000 px/s then has the speed of a hand that explores, 50 mm/s
const MOST_RAISED = 10; // gain for a magnified hand; the player bends what would be loud
const KEY_STEP = 8; // ms between contact updates of the arrow keys
const SPEED_TIME = 0.036; // s over which the shown speed is averaged; shorter follows the jitter of pointers
const LOAD_FACTOR = 1.25; // of + and -
const [LOAD, SPEED] = [0.3, 0.08]; // N and m/s, defaults of a scene
const MOST_LOAD = 1000; // N, limit of the service
const KEYS = "keys";
const AUTOMATIC = "automatic";

/** The pad. touches: id of a finger -> {position (m), y (m), load (N), speed (m/s)}. Event "released": no hand touches any
 *  more. */
export class Pad extends EventTarget {
  touches = new Map();
  #scale = PIXEL / MAGNIFIED;
  #keys = { down: false, up: false, position: null, direction: 0, timer: 0, time: 0 }; // up: lifted with space

  /** session: the TouchSession. state: the SceneState. onTouch(): called when touches change. onScale(metresPerPixel):
   *  called when the magnification changes. tell(sentence). */
  constructor({ session, state, onTouch, onScale, tell }) {
    super();
    Object.assign(this, { session, onTouch, tell });
    this.element = byId("pad");
    this.load = new ScanSlider("load", {
      ...{ state, minimum: 0.001, maximum: 20, unit: "N", usual: LOAD },
      onChange: (value) => this.#setLoad(value),
    });
    this.speed = new ScanSlider("speed", {
      ...{ state, minimum: 0.001, maximum: 2, unit: "m/s", usual: SPEED },
      onChange: (value) => {
        if (this.automaticStroke) this.automaticStroke.speed = value;
      },
    });
    this.automaticStroke = new AutomaticStroke({
      length: 0.05,
      speed: this.speed.value,
      load: this.load.value,
      onMove: (contact) => this.move(AUTOMATIC, contact),
      onLift: () => this.lift(AUTOMATIC),
    });
    followPointers(this.element, {
      metresPerPixel: () => this.metresPerPixel,
      loadOf: (pressure) => (pressure === null ? this.load.value : this.load.value * 2 * pressure),
      onMove: (id, contact) => this.move(id, contact),
      onLift: (id) => this.lift(id),
    });
    for (const type of ["pointerdown", "click"])
      this.element.addEventListener(type, () => session.start().catch(() => {}));
    this.element.addEventListener("keydown", (event) => this.#key(event));
    this.element.addEventListener("keyup", (event) => event.key.startsWith("Arrow") && this.#halt());
    this.element.addEventListener("blur", () => this.#liftKeys());
    document.querySelector(".skip").addEventListener("click", (event) => {
      event.preventDefault(); // the address of the page holds the scene
      this.element.focus();
    });
    session.addEventListener("ready", () => this.#resend());
    this.element.addEventListener("wheel", (event) => event.ctrlKey || event.stopPropagation(), {
      capture: true,
      passive: true,
    }); // the wheel scrolls the page instead of zooming
    byId("magnify").value = String(MAGNIFIED); // the browser may have kept another choice
    byId("magnify").addEventListener("change", () => {
      this.#scale = PIXEL / Number(byId("magnify").value);
      this.#raise();
      onScale(this.#scale);
    });
    this.#raise();
    byId("true-size").addEventListener("click", () => {
      byId("magnify").value = "1";
      byId("magnify").dispatchEvent(new Event("change"));
      byId("magnify").focus(); // the button that leads to true size is gone
    });
    byId("stroke").addEventListener("click", () => this.strokeAutomatically(!this.automaticStroke.running));
  }

  /** Metres per CSS pixel at true size. */
  static get trueSize() {
    return PIXEL;
  }

  /** Metres per CSS pixel of the pad. */
  get metresPerPixel() {
    return this.#scale;
  }

  /** Shows a scale that was set by zooming on the pad. */
  set metresPerPixel(scale) {
    this.#scale = scale;
    const zoomed = byId("magnify").options[0];
    zoomed.textContent = `${Number((PIXEL / scale).toPrecision(2))} times`;
    zoomed.value = String(PIXEL / scale);
    zoomed.hidden = false;
    byId("magnify").selectedIndex = 0;
    this.#raise();
  }

  /** Raises the sound of a magnified hand. It is slower by the magnification, and acceleration grows with the square of
   *  the speed. */
  #raise() {
    this.session.raised = Math.min(MOST_RAISED, Math.max(1, (PIXEL / this.#scale) ** 2));
  }

  /** Width of the pad, m. */
  get length() {
    return this.element.clientWidth * this.metresPerPixel;
  }

  /** Moves the finger `id`. contact: {position (m), y (m; absent: 0), load (N), time (s)}. */
  move(id, contact) {
    const last = this.touches.get(id);
    const elapsed = last ? contact.time - last.time : 0;
    const kept = Math.exp(-elapsed / SPEED_TIME);
    const speed =
      elapsed > 0
        ? kept * last.speed + ((1 - kept) * (contact.position - last.position)) / elapsed
        : (last?.speed ?? 0);
    this.touches.set(id, { ...contact, speed });
    this.session.move(id, contact);
    this.element.classList.add("touched");
    this.onTouch();
  }

  /** Whether a hand touches, not only the automatic stroke. */
  get isHeld() {
    return [...this.touches.keys()].some((id) => id !== AUTOMATIC);
  }

  /** Lifts the finger `id`. */
  lift(id) {
    const held = this.isHeld;
    this.touches.delete(id);
    this.session.lift(id);
    this.onTouch();
    if (held && !this.isHeld) this.dispatchEvent(new Event("released"));
  }

  /** Starts or stops the automatic stroke. */
  async strokeAutomatically(on) {
    byId("stroke").setAttribute("aria-pressed", String(on));
    if (!on) return this.automaticStroke.stop();
    await this.session.start().catch(() => byId("stroke").setAttribute("aria-pressed", "false"));
    if (!this.session.player) return;
    Object.assign(this.automaticStroke, { length: this.length, speed: this.speed.value, load: this.load.value });
    this.automaticStroke.start();
  }

  /** Lifts all fingers. */
  release() {
    this.strokeAutomatically(false);
    this.#liftKeys();
    for (const id of [...this.touches.keys()]) this.lift(id);
  }

  /** Sends the contact of fingers that touched before their stream was open. */
  #resend() {
    const time = performance.now() / 1e3;
    for (const [id, { speed, ...contact }] of this.touches)
      if (contact.position !== undefined) this.session.move(id, { ...contact, time });
  }

  #setLoad(load) {
    if (!this.automaticStroke) return;
    this.automaticStroke.load = load;
    if (this.#keys.down) this.move(KEYS, { position: this.#keys.position, load, time: performance.now() / 1e3 });
  }

  #key(event) {
    const direction = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[event.key];
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (direction) this.#startMoving(direction, event.repeat);
    else if (event.key === " ") this.#toggle();
    else if (["+", "="].includes(event.key)) this.#scaleLoad(LOAD_FACTOR);
    else if (event.key === "-") this.#scaleLoad(1 / LOAD_FACTOR);
    else return;
    event.preventDefault();
    if (event.key === "+" || event.key === "=" || event.key === "-") this.tell(`Load ${this.load.output.textContent}.`);
  }

  #scaleLoad(factor) {
    const load = Math.max(this.load.minimum, Math.abs(this.load.value)) * factor;
    this.load.write(Number(Math.min(MOST_LOAD, load).toPrecision(3)));
  }

  #startMoving(direction, repeated) {
    const keys = this.#keys;
    if (!keys.down && !keys.up && !repeated) this.#toggle();
    keys.direction = direction;
    if (keys.timer) return;
    keys.time = performance.now() / 1e3;
    keys.timer = setInterval(() => this.#step(), KEY_STEP);
  }

  #step() {
    const keys = this.#keys;
    const time = performance.now() / 1e3;
    keys.position = Math.min(
      this.length,
      Math.max(0, keys.position + keys.direction * Math.abs(this.speed.value) * (time - keys.time)),
    );
    keys.time = time;
    if (keys.down) this.move(KEYS, { position: keys.position, load: this.load.value, time });
  }

  #halt() {
    clearInterval(this.#keys.timer);
    this.#keys.timer = 0;
  }

  async #toggle() {
    const keys = this.#keys;
    keys.up = keys.down;
    if (keys.down) return this.#liftKeys("Finger lifted.");
    keys.position ??= this.length / 2;
    keys.down = true;
    await this.session.start().catch(() => {
      keys.down = false;
    });
    if (!keys.down) return;
    this.tell("Finger down.");
    this.move(KEYS, { position: keys.position, load: this.load.value, time: performance.now() / 1e3 });
  }

  #liftKeys(sentence) {
    this.#halt();
    if (!this.#keys.down) return;
    this.#keys.down = false;
    this.lift(KEYS);
    if (sentence) this.tell(sentence);
  }
}
