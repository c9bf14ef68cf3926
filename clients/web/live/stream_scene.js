/* The scene that a stream has, and the one that it is to have: one change at a time is on its way.

Model: while a change is prepared, newer wishes wait, and only the last of them is asked for. So each answer is that of
the one change on its way, and who looks knows of which scene the sound is. The scan is the hand's on a page, and the
full scale is fixed for a stream: neither is part of a change.
Limits: a stream that began before the page's newest scene is told the difference once it is live. */

import { partBetween, same, withField } from "../knobs/merge.js";

const DROPPED = /#problem-too-fast$/;
const AGAIN = 1100; // ms after which a message may come through again: the service drops the rest of a second

/** Returns `scene` with the full scale of a stream that is `ready`, so that another one is as loud; where the page knows
 *  how to write it. */
export function pinned(scene, ready) {
  const own = ready?.quantities.filter((quantity) => quantity !== "tangential_force") ?? [];
  if (own.length !== 1 || scene.output?.channels) return scene;
  return withField(scene, ["output", "full_scale"], ready.full_scale[0]);
}

export class StreamScene {
  /** The scene that the sound is of. */
  held;
  /** The one that it is to be of. */
  wanted;
  #asked = null; // the one on its way
  #refused = null;

  /** connection: a LiveConnection. scene: what it begins with. onChange(): `pending` or `agrees` may be others. */
  constructor(connection, scene, onChange = () => {}) {
    Object.assign(this, { connection, held: scene, wanted: scene, onChange });
    connection.addEventListener("scene", () => this.#asked && this.#answered(this.#asked));
    connection.addEventListener("refused", () => this.#asked && this.#answered(this.held, this.#asked));
    connection.addEventListener("problem", ({ detail }) => {
      if (this.#asked && DROPPED.test(detail.problem.type)) setTimeout(() => this.#ask(), AGAIN);
    });
  }

  /** Whether a change is on its way. */
  get pending() {
    return this.#asked !== null;
  }

  /** Whether the sound is of the scene that is wanted. */
  get agrees() {
    return !this.pending && same(this.held, this.wanted);
  }

  /** Whether what is wanted was refused. */
  get refused() {
    return same(this.wanted, this.#refused);
  }

  /** Has the stream become that of `scene`. */
  become(scene) {
    const { held } = this;
    const scaled = withField(scene, ["output", "full_scale"], held.output?.full_scale);
    this.wanted = held.output?.full_scale === undefined ? structuredClone(scene) : scaled;
    delete this.wanted.scan;
    if (held.scan) this.wanted.scan = held.scan;
    this.#next();
  }

  #answered(held, refused = null) {
    this.held = held;
    this.#asked = null;
    this.#refused = refused;
    this.connection.base = pinned(held, this.connection.ready);
    this.#next();
  }

  #next() {
    const open = !this.pending && !same(this.held, this.wanted) && !this.refused;
    if (open) this.#asked = this.wanted;
    if (open) this.#ask();
    this.onChange();
  }

  #ask() {
    const part = this.#asked ? partBetween(this.held, this.#asked) : {};
    if (Object.keys(part).length) this.connection.change(part);
    else if (this.#asked) this.#answered(this.#asked);
  }
}
