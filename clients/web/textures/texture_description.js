/* What the page says of the chosen texture. */

import { make } from "../dom.js";
import { explanationOf } from "../explained.js";
import { orTell } from "../page/notice.js";
import { call, callBinary } from "../service.js";

/** What the page shows of the chosen texture: a picture, a sentence, and its numbers when opened. */
export class TextureDescription {
  #text;
  #picture = make("img", { id: "texture-picture", alt: "", hidden: true });
  #numbers = make("div");
  #summary = make("summary");
  #details = make("details", { id: "texture-sources", hidden: true }, this.#summary, this.#numbers);
  #entry; // null: none is chosen

  /** own: the arguments of an OwnTexture. */
  constructor(text, own) {
    this.#text = text;
    this.own = own;
    text.before(this.#picture);
    text.after(this.#details);
    this.#details.addEventListener("toggle", () => this.#details.open && this.#showNumbers(this.#entry));
  }

  /** Shows an entry of the TextureList; null for none, of which `sentence` tells. */
  show(entry, sentence) {
    if (!entry) this.#text.textContent = sentence;
    if (entry === this.#entry) return;
    const renamed = entry?.stored && entry.address === this.#entry?.address;
    this.#entry = entry;
    if (entry) this.#text.textContent = `${entry.title}. ${entry.note}`;
    this.#summary.textContent = entry?.stored ? "Measured values, rename, delete" : "Numbers and sources";
    this.#details.hidden = !entry;
    this.#details.open = Boolean(renamed && this.#details.open);
    if (this.#details.open) this.#showNumbers(entry);
    this.#draw(entry);
  }

  async #draw(entry) {
    this.#picture.hidden = true;
    if (!entry) return;
    const answer = await callBinary("GET", entry.picture).catch(() => null); // the menu works without its pictures
    const image = await answer?.blob();
    if (!image || entry !== this.#entry) return;
    URL.revokeObjectURL(this.#picture.src);
    this.#picture.src = URL.createObjectURL(image);
    this.#picture.alt = `5 mm of the surface, lit from the left: ${entry.title}`;
    this.#picture.hidden = false;
  }

  async #showNumbers(entry) {
    if (!entry) return;
    let shown;
    try {
      shown = entry.stored ? await this.#ownOf(entry) : await sourcesOf(entry);
    } catch (error) {
      shown = explanationOf(error);
    }
    if (entry !== this.#entry) return;
    const focused = this.#numbers.contains(document.activeElement); // after a rename
    this.#numbers.replaceChildren(shown);
    if (focused) this.#numbers.querySelector("input")?.focus();
  }

  async #ownOf(entry) {
    const loaded = await orTell(import("./own_texture.js"));
    return loaded ? new loaded.OwnTexture(entry, this.own).element : "Part of the page did not load. Open this again.";
  }
}

/** Returns the numbers of an entry of the catalogue with their sources, a line each. */
async function sourcesOf({ name }) {
  const { numbers } = await call("GET", `/v1/textures/${name}`);
  const lines = Object.entries(numbers).map(
    ([field, { value, source }]) => `${field} ${[value].flat().join(", ")} (${source})`,
  );
  return make("ul", {}, ...lines.map((text) => make("li", { text })));
}
