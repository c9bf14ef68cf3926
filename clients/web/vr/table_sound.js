/* The sound of the table: one player, opened with the first gesture, and a Finger for each touched swatch.

Limits: browsers permit sound only after a click or key press. */

import { explanationOf } from "../explained.js";
import { Finger } from "../hand/finger.js";
import { Player, whySilent } from "../sound/player.js";

const RATE = 48000; // Hz, default of a scene
const ASLEEP = "The browser keeps this page silent until you click, press a key or lift your finger.";
const LOST = "The connection is lost. This page tries again.";

export class TableSound {
  /** The Player, null before the first gesture. */
  player = null;
  /** The open Fingers. */
  fingers = new Set();
  #opening = null;
  #volume;
  #muted = false;

  /** volume: 0 to 1. status: {text, say(text)} of the page. */
  constructor(volume, status) {
    this.#volume = volume;
    this.status = status;
  }

  get volume() {
    return this.#volume;
  }

  set volume(volume) {
    this.#volume = Math.min(1, Math.max(0, volume));
    this.#apply();
  }

  get muted() {
    return this.#muted;
  }

  set muted(muted) {
    this.#muted = muted;
    this.#apply();
  }

  /** Says why the page cannot sound, or nothing if it can. */
  tellSilence() {
    this.status.say(whySilent());
  }

  /** Opens the player once. Must be called in a user gesture. */
  begin() {
    this.#opening ??= Player.open({ sampleRate: RATE, latencyHint: "interactive" }).then(
      (player) => {
        this.player = player;
        this.#apply();
        player.addEventListener("awake", () => this.#tellAwake());
        this.#tellAwake();
        return player;
      },
      (error) => {
        this.#opening = null;
        this.status.say(explanationOf(error));
        return null;
      },
    );
    return this.#opening;
  }

  /** Returns an open Finger for a scene, null before the sound has begun. signal: an AbortSignal that ends the opening. */
  async openFinger(scene, signal) {
    const player = await this.#opening;
    if (!player || this.#muted || signal?.aborted) return null;
    const finger = new Finger({ player, scene });
    this.fingers.add(finger);
    signal?.addEventListener("abort", () => finger.close());
    this.#tellOf(finger);
    await finger.open();
    return finger;
  }

  #tellOf(finger) {
    const { status } = this;
    finger.addEventListener("problem", ({ detail: { problem } }) => status.say(problem.detail ?? problem.title));
    finger.addEventListener("broken", () => status.text || status.say(LOST));
    for (const kind of ["ready", "resumed"])
      finger.addEventListener(kind, () => {
        status.say("");
        this.#tellAwake();
      });
    finger.addEventListener("ended", () => {
      this.fingers.delete(finger);
      if (!this.fingers.size && status.text === LOST) status.say("");
    });
  }

  /** Tells the user while the browser does not permit sound. */
  #tellAwake() {
    if (!this.player.awake) this.status.say(ASLEEP);
    else if (this.status.text === ASLEEP) this.status.say("");
  }

  #apply() {
    if (this.player) this.player.volume = this.#muted ? 0 : this.#volume;
  }
}
