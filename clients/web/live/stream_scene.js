/* The scene of a stream and the scene that is wanted, with one change in progress at a time.

Model: while the service prepares a change, newer scenes wait and only the newest is requested. Each answer therefore
belongs to the one change in progress, and the page knows which scene is heard. A change contains neither the scan,
which belongs to the hand, nor the full scale, which is fixed for a stream. */

import { copyOf, partBetween, same, withField } from "../scene/merge.js";
import { quantityOf } from "../scene/quantities.js";

const HEADROOM = 1.25; // over the full scale that the limiter called for: later strokes may be stronger

/** Returns `scene` with the full scale of the stream `ready`, so that a further stream is equally loud. Returns `scene`
 *  unchanged if it has several channels. */
export function withFullScaleOf(ready, scene) {
  const own = ready?.quantities.filter((quantity) => !quantityOf(quantity).added) ?? [];
  if (own.length !== 1 || scene.output?.channels) return scene;
  return withField(scene, ["output", "full_scale"], ready.full_scale[0]);
}

/** Returns `scene` as a hand needs it: without speed and load of a constant scan, which belong to the hand. The automatic
 *  full scale of a texture then does not depend on them. */
export function forHand(scene) {
  const { speed, load, ...scan } = scene.scan ?? {};
  const { scan: _, ...others } = scene;
  return Object.keys(scan).length ? { ...others, scan } : others;
}

/** Returns the full scale, SI, that leaves room above what the limiter reduced by `reduction` dB in the stream `ready`.
 *  */
export function neededFullScale(ready, reduction) {
  return ready.full_scale[0] * 10 ** (reduction / 20) * HEADROOM;
}

export class StreamScene {
  /** The scene that is heard. */
  held;
  /** The scene that should be heard. */
  wanted;
  #asked = null; // the scene of the change in progress
  #refused = null;

  /** connection: a LiveConnection. scene: its first scene. onChange(): `pending` or `isCurrent` may have changed. */
  constructor(connection, scene, onChange = () => {}) {
    Object.assign(this, { connection, held: scene, wanted: scene, onChange });
    connection.addEventListener("scene", () => this.#asked && this.#answered(this.#asked));
    connection.addEventListener("refused", () => this.#asked && this.#answered(this.held, this.#asked));
  }

  /** Whether a change is in progress. */
  get pending() {
    return this.#asked !== null;
  }

  /** Whether the wanted scene is heard. */
  get isCurrent() {
    return !this.pending && same(this.held, this.wanted);
  }

  /** Whether the service refused the wanted scene. */
  get refused() {
    return same(this.wanted, this.#refused);
  }

  /** Changes the stream to `scene`. */
  change(scene) {
    const { held } = this;
    const scaled = withField(scene, ["output", "full_scale"], held.output?.full_scale);
    this.wanted = held.output?.full_scale === undefined ? copyOf(scene) : scaled;
    delete this.wanted.scan;
    if (held.scan) this.wanted.scan = held.scan;
    this.#next();
  }

  #answered(held, refused = null) {
    this.held = held;
    this.#asked = null;
    this.#refused = refused;
    this.connection.base = withFullScaleOf(this.connection.ready, held);
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
