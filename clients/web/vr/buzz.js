/* What the motors of controllers make of the vibration: each follows the sound of its own hand.

Model: strengths of haptics/envelope.js: what a fingertip feels of the vibration.
Limits: a controller has a motor of one pitch; a tracked hand has none, and feels nothing. Blocks come ahead of their
sound by what the player keeps queued. */

import { Actuators } from "../haptics/actuators.js";
import { Envelope } from "../haptics/envelope.js";

export class Buzz {
  /** @param {{frequencies: number[], displacement: number[]} | null} threshold what is just felt: Hz, and m peak */
  constructor(threshold) {
    this.threshold = threshold;
    this.session = null;
    this.motors = new Map();
    this.envelopes = new WeakMap();
  }

  /** @param {XRSession | null} session whose controllers are used from now on */
  follow(session) {
    for (const motor of this.motors.values()) motor.stop();
    this.motors.clear();
    this.session = session;
  }

  /**
   * @param {string} hand "left", "right" or "none"
   * @param {Finger} finger whose samples they are
   * @param {Float32Array} samples of one block, channels interleaved, 1.0 = full scale
   */
  feel(hand, finger, samples) {
    if (!this.session) return;
    const { sample_rate: rate, quantities, full_scale: fullScale } = finger.connection.ready;
    const { threshold } = this;
    if (!this.envelopes.has(finger)) {
      this.envelopes.set(finger, new Envelope({ rate, quantities, fullScale, threshold }));
    }
    this.#motor(hand).push(this.envelopes.get(finger).push(samples), hand);
  }

  /** Stills the motor of a hand. @param {string} hand */
  rest(hand) {
    this.motors.get(hand)?.stop();
  }

  #motor(hand) {
    if (!this.motors.has(hand)) {
      const motor = new Actuators({ gamepads: () => [] });
      motor.follow({ inputSources: [...this.session.inputSources].filter(({ handedness }) => handedness === hand) });
      this.motors.set(hand, motor);
    }
    return this.motors.get(hand);
  }
}
