/* The motors of gamepads and of the controllers of a headset.

Model: strengths come every 10 ms (strength.js). Every 50 ms the motors play the largest of them, for 80 ms so that
there are no gaps. Motors at rest receive nothing.
Limits: motors play a strength, not a waveform. Browsers list a gamepad only after one of its buttons was pressed. */

const PERIOD = 50; // ms between effects: gamepads accept some 20 per second
const LENGTH = 80; // ms of an effect; the next one replaces it
const STRENGTHS = PERIOD / 10;

export class Motors {
  #session = null;
  #strongest = 0;
  #count = 0;
  #moving = false;

  /** gamepads(): returns the gamepads; entries may be null. */
  constructor({ gamepads = () => navigator.getGamepads?.() ?? [] } = {}) {
    this.gamepads = gamepads;
  }

  /** Adds the controllers of an XRSession; null removes them. */
  follow(session) {
    this.#session = session;
  }

  /** Returns the present motors: {name, form, hand, play(strength, ms)}. strength: 0 to 1. form: "dual-rumble" or
   *  "pulse". */
  motors() {
    const sources = [...(this.#session?.inputSources ?? [])];
    const pads = [...this.gamepads()].map((gamepad) => ({ gamepad, handedness: "" }));
    return [...pads, ...sources].flatMap(({ gamepad, handedness }) => motorsOf(gamepad, handedness));
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
      if (!hand || !motor.hand || motor.hand === hand) motor.play(strength, LENGTH);
    }
  }
}

function motorsOf(gamepad, hand) {
  if (!gamepad) return [];
  const name = gamepad.id;
  const { vibrationActuator } = gamepad;
  if (vibrationActuator?.playEffect) {
    const play = (strength, duration) =>
      quietly(
        vibrationActuator.playEffect("dual-rumble", { duration, strongMagnitude: strength, weakMagnitude: strength }),
      );
    return [{ name, form: "dual-rumble", hand, play }];
  }
  return [...(gamepad.hapticActuators ?? [])]
    .filter((actuator) => actuator?.pulse)
    .map((actuator) => ({
      name,
      form: "pulse",
      hand,
      play: (strength, duration) => quietly(actuator.pulse(strength, duration)),
    }));
}

/** Ignores errors of devices that were unplugged meanwhile. */
function quietly(promise) {
  Promise.resolve(promise).catch(() => {});
}
