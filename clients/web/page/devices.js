/* The section Devices: output device and channels, where the browser offers a choice, and a gamepad that vibrates. */

import { byId, make } from "../dom.js";

export class Devices {
  motors = null; // loaded with the first use
  #strength = null; // {ready, threshold, of: the MotorStrength for them}

  /** session: the TouchSession. views: the LiveViews, which hold the detection threshold. tell(sentence). */
  constructor({ session, views, tell }) {
    Object.assign(this, { session, views, tell });
    session.addEventListener("player", ({ detail }) => this.#list(detail.player));
    session.addEventListener("block", ({ detail }) => this.#rumble(detail));
    byId("output").addEventListener("change", () => this.#use());
    byId("channels").addEventListener("change", () =>
      this.session.player?.useChannels(byId("channels").value.split(",").map(Number)),
    );
    byId("rumble").addEventListener("change", () => this.#load().then(() => this.#noteGamepads()));
    for (const type of ["gamepadconnected", "gamepaddisconnected"]) addEventListener(type, () => this.#noteGamepads());
    this.#noteGamepads();
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
      this.tell(`The output cannot be used: ${error.message}`);
    }
  }

  /** Loads the modules for motors, which few pages need. */
  async #load() {
    const [{ Motors }, { MotorStrength }] = await Promise.all([
      import("../motors/motors.js"),
      import("../motors/strength.js"),
    ]);
    this.MotorStrength = MotorStrength;
    this.motors ??= new Motors({ gamepads: () => [this.#gamepad()] });
  }

  #gamepad() {
    return (navigator.getGamepads?.() ?? [])[byId("gamepad").value] ?? null;
  }

  #noteGamepads() {
    const pads = [...(navigator.getGamepads?.() ?? [])].filter(Boolean);
    const chosen = byId("gamepad").value;
    byId("gamepad").replaceChildren(
      ...(pads.length
        ? pads.map(({ id, index }) => make("option", { value: index, text: id }))
        : [make("option", { value: "", text: "none connected" })]),
    );
    if (pads.some(({ index }) => String(index) === chosen)) byId("gamepad").value = chosen;
    byId("gamepad").disabled = !pads.length;
    if (!this.motors) return;
    if (!byId("rumble").checked) return this.motors.stop();
    if (pads.length && !this.motors.motors().length)
      this.tell("This browser cannot make this gamepad vibrate. Try another gamepad or another browser.");
  }

  /** Plays the strength of the first finger that touches, as the views show it. */
  #rumble({ unlimited, ready, finger }) {
    const { session } = this;
    if (!byId("rumble").checked || !this.motors) return;
    if (finger !== (session.fingers.find(({ touching }) => touching) ?? session.fingers[0])) return;
    const { threshold } = this.views;
    if (this.#strength?.ready !== ready || this.#strength.threshold !== threshold) {
      const { sample_rate: rate, quantities, full_scale: fullScale } = ready;
      const of = new this.MotorStrength({ rate, quantities, fullScale, threshold });
      this.#strength = { ready, threshold, of };
    }
    this.motors.push(this.#strength.of.push(unlimited));
  }
}
