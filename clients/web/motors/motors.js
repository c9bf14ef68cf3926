/* The motors of gamepads, of the controllers of a headset, and of a phone.

Model: strengths come every 10 ms (strength.js). Every 50 ms the motors play the largest of them, for 80 ms so that
there are no gaps; a phone plays pulses (phone.js). Motors at rest receive nothing.
Limits: motors play a strength, not a waveform. Browsers list a gamepad only after one of its buttons was pressed. */

import { motorOf } from "./actuators.js";
import { phone } from "./phone.js";

const PERIOD = 50; // ms between effects: gamepads accept some 20 per second
const LENGTH = 80; // ms of an effect; the next one replaces it
const STRENGTHS = PERIOD / 10;

export class Motors {
  #session = null;
  #strongest = 0;
  #count = 0;
  #moving = false;
  #known = new WeakMap(); // actuator -> its Motor, with the ways that it has refused

  /** gamepads(): returns the gamepads; entries may be null. withPhone: whether a phone vibrates where no gamepad does.
   *  onRefused(name): a gamepad has refused every effect. */
  constructor({ gamepads = () => navigator.getGamepads?.() ?? [], withPhone = false, onRefused = () => {} } = {}) {
    Object.assign(this, { gamepads, withPhone, onRefused });
  }

  /** Adds the controllers of an XRSession; null removes them. */
  follow(session) {
    this.#session = session;
  }

  /** Tries again what motors have refused. */
  forget() {
    this.#known = new WeakMap();
  }

  /** Returns the present motors: {name, form, hand, play(strength, ms)}. strength: 0 to 1. form: "dual-rumble",
   *  "trigger-rumble", "pulse", or "pulses" of the phone. */
  motors() {
    const sources = [...(this.#session?.inputSources ?? [])];
    const connected = [...this.gamepads()].filter((gamepad) => gamepad && gamepad.connected !== false);
    const pads = connected.map((gamepad) => ({ gamepad, handedness: "" }));
    const found = [...pads, ...sources].flatMap(({ gamepad, handedness }) => this.#motorsOf(gamepad, handedness));
    return !found.length && this.withPhone ? [phone] : found;
  }

  /** Plays strengths, 0 to 1, of 10 ms each. hand: "left" or "right"; absent: all. */
  push(strengths, hand) {
    for (const strength of strengths) {
      this.#strongest = Math.max(this.#strongest, strength);
      this.#count += 1;
      if (this.#count < STRENGTHS) continue;
      this.#play(this.#strongest, hand);
      this.#strongest = this.#count = 0;
    }
  }

  /** Stops all motors. */
  stop() {
    this.#strongest = this.#count = 0;
    this.#play(0);
  }

  #play(strength, hand) {
    if (strength === 0 && !this.#moving) return;
    this.#moving = strength > 0;
    for (const motor of this.motors()) {
      const length = motor === phone ? PERIOD : LENGTH;
      if (!hand || !motor.hand || motor.hand === hand) motor.play(strength, length);
    }
  }

  #motorsOf(gamepad, hand) {
    if (!gamepad) return [];
    const name = gamepad.id;
    const key = actuatorOf(gamepad);
    if (!key) return [];
    if (!this.#known.has(key))
      this.#known.set(
        key,
        motorOf(gamepad, () => this.onRefused(name)),
      );
    const motor = this.#known.get(key);
    const play = (strength, duration) => motor.play(strength, duration);
    return motor.works ? [{ name, form: motor.form, hand, play }] : [];
  }
}

/** Returns the first actuator of `gamepad`, null if there is none or the browser does not let the page have it. */
function actuatorOf(gamepad) {
  try {
    return gamepad.vibrationActuator ?? gamepad.hapticActuators?.[0] ?? null;
  } catch {
    return null;
  }
}
