/* The table without a headset: a mouse, a pen or a finger touches swatches and turns the view.

Model: the left button touches. The load begins at FIRST_LOAD and grows while the button is held; the wheel or the
pressure of a pen sets it. The right button and the arrow keys turn the view; wheel, plus and minus zoom. A finger on
the screen that begins beside the swatches moves the table nearer or farther. A click on the panel presses its button.
Limits: one pointer at a time. */

import { MOST_LOAD, STIFFNESS, depthOf } from "./contact_model.js";

const FIRST_LOAD = 0.3; // N
const GROWTH = 0.25; // N/s while the button is held
const NOTCH_LOAD = 0.1; // N per notch of the wheel
const HOVER = 0.012; // m over the surface, height at which a pointer without a touch is drawn
const TURN = 0.006; // rad per pixel
const KEY_TURN = 0.08; // rad per key press
const BOUNDS = { yaw: [-1.2, 1.2], pitch: [0.25, 1.5], distance: [0.3, 2.5] };
const MARGIN = 1.15; // factor of the first distance: the near edge of the table is closer than its middle

const within = (value, [least, most]) => Math.min(most, Math.max(least, value));

/** The viewpoint: yaw and pitch about the middle of the table (rad), distance (m). */
export class Viewpoint {
  constructor() {
    Object.assign(this, { yaw: 0, pitch: 1, distance: 1, moved: false, ahead: 0, reach: 0 });
  }

  /**
   * Sets the distance that shows the whole table or, in a tall picture, its width and its front, unless the user has moved
   * the viewpoint.
   * @param {{width: number, depth: number}} table size (m)
   * @param {{fov: number, aspect: number}} camera vertical field of view (degrees), width over height
   * @param {boolean} tall whether only the width must fit
   */
  fit({ width, depth }, { fov, aspect }, tall = false) {
    const half = Math.tan((fov * Math.PI) / 360);
    if (this.moved) return;
    const across = (MARGIN * width) / 2 / half / aspect;
    this.distance = tall ? across : Math.max(across, (MARGIN * depth) / 2 / half);
    this.reach = tall ? depth / 2 : 0;
    this.ahead = tall ? Math.max(0, depth / 2 - this.distance * half) : 0;
  }

  /** Moves the view towards the person (m), within the table. */
  slide(by) {
    this.ahead = within(this.ahead + by, [-this.reach, this.reach]);
  }

  /** Turns and zooms, within bounds. @param {{yaw?: number, pitch?: number, nearer?: number}} by rad, and a factor */
  turn({ yaw = 0, pitch = 0, nearer = 1 }) {
    this.moved = true;
    this.yaw = within(this.yaw + yaw, BOUNDS.yaw);
    this.pitch = within(this.pitch + pitch, BOUNDS.pitch);
    this.distance = within(this.distance / nearer, BOUNDS.distance);
  }

  /** Places the camera. @param {{position: Vector3, lookAt: Function}} camera @param {{x, y, z}} middle of the table
   *  (m) */
  place(camera, { x, y, z }) {
    const flat = this.distance * Math.cos(this.pitch);
    camera.position.set(
      x + flat * Math.sin(this.yaw),
      y + this.distance * Math.sin(this.pitch),
      z + this.ahead + flat * Math.cos(this.yaw),
    );
    camera.lookAt(x, y, z + this.ahead);
  }
}

