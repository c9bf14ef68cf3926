/* The section Devices: output device and channels, where the browser offers a choice, and what vibrates.

Model: one switch for the chosen gamepad and, where none vibrates, the phone. It begins on for a phone, and the browser
keeps what the user chose. Motors play while the first finger touches and the page is shown. */

import { byId, make } from "../dom.js";
import { explanationOf } from "../explained.js";
import { orTell } from "./notice.js";

const CHOICE = "ridgewave.vibrate"; // in the storage of the browser: "on" or "off"

/** Desktop browsers have `navigator.vibrate` without a motor; Safari has none. */
const isHandheld = () => matchMedia("(pointer: coarse)").matches;
const canVibrate = () => isHandheld() && typeof navigator.vibrate === "function";
const ANOTHER = "Try another gamepad or another browser.";

export class Devices {
  motors = null; // loaded with the first use
  #strength = null; // {ready, threshold, of: the MotorStrength for them}
  #told = ""; // the last problem of a motor

  /** session: the TouchSession. views: the LiveViews, which hold the detection threshold. tell(sentence). */
  constructor({ session, views, tell }) {
    Object.assign(this, { session, views, tell });
    session.addEventListener("player", ({ detail }) => this.#list(detail.player));
    session.addEventListener("block", ({ detail }) => this.#rumble(detail));
    byId("output").addEventListener("change", () => this.#use());
    byId("channels").addEventListener("change", () =>
      this.session.player?.useChannels(byId("channels").value.split(",").map(Number)),
    );
    session.addEventListener("state", ({ detail }) => detail.state === "not started" && this.motors?.stop());
    document.addEventListener("visibilitychange", () => document.hidden && this.motors?.stop());
    byId("rumble").checked = isWanted();
    byId("rumble").addEventListener("change", () => this.#switch());
    byId("gamepad").addEventListener("change", () => this.#noteMotors());
    for (const type of ["gamepadconnected", "gamepaddisconnected"]) addEventListener(type, () => this.#noteGamepads());
    this.#noteGamepads();
    if (byId("rumble").checked) this.#load();
  }

  async #list(player) {
    const outputs = await player.outputs().catch(() => []);
    byId("output").replaceChildren(
      ...outputs.map(({ id, label }, index) =>
        make("option", { value: id, text: label || (id ? `Output ${index + 1}` : "Default output") }),
      ),
    );
    byId("output-field").hidden = outputs.length < 2;
    byId("output-about").textContent =
      outputs.length < 2
        ? "This browser cannot choose an output. Choose it in the system settings."
        : "These are the outputs that this browser can use.";
    this.#listChannels(player);
  }

  #listChannels(player) {
    const count = player.outputChannels;
    const pairs = Array.from({ length: Math.floor(count / 2) }, (_, index) => [2 * index, 2 * index + 1]);
    byId("channels").replaceChildren(
      ...pairs.map((pair) => make("option", { value: pair.join(), text: `${pair[0] + 1} and ${pair[1] + 1}` })),
    );
    byId("channels-field").hidden = pairs.length < 2;
  }

  async #use() {
    try {
      await this.session.player?.useOutput(byId("output").value);
      this.#listChannels(this.session.player);
    } catch (error) {
      this.tell(explanationOf(error, "This output cannot be used. Choose another one."));
    }
  }

  /** Loads the modules for motors, which few pages need. */
  async #load() {
    const loaded = await orTell(Promise.all([import("../motors/motors.js"), import("../motors/strength.js")]));
    if (!loaded) {
      byId("rumble").checked = false;
      return;
    }
    const [{ Motors }, { MotorStrength }] = loaded;
    this.MotorStrength = MotorStrength;
    const onRefused = (name) =>
      this.#noteMotors(`${name} does not vibrate: it refuses every effect, or does not answer. ${ANOTHER}`);
    this.motors ??= new Motors({ gamepads: () => [this.#gamepad()], withPhone: canVibrate(), onRefused });
    this.#noteMotors();
  }

  #switch() {
    const { checked } = byId("rumble");
    keep(checked);
    this.motors?.stop();
    this.motors?.forget();
    if (checked) return this.#load();
    this.#noteMotors();
  }

  #gamepad() {
    return listed()[byId("gamepad").value] ?? null;
  }

  #noteGamepads() {
    const pads = [...listed()].filter(Boolean);
    const chosen = byId("gamepad").value;
    byId("gamepad").replaceChildren(
      ...(pads.length
        ? pads.map(({ id, index }) => make("option", { value: index, text: id }))
        : [make("option", { value: "", text: "none connected" })]),
    );
    if (pads.some(({ index }) => String(index) === chosen)) byId("gamepad").value = chosen;
    byId("gamepad").disabled = !pads.length;
    this.motors?.forget();
    this.#noteMotors();
  }

  /** Says what vibrates. refused: a sentence about a gamepad that turned out not to; otherwise "". */
  #noteMotors(refused = "") {
    const on = byId("rumble").checked && this.motors;
    const [motor] = on ? this.motors.motors() : [];
    const gamepad = this.#gamepad();
    const mute =
      on && gamepad && motor?.name !== gamepad.id ? `This browser cannot make ${gamepad.id} vibrate. ${ANOTHER}` : "";
    const problem = refused || mute;
    if (problem && problem !== this.#told) this.tell(problem);
    this.#told = problem;
    byId("rumble-state").textContent = [problem, on ? whatVibrates(motor, gamepad) : ""].filter(Boolean).join(" ");
  }

  /** Plays the strength of the first finger that touches, as the views show it. */
  #rumble({ unlimited, ready, finger }) {
    const { session } = this;
    if (!byId("rumble").checked || !this.motors) return;
    if (finger !== (session.fingers.find(({ touching }) => touching) ?? session.fingers[0])) return;
    if (!finger.touching || document.hidden) return this.motors.stop();
    const { threshold } = this.views;
    if (this.#strength?.ready !== ready || this.#strength.threshold !== threshold) {
      const { sample_rate: rate, quantities, full_scale: fullScale } = ready;
      const of = new this.MotorStrength({ rate, quantities, fullScale, threshold });
      this.#strength = { ready, threshold, of };
    }
    this.motors.push(this.#strength.of.push(unlimited));
  }
}

/** Returns a sentence about `motor`, one of `Motors.motors()`. gamepad: the chosen one, or null. */
function whatVibrates(motor, gamepad) {
  if (motor?.form === "pulses") return "This phone vibrates in pulses, longer ones where the vibration is stronger.";
  if (motor) return `${motor.name} vibrates.`;
  if (gamepad) return "";
  if (isHandheld())
    return "This browser cannot make this device vibrate. Connect a gamepad and press one of its buttons.";
  return "Connect a gamepad and press one of its buttons.";
}

/** Returns the gamepads that the browser lists; entries may be null. */
function listed() {
  try {
    return navigator.getGamepads?.() ?? [];
  } catch {
    return []; // a page in a frame may not ask
  }
}

function isWanted() {
  try {
    const kept = localStorage.getItem(CHOICE);
    if (kept) return kept === "on";
  } catch {
    /* no storage: as on the first visit */
  }
  return canVibrate();
}

function keep(on) {
  try {
    localStorage.setItem(CHOICE, on ? "on" : "off");
  } catch {
    /* no storage: the choice lasts as long as the page */
  }
}
