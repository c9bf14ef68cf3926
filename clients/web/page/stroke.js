/* The pad: pointers, keys and a hand that strokes by itself move fingers over the texture.

Model: the left edge of the pad is position 0; a CSS pixel is 1/96 inch, less where the texture is shown larger. A pen
that reports pressure presses with load * 2 * pressure, so that half of its pressure is the load of the dial.
Limits: no screen tells how large its pixels really are: "true to size" is as true as the browser's inch. */

import { followPointers } from "../hand/pointers.js";
import { Stroker } from "../hand/stroker.js";
import { byId } from "../knobs/element.js";
import { Dial } from "./dial.js";

const PIXEL = 0.0254 / 96; // m
const KEY_STEP = 8; // ms between the contacts of a finger moved by keys
const LOUDER = 1.25; // of the load, a press of + or -
const [LOAD, SPEED] = [0.3, 0.08]; // N and m/s: those of a scene that tells none
const MOST_LOAD = 1000; // N, of a scene and of a contact
const KEYS = "keys";
const HAND = "hand";

/** The pad. `touches`: id -> {position m, load N, speed m/s}. */
export class Pad {
  touches = new Map();
  #scale = PIXEL;
  #keys = { down: false, position: null, way: 0, timer: 0, at: 0 };

  /** session: what is moved. state: the SceneState, whose scan the dials show and write. onTouch(): the touches
   *  changed. onScale(metresPerPixel). tell(sentence). */
  constructor({ session, state, onTouch, onScale, tell }) {
    Object.assign(this, { session, onTouch, tell });
    this.element = byId("pad");
    this.load = new Dial("load", {
      ...{ state, minimum: 0.001, maximum: 20, unit: "N", usual: LOAD },
      onChange: (value) => this.#press(value),
    });
    this.speed = new Dial("speed", {
      ...{ state, minimum: 0.001, maximum: 2, unit: "m/s", usual: SPEED },
      onChange: (value) => {
        if (this.stroker) this.stroker.speed = value;
      },
    });
    this.stroker = new Stroker({
      length: 0.05,
      speed: this.speed.value,
      load: this.load.value,
      onMove: (contact) => this.move(HAND, contact),
      onLift: () => this.lift(HAND),
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
    session.addEventListener("ready", () => this.#tellAgain());
    this.element.addEventListener("wheel", (event) => event.ctrlKey || event.stopPropagation(), {
      capture: true,
      passive: true,
    }); // the page scrolls
    byId("magnify").addEventListener("change", () => {
      this.#scale = PIXEL / Number(byId("magnify").value);
      onScale(this.#scale);
    });
    byId("stroke").addEventListener("click", () => this.strokeByItself(!this.stroker.running));
  }

  /** Metres that a pixel of the pad stands for. */
  get metresPerPixel() {
    return this.#scale;
  }

  /** Takes a scale that was set by zooming on the pad itself. */
  set metresPerPixel(scale) {
    this.#scale = scale;
    const zoomed = byId("magnify").options[0];
    zoomed.textContent = `${Number((PIXEL / scale).toPrecision(2))} times`;
    zoomed.value = String(PIXEL / scale);
    zoomed.hidden = false;
    byId("magnify").selectedIndex = 0;
  }

  /** Width of the pad, m. */
  get length() {
    return this.element.clientWidth * this.metresPerPixel;
  }

  /** The finger `id` is at contact.position (m) with contact.load (N), at contact.time (s). */
  move(id, contact) {
    const last = this.touches.get(id);
    const elapsed = last ? contact.time - last.time : 0;
    const speed =
      elapsed > 0 ? 0.8 * last.speed + (0.2 * (contact.position - last.position)) / elapsed : (last?.speed ?? 0);
    this.touches.set(id, { ...contact, speed });
    this.session.move(id, contact);
    this.element.classList.add("touched");
    this.onTouch();
  }

  /** The finger `id` is lifted. */
  lift(id) {
    this.touches.delete(id);
    this.session.lift(id);
    this.onTouch();
  }

  /** Let the hand stroke over the pad, or take it off. */
  async strokeByItself(on) {
    byId("stroke").setAttribute("aria-pressed", String(on));
    if (!on) return this.stroker.stop();
    await this.session.start().catch(() => byId("stroke").setAttribute("aria-pressed", "false"));
    if (!this.session.player) return;
    Object.assign(this.stroker, { length: this.length, speed: this.speed.value, load: this.load.value });
    this.stroker.start();
  }

  /** Take all fingers off. */
  release() {
    this.strokeByItself(false);
    this.#liftKeys();
    for (const id of [...this.touches.keys()]) this.lift(id);
  }

  /** Fingers that were put down before their stream was there rest where they are: their stream hears of it now. */
  #tellAgain() {
    const time = performance.now() / 1e3;
    for (const [id, { position, load }] of this.touches)
      if (position !== undefined) this.session.move(id, { position, load, time });
  }

  #press(load) {
    if (!this.stroker) return;
    this.stroker.load = load;
    if (this.#keys.down) this.move(KEYS, { position: this.#keys.position, load, time: performance.now() / 1e3 });
  }

  #key(event) {
    const way = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[event.key];
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (way) this.#go(way);
    else if (event.key === " ") this.#toggle();
    else if (["+", "="].includes(event.key)) this.#pressBy(LOUDER);
    else if (event.key === "-") this.#pressBy(1 / LOUDER);
    else return;
    event.preventDefault();
    if (event.key === "+" || event.key === "=" || event.key === "-") this.tell(`Load ${this.load.output.textContent}.`);
  }

  #pressBy(factor) {
    const load = Math.max(this.load.minimum, Math.abs(this.load.value)) * factor;
    this.load.write(Number(Math.min(MOST_LOAD, load).toPrecision(3)));
  }

  #go(way) {
    const keys = this.#keys;
    if (keys.position === null) this.#toggle();
    keys.way = way;
    if (keys.timer) return;
    keys.at = performance.now() / 1e3;
    keys.timer = setInterval(() => this.#step(), KEY_STEP);
  }

  #step() {
    const keys = this.#keys;
    const time = performance.now() / 1e3;
    keys.position = Math.min(
      this.length,
      Math.max(0, keys.position + keys.way * Math.abs(this.speed.value) * (time - keys.at)),
    );
    keys.at = time;
    if (keys.down) this.move(KEYS, { position: keys.position, load: this.load.value, time });
  }

  #halt() {
    clearInterval(this.#keys.timer);
    this.#keys.timer = 0;
  }

  async #toggle() {
    const keys = this.#keys;
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