export class DesktopPointer {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {{view: Viewpoint, under: (x: number, y: number) => {x: number, z: number} | null, onChange: () => void,
   *   press?: (x: number, y: number) => boolean, isSwatch?: (point: {x: number, z: number}) => boolean}} parts
   *   `under` returns the point of the table (m) at a place of the canvas, -1 to 1 to the right and up; `press` presses the
   *   button of the panel there, and returns whether the panel is there
   */
  constructor(canvas, { view, under, onChange, press = () => false, isSwatch = () => true }) {
    Object.assign(this, { canvas, view, under, onChange, press, isSwatch });
    this.place = null;
    this.load = 0;
    this.firstLoad = FIRST_LOAD;
    this.stiffness = STIFFNESS;
    this.pressing = this.held = this.landing = this.turning = this.sliding = false;
    const on = (kind, act, options) => canvas.addEventListener(kind, act, options);
    on("pointerdown", (event) => this.#down(event));
    on("pointermove", (event) => this.#move(event));
    for (const kind of ["pointerup", "pointercancel", "lostpointercapture"]) on(kind, () => this.lift());
    on("pointerleave", () => this.pressing || this.#at(null));
    on("wheel", (event) => this.#wheel(event), { passive: false });
    on("contextmenu", (event) => event.preventDefault());
    on("keydown", (event) => this.#key(event));
  }

  /**
   * Returns the lowest point of the fingertip in coordinates of the table (m), null if there is none.
   * @param {number} passed time since the last call (s)
   */
  point(passed) {
    if (!this.place) return null;
    if (this.landing) {
      this.landing = false;
      return { ...this.place, y: 0 };
    }
    if (this.pressing && !this.held) this.load = Math.min(MOST_LOAD, this.load + GROWTH * passed);
    return { x: this.place.x, y: this.pressing ? -depthOf(this.load, this.stiffness) : HOVER, z: this.place.z };
  }

  /** Multiplies the load with which a touch begins. */
  scaleLoad(factor) {
    this.firstLoad = within(this.firstLoad * factor, [NOTCH_LOAD / 2, MOST_LOAD]);
  }

  /** Lifts the pointer. */
  lift() {
    this.pressing = this.held = this.landing = this.turning = this.sliding = false;
    this.onChange();
  }

  #at(event) {
    this.place = event && this.under(...this.#point(event));
    this.onChange();
  }

  /** Returns the place of an event on the canvas, -1 to 1 to the right and up. */
  #point({ clientX, clientY }) {
    const { left, top, width, height } = this.canvas.getBoundingClientRect();
    return [((clientX - left) / width) * 2 - 1, 1 - ((clientY - top) / height) * 2];
  }

  #down(event) {
    this.canvas.setPointerCapture(event.pointerId);
    this.#at(event);
    if (event.button !== 0) {
      this.turning = true;
      return;
    }
    if (this.press(...this.#point(event))) return this.onChange();
    this.sliding = event.pointerType === "touch" && this.place !== null && !this.isSwatch(this.place);
    if (this.sliding) return;
    this.pressing = this.landing = true;
    this.load = this.firstLoad;
    this.#press(event);
  }

  #move(event) {
    if (this.turning) this.view.turn({ yaw: -TURN * event.movementX, pitch: TURN * event.movementY });
    const before = this.place;
    this.#at(event);
    if (this.sliding && before && this.place) {
      this.view.slide(before.z - this.place.z);
      this.place = before; // the table moves with the finger
    }
    if (this.pressing) this.#press(event);
  }

  #press({ pointerType, pressure }) {
    if (pointerType !== "pen" || !pressure) return;
    this.held = true;
    this.load = pressure * MOST_LOAD;
  }

  #wheel(event) {
    event.preventDefault();
    const notches = -Math.sign(event.deltaY);
    if (this.pressing) {
      this.held = true;
      this.load = within(this.load - notches * NOTCH_LOAD, [NOTCH_LOAD / 2, MOST_LOAD]);
    } else this.view.turn({ nearer: 1.06 ** notches });
    this.onChange();
  }

  #key(event) {
    const turns = {
      ArrowLeft: { yaw: -KEY_TURN },
      ArrowRight: { yaw: KEY_TURN },
      ArrowUp: { pitch: KEY_TURN },
      ArrowDown: { pitch: -KEY_TURN },
      "+": { nearer: 1.1 },
      "=": { nearer: 1.1 },
      "-": { nearer: 1 / 1.1 },
    };
    if (!turns[event.key] || event.altKey || event.ctrlKey || event.metaKey) return;
    event.preventDefault();
    this.view.turn(turns[event.key]);
    this.onChange();
  }
}
