/* Greys the parts of the page that do not show or play the present scene yet, and says which.

Model: sound, picture and plan each have a status: "current", "pending", "refused" (the part still belongs to the
previous scene) or "none". The output is "awake" or "asleep". The pad shows the picture and plays the sound: it is
grey until both are current. */

import { byId } from "../dom.js";

const GREY = { pad: ["sound", "picture"], contact: ["sound", "picture"], waveform: ["sound"], spectrum: ["sound"] };
const ASLEEP = "The browser keeps this page silent until you click, press a key or lift your finger.";

export class StaleParts {
  #status = {};

  /** Sets the status of "sound", "picture", "plan" or "output". */
  set(part, status) {
    if (this.#status[part] === status) return;
    this.#status[part] = status;
    for (const [id, parts] of Object.entries(GREY)) {
      const place = byId(id).closest("figure") ?? byId(id);
      place.toggleAttribute(
        "data-stale",
        parts.some((one) => this.#isLate(one)),
      );
    }
    document.querySelector(".plan-section").toggleAttribute("data-stale", this.#isLate("plan"));
    byId("pad-note").textContent = this.#sentence();
    byId("pad-note").hidden = !byId("pad-note").textContent;
  }

  #isLate(part) {
    return ["pending", "refused"].includes(this.#status[part]);
  }

  #sentence() {
    const late = ["sound", "picture"].filter((part) => this.#isLate(part));
    if (this.#status.output === "asleep") return ASLEEP;
    if (!late.length) return "";
    if (late.some((part) => this.#status[part] === "refused"))
      return "This scene is refused. Picture and sound still belong to the previous scene.";
    return `Not updated yet: ${late.join(" and ")}.`;
  }
}
