/* The ghost: one silent stroke over the pad and back, before anybody has touched it, that leaves its waveform.

Model: the service renders SPAN of the scene at SPEED, with which the ghost moves. What waveform and spectrum show is that
sound, in its units. The first touch, key or change of the scene ends the ghost.
Limits: the rate is RATE, so the spectrum ends at half of it; more would only cost transfer. The ghost has the load of the
scene. A scene that is refused, or a stream that is open already, has no ghost. */

import { callBinary } from "../service.js";

const SPEED = 0.06; // m/s, of a hand that explores
const SPAN = 0.6; // s of sound; the views need 0.3 s of it
const RATE = 8000; // Hz
const [FROM, TO] = [0.12, 0.88]; // of the width of the pad
const calm = matchMedia("(prefers-reduced-motion: reduce)");

export class GhostStroke {
  #running = true;

  /** pad: the Pad. session: the TouchSession. views: the LiveViews. state: the SceneState. */
  constructor({ pad, session, views, state }) {
    Object.assign(this, { pad, session, views });
    const end = () => this.end();
    for (const type of ["pointerdown", "keydown"]) addEventListener(type, end, { once: true, capture: true });
    session.addEventListener("player", end, { once: true });
    this.scene = state.scene;
    state.addEventListener("change", end, { once: true });
  }

  /** Makes the stroke. */
  async stroke() {
    const heard = this.#running ? await this.#rendered().catch(() => null) : null; // the page works without a ghost
    if (!heard || !this.#running) return;
    this.views.silent(heard.samples, heard);
    if (calm.matches) return this.end();
    const began = performance.now();
    const step = () => {
      if (!this.#running) return;
      const { length } = this.pad;
      const [moved, way] = [(SPEED * (performance.now() - began)) / 1e3, (TO - FROM) * length];
      if (moved > 2 * way) return this.end();
      this.views.ghost({ position: FROM * length + Math.min(moved, 2 * way - moved), load: null, y: 0 });
      requestAnimationFrame(step);
    };
    step();
  }

  /** Ends the stroke; what it has left stays until a sound. */
  end() {
    if (!this.#running) return;
    this.#running = false;
    this.views.ghost(null);
  }

  async #rendered() {
    const { scan: _, output: __, ...scene } = this.scene;
    const asked = { ...scene, scan: { speed: SPEED }, output: { sample_rate: RATE, duration: SPAN } };
    const answer = await callBinary("POST", "/v1/render?format=f32le", asked);
    const scale = Number(answer.headers.get("Ridgewave-Full-Scale").split(",")[0]);
    const quantity = answer.headers.get("Ridgewave-Quantities").split(",")[0];
    return { samples: new Float32Array(await answer.arrayBuffer()), scale, quantity, rate: RATE };
  }
}
