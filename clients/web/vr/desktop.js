/* The table without a headset: a mouse, a pen or a finger on the canvas touches it and turns it.

Model: the left button presses; depth begins at FIRST_LOAD and grows while the button is held, or goes where the wheel
sets it; a pen that reports pressure sets it by that. The right button and the arrow keys turn the table under the eye,
wheel, plus and minus come nearer. The eye moves only while one of these is used.
Limits: one pointer at a time. */

import { MOST_LOAD, depthOf } from "./touch.js";

const FIRST_LOAD = 0.3; // N
const GROWTH = 0.25; // N per s while held
const A_NOTCH = 0.1; // N per notch of the wheel
const HOVER = 0.012; // m over the surface where a pointer that does not press is drawn
const TURN = 0.006; // rad per pixel
const A_KEY = 0.08; // rad per key press
const BOUNDS = { yaw: [-1.2, 1.2], pitch: [0.25, 1.5], distance: [0.3, 2.5] };
const ROOM = 1.15; // times the table that a picture shows at first: its near edge is nearer than its middle

const within = (value, [least, most]) => Math.min(most, Math.max(least, value));

/** Where the eye is: turn and height about the middle of the table (rad), distance from it (m). */
export class Eye {
  constructor() {
    Object.assign(this, { yaw: 0, pitch: 1, distance: 1, moved: false });
  }

  /**
   * Stands back as far as shows the whole table, unless a person has chosen where to stand.
   * @param {{width: number, depth: number}} table size (m)
   * @param {{fov: number, aspect: number}} camera degrees from top to bottom, width over height of the picture
   */
  fit({ width, depth }, { fov, aspect }) {
    const half = Math.tan((fov * Math.PI) / 360);
    if (!this.moved) this.distance = Math.max((ROOM * width) / 2 / half / aspect, (ROOM * depth) / 2 / half);
  }

  /** Turns and comes nearer, within bounds. @param {{yaw?: number, pitch?: number, nearer?: number}} by rad, and a
   *  factor */
  turn({ yaw = 0, pitch = 0, nearer = 1 }) {
    this.moved = true;
    this.yaw = within(this.yaw + yaw, BOUNDS.yaw);
    this.pitch = within(this.pitch + pitch, BOUNDS.pitch);
    this.distance = within(this.distance / nearer, BOUNDS.distance);
  }

  /** @param {{position: Vector3, lookAt: Function}} camera @param {{x, y, z}} middle what is looked at (m), in the
   *  world */
  hold(camera, { x, y, z }) {
    const flat = this.distance * Math.cos(this.pitch);
    camera.position.set(
      x + flat * Math.sin(this.yaw),
      y + this.distance * Math.sin(this.pitch),
      z + flat * Math.cos(this.yaw),
    );
    camera.lookAt(x, y, z);
  }
}

export class DesktopHand {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {{eye: Eye, under: (x: number, y: number) => {x: number, z: number} | null, onChange: () => void}} parts
   *   `under` gives the point of the table's plane (m) at a place of the canvas, -1..1 to the right and up
   */
  constructor(canvas, { eye, under, onChange }) {
    Object.assign(this, { canvas, eye, under, onChange });
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
   * The lowest point of the fingertip now, in the table's frame (m), null where there is none.
   * @param {number} passed time since the last call (s), in which a held press grows
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

  /** Takes the pointer off the surface. */
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
    if (this.turning) this.eye.turn({ yaw: -TURN * event.movementX, pitch: TURN * event.movementY });
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
      this.load = within(this.load - notches * A_NOTCH, [A_NOTCH / 2, MOST_LOAD]);
    } else this.eye.turn({ nearer: 1.06 ** notches });
    this.onChange();
  }

  #key(event) {
    const turns = {
      ArrowLeft: { yaw: -A_KEY },
      ArrowRight: { yaw: A_KEY },
      ArrowUp: { pitch: A_KEY },
      ArrowDown: { pitch: -A_KEY },
      "+": { nearer: 1.1 },
      "=": { nearer: 1.1 },
      "-": { nearer: 1 / 1.1 },
    };
    if (!turns[event.key] || event.altKey || event.ctrlKey || event.metaKey) return;
    event.preventDefault();
    this.eye.turn(turns[event.key]);
    this.onChange();
  }
}
