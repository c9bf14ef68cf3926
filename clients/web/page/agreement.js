/* Whether what is seen and heard is of the scene: what is not yet is greyed, and says so.

Model: sound, picture and plan each stand somewhere: "there", "coming", "refused" (it stays that of the scene before),
or "none"; the output is "awake" or "asleep". The pad is picture and instrument at once: it is grey until both are of the scene. */

import { byId } from "../knobs/element.js";

const GREY = { pad: ["sound", "picture"], contact: ["sound", "picture"], waveform: ["sound"], spectrum: ["sound"] };
const ASLEEP = "Silent so far: the browser lets the page sound once you lift your finger, click or press a key.";

export class Agreement {
  #stands = {};

  /** Tell that `part` stands `how`. */
  set(part, how) {
    if (this.#stands[part] === how) return;
    this.#stands[part] = how;
    for (const [id, parts] of Object.entries(GREY)) {
      const place = byId(id).closest("figure") ?? byId(id);
      place.toggleAttribute(
        "data-stale",
        parts.some((one) => this.#isLate(one)),
      );
    }
    document.querySelector(".planning").toggleAttribute("data-stale", this.#isLate("plan"));
    byId("pad-note").textContent = this.#sentence();
    byId("pad-note").hidden = !byId("pad-note").textContent;
  }

  #isLate(part) {
    return ["coming", "refused"].includes(this.#stands[part]);
  }

  #sentence() {
    const late = ["sound", "picture"].filter((part) => this.#isLate(part));
    if (this.#stands.output === "asleep") return ASLEEP;
    if (!late.length) return "";
    if (late.some((part) => this.#stands[part] === "refused"))
      return "This scene is refused: what you see and hear is of the one before.";
    return `Not yet of this scene: the ${late.join(" and the ")}.`;
  }
}
