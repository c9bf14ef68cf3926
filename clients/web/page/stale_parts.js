/* Greys the parts of the page that do not show or play the present scene, and says why.

Model: sound, picture and plan each have a status: "current", "pending", why there is none (status_texts.js), or "none".
A part that was never current shows nothing, otherwise it shows an earlier scene. The output is "awake" or "asleep". The
pad shows the picture and plays the sound: it is grey until both are current. */

import { byId, make } from "../dom.js";
import { whySilent } from "../sound/player.js";
import { padSentence } from "./status_texts.js";

const GREY = { contact: ["picture", "sound"], waveform: ["sound"], spectrum: ["sound"] };
const SAME_SCENE = ["current", "none", "broken", "full"]; // statuses of a part that shows the present scene
const SILENT = ["broken", "full"]; // statuses of a sound that cannot be played

export class StaleParts {
  #status = {};
  #shown = new Set(); // parts that were current once

  /** Sets the status of "sound", "picture", "plan" or "output". */
  set(part, status) {
    if (this.#status[part] === status) return;
    this.#status[part] = status;
    if (status === "current") this.#shown.add(part);
    for (const [id, parts] of Object.entries(GREY)) this.#mark(byId(id).closest("figure"), parts);
    this.#mark(document.querySelector(".plan-section"), ["plan"]);
    this.#mark(byId("pad"), ["sound", "picture"], SILENT.includes(this.#status.sound));
    const note = padSentence({ ...this.#status, silent: whySilent(), shown: this.#shown.has("picture") });
    const place = byId("pad-note");
    if (place.textContent !== note) place.replaceChildren(make("span", { text: note })); // a new element moves nothing
    place.hidden = !note;
    byId("pad").toggleAttribute("data-noted", Boolean(note));
  }

  /** Greys `place` if one of `parts` is not of the present scene; its title says so (page.css). */
  #mark(place, parts, grey = false) {
    const late = parts.find((one) => one in this.#status && !SAME_SCENE.includes(this.#status[one]));
    place.toggleAttribute("data-stale", Boolean(late) || grey);
    if (late) place.dataset.stale = late === "sound" || this.#shown.has(late) ? "" : "empty";
  }
}
