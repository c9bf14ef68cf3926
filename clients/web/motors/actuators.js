/* The motors of one gamepad or controller, whatever its browser offers: one Motor for all ways to play it.

Model: a way is an effect of `playEffect` that the list `effects` names, or `pulse`. The first way plays. If it refuses
(rejects, throws, answers "not-supported") or gives no answer, the next way plays the same strength. A way that fails
FAILURES times in a row is given up.
Source: Gamepad Extensions (W3C) for `vibrationActuator`; WebXR Gamepads Module for `hapticActuators`. Older browsers have
`type` in place of `effects`, only `pulse`, or `hapticActuators` on an ordinary gamepad.
Limits: an actuator that answers but does not move is not noticed. */

const EFFECTS = ["dual-rumble", "trigger-rumble"]; // the best first: triggers are small
const REFUSALS = ["not-supported", "invalid-parameter"]; // answers of older browsers, which do not reject
const PATIENCE = 1000; // ms beyond an effect until its answer counts as missing; shorter gives up slow radio links
const FAILURES = 3; // in a row; fewer would give up a motor after one lost radio message

/** Returns the ways to play one actuator, the best first: {form, play(strength, ms)}. */
function waysOf(actuator) {
  const ways = [];
  if (typeof actuator?.playEffect === "function")
    for (const form of effectsOf(actuator))
      ways.push({ form, play: (strength, duration) => actuator.playEffect(form, effect(form, strength, duration)) });
  if (typeof actuator?.pulse === "function")
    ways.push({ form: "pulse", play: (strength, duration) => actuator.pulse(strength, duration) });
  return ways;
}

function effectsOf({ effects, type }) {
  if (effects) return EFFECTS.filter((one) => [...effects].includes(one));
  return [EFFECTS.includes(type) ? type : EFFECTS[0]];
}

function effect(form, strength, duration) {
  const both = { duration, strongMagnitude: strength, weakMagnitude: strength };
  return form === "trigger-rumble" ? { ...both, leftTrigger: strength, rightTrigger: strength } : both;
}

/** Returns the ways to play a gamepad: those of its `vibrationActuator` if it is not one of the `hapticActuators`, then
 *  all of these at once. */
function waysOfGamepad({ vibrationActuator, hapticActuators }) {
  const listed = [...(hapticActuators ?? [])];
  const plural = listed.map((one) => new Motor(waysOf(one))).filter(({ works }) => works);
  const play = (strength, duration) =>
    Promise.any(plural.map(async (motor) => (await motor.play(strength, duration)) || Promise.reject(new Error())));
  const singular = listed.includes(vibrationActuator) ? [] : waysOf(vibrationActuator);
  return [...singular, ...(plural.length ? [{ form: plural[0].form, play }] : [])];
}

/** Returns the Motor of a gamepad. onRefused(): called once, when it has no way left. */
export function motorOf(gamepad, onRefused) {
  return new Motor(waysIn(gamepad), onRefused);
}

/** Returns the ways of `gamepad`; none if its browser throws when the page asks. */
function waysIn(gamepad) {
  try {
    return waysOfGamepad(gamepad);
  } catch {
    return [];
  }
}

class Motor {
  #ways;
  #turn = 0;

  constructor(ways, onRefused = () => {}) {
    this.#ways = ways.map((way) => ({ ...way, failures: 0 }));
    this.onRefused = onRefused;
  }

  /** Whether there is a way left. */
  get works() {
    return this.#ways.length > 0;
  }

  /** The present way: "dual-rumble", "trigger-rumble" or "pulse". */
  get form() {
    return this.#ways[0]?.form;
  }

  /** Plays a strength, 0 to 1, for so many ms. Returns whether it was accepted. Never rejects. */
  async play(strength, duration) {
    this.#turn += 1;
    const turn = this.#turn;
    for (const way of [...this.#ways]) {
      if (await this.#accepts(way, strength, duration)) return true;
      if (turn !== this.#turn) return false; // a newer strength is played, so this one is out of date
    }
    return false;
  }

  async #accepts(way, strength, duration) {
    try {
      const answer = await inTime(way.play(strength, duration), duration + PATIENCE);
      if (answer === false || REFUSALS.includes(answer)) throw new Error(answer);
      way.failures = 0;
      return true;
    } catch (problem) {
      const passing = document.hidden || problem?.name === "AbortError"; // a hidden page may not vibrate
      if (!passing) this.#fail(way);
      return passing;
    }
  }

  #fail(way) {
    way.failures += 1;
    if (way.failures < FAILURES || !this.#ways.includes(way)) return;
    this.#ways = this.#ways.filter((one) => one !== way);
    if (!this.works) this.onRefused();
  }
}

/** Resolves as `promise` does; rejects if it takes longer than so many ms. */
function inTime(promise, milliseconds) {
  let timer;
  const late = new Promise((_, reject) => {
    timer = setTimeout(() => reject(new Error("no answer")), milliseconds);
  });
  return Promise.race([promise, late]).finally(() => clearTimeout(timer));
}
