/* The table without a headset: a mouse, a pen or a finger touches swatches and turns the view.

Model: the left button touches. The load begins at FIRST_LOAD and grows while the button is held; the wheel or the
pressure of a pen sets it. The right button and the arrow keys turn the view; wheel, plus and minus zoom.
Limits: one pointer at a time. */

import { MOST_LOAD, depthOf } from "./contact_model.js";

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
    Object.assign(this, { yaw: 0, pitch: 1, distance: 1, moved: false });
  }

  /**
   * Sets the distance that shows the whole table, unless the user has moved the viewpoint.
   * @param {{width: number, depth: number}} table size (m)
   * @param {{fov: number, aspect: number}} camera vertical field of view (degrees), width over height
   */
  fit({ width, depth }, { fov, aspect }) {
    const half = Math.tan((fov * Math.PI) / 360);
    if (!this.moved) this.distance = Math.max((MARGIN * width) / 2 / half / aspect, (MARGIN * depth) / 2 / half);
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
      z + flat * Math.cos(this.yaw),
    );
    camera.lookAt(x, y, z);
  }
}

export class DesktopPointer {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {{view: Viewpoint, under: (x: number, y: number) => {x: number, z: number} | null, onChange: () => void}}
   *   parts
   *   `under` returns the point of the table (m) at a place of the canvas, -1 to 1 to the right and up
   */
  constructor(canvas, { view, under, onChange }) {
    Object.assign(this, { canvas, view, under, onChange });
    this.place = null;
    this.load = 0;
    this.pressing = this.held = this.landing = this.turning = false;
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
    return { x: this.place.x, y: this.pressing ? -depthOf(this.load) : HOVER, z: this.place.z };
  }

  /** Lifts the pointer. */
  lift() {
    this.pressing = this.held = this.landing = this.turning = false;
    this.onChange();
  }

  #at(event) {
    const { left, top, width, height } = this.canvas.getBoundingClientRect();
    this.place =
      event && this.under(((event.clientX - left) / width) * 2 - 1, 1 - ((event.clientY - top) / height) * 2);
    this.onChange();
  }

  #down(event) {
    this.canvas.setPointerCapture(event.pointerId);
    this.#at(event);
    if (event.button !== 0) {
      this.turning = true;
      return;
    }
    this.pressing = this.landing = true;
    this.load = FIRST_LOAD;
    this.#press(event);
  }

  #move(event) {
    if (this.turning) this.view.turn({ yaw: -TURN * event.movementX, pitch: TURN * event.movementY });
    this.#at(event);
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
