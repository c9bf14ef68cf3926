/* Where the sound goes, as far as the browser can choose: output device, its channels, and a gamepad that rumbles
along. */

import { byId, make } from "../knobs/element.js";

export class Devices {
  actuators = null; // once somebody asks for them
  #of = null; // the envelope, and the `ready` and threshold that it is for

  /** session: the Session. sight: knows what is just felt. tell(sentence). */
  constructor({ session, sight, tell }) {
    Object.assign(this, { session, sight, tell });
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
        make("option", { value: id, text: label || (id ? `Output ${index + 1}` : "The usual one") }),
      ),
    );
    byId("output-knob").hidden = outputs.length < 2;
    byId("output-about").textContent =
      outputs.length < 2
        ? "This browser plays on the system's output: choose it in the system."
        : "The list has the outputs that this browser may use.";
    this.#listChannels(player);
  }

  #listChannels(player) {
    const count = player.outputChannels;
    const pairs = Array.from({ length: Math.floor(count / 2) }, (_, index) => [2 * index, 2 * index + 1]);
    byId("channels").replaceChildren(
      ...pairs.map((pair) => make("option", { value: pair.join(), text: `${pair[0] + 1} and ${pair[1] + 1}` })),
    );
    byId("channels-knob").hidden = pairs.length < 2;
  }

  async #use() {
    try {
      await this.session.player?.useOutput(byId("output").value);
      this.#listChannels(this.session.player);
    } catch (error) {
      this.tell(`That output cannot be used: ${error.message}`);
    }
  }

  /** What only a page needs that makes a gamepad rumble. */
  async #load() {
    const [{ Actuators }, { Envelope }] = await Promise.all([
      import("../haptics/actuators.js"),
      import("../haptics/envelope.js"),
    ]);
    this.Envelope = Envelope;
    this.actuators ??= new Actuators({ gamepads: () => [this.#gamepad()] });
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
        : [make("option", { value: "", text: "none is known yet" })]),
    );
    if (pads.some(({ index }) => String(index) === chosen)) byId("gamepad").value = chosen;
    byId("gamepad").disabled = !pads.length;
    if (!this.actuators) return;
    if (!byId("rumble").checked) return this.actuators.stop();
    if (pads.length && !this.actuators.motors().length)
      this.tell("This browser cannot make that gamepad rumble: try another one, or another browser.");
  }

  /** Follows the finger that touches first, as the pictures do. */
  #rumble({ samples, ready, finger }) {
    const { session, sight } = this;
    if (!byId("rumble").checked || !this.actuators) return;
    if (finger !== (session.fingers.find(({ touching }) => touching) ?? session.fingers[0])) return;
    const felt = sight.felt;
    if (this.#of?.ready !== ready || this.#of.felt !== felt) {
      const { sample_rate: rate, quantities, full_scale: fullScale } = ready;
      this.#of = { ready, felt, envelope: new this.Envelope({ rate, quantities, fullScale, threshold: felt }) };
    }
    this.actuators.push(this.#of.envelope.push(samples));
  }
}
