/* The motors of the controllers: each plays the strength (motors/strength.js) of the vibration of its hand.

Limits: a motor has one frequency. Tracked hands have no motor. The motors run ahead of the sound by the queue of the
player. */

import { Motors } from "../motors/motors.js";
import { MotorStrength } from "../motors/strength.js";

export class ControllerMotors {
  /** @param {{frequencies: number[], displacement: number[]} | null} threshold answer of
   *  `GET /v1/threshold`: Hz, and m (peak)
   * @param {(hand: string) => void} onRefused the controller of a hand has refused every effect */
  constructor(threshold, onRefused = () => {}) {
    Object.assign(this, { threshold, onRefused });
    this.session = null;
    this.motors = new Map();
    this.strengths = new WeakMap();
  }

  /** @param {XRSession | null} session with the controllers to use; null: none */
  follow(session) {
    this.#release();
    this.session = session;
    session?.addEventListener("inputsourceschange", () => this.#release());
  }

  /** Stops the motors, and looks for those of each hand anew when it next touches. */
  #release() {
    for (const motor of this.motors.values()) motor.stop();
    this.motors.clear();
  }

  /**
   * @param {string} hand "left", "right" or "none"
   * @param {Finger} finger
   * @param {Float32Array} samples a block of the finger, channels interleaved, 1.0 = full scale
   */
  play(hand, finger, samples) {
    if (!this.session) return;
    const { sample_rate: rate, quantities, full_scale: fullScale } = finger.connection.ready;
    const { threshold } = this;
    if (!this.strengths.has(finger)) {
      this.strengths.set(finger, new MotorStrength({ rate, quantities, fullScale, threshold }));
    }
    this.#motor(hand).push(this.strengths.get(finger).push(samples), hand);
  }

  /** Stops the motor of a hand. @param {string} hand */
  stop(hand) {
    this.motors.get(hand)?.stop();
  }

  #motor(hand) {
    if (!this.motors.has(hand)) {
      const motor = new Motors({ gamepads: () => [], onRefused: () => this.onRefused(hand) });
      motor.follow({ inputSources: [...this.session.inputSources].filter(({ handedness }) => handedness === hand) });
      this.motors.set(hand, motor);
    }
    return this.motors.get(hand);
  }
}
