/* Motors that a page can reach: those of gamepads, and of the controllers of a headset.

`strengths` come each 10 ms (envelope.js). A motor is told the strongest of each 50 ms, for a little longer than that,
so that effects join; it is told nothing while there is nothing to feel.
Limits: a strength, never a waveform. What a device makes of it is its maker's affair. A gamepad shows up when one of
its buttons was pressed. */

const PERIOD = 50; // ms between two effects: gamepads take no more than some 20 a second
const LENGTH = 80; // ms of an effect; the next takes its place
const STRENGTHS = PERIOD / 10;

export class Actuators {
  #session = null;
  #strongest = 0;
  #count = 0;
  #moving = false;

  /** gamepads: gives the gamepads that there are, with nulls between. */
  constructor({ gamepads = () => navigator.getGamepads?.() ?? [] } = {}) {
    this.gamepads = gamepads;
  }

  /** Uses the controllers of an XRSession too; null when it has ended. */
  follow(session) {
    this.#session = session;
  }

  /** Returns the motors that there are now: {name, form, hand, play(strength 0 to 1, ms)}; form is "dual-rumble" or
   *  "pulse". */
  motors() {
    const sources = [...(this.#session?.inputSources ?? [])];
    const pads = [...this.gamepads()].map((gamepad) => ({ gamepad, handedness: "" }));
    return [...pads, ...sources].flatMap(({ gamepad, handedness }) => motorsOf(gamepad, handedness));
  }

  /** Takes strengths, 0 to 1, in their order, 10 ms each; hand: "left", "right", or all where absent. */
  push(strengths, hand) {
    for (const strength of strengths) {
      this.#strongest = Math.max(this.#strongest, strength);
      this.#count += 1;
      if (this.#count < STRENGTHS) continue;
      this.#play(this.#strongest, hand);
      this.#strongest = this.#count = 0;
    }
  }

  /** Stills all motors. */
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

/** A device that was unplugged meanwhile is none that a person has to hear of. */
function quietly(promise) {
  Promise.resolve(promise).catch(() => {});
}
