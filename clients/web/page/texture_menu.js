/* The menu of textures: a sinusoid, the catalogue by groups, and the imported textures. It shows a picture of the chosen
texture, and its numbers with their sources or its measured values. A texture that is none of these is shown by its kind,
as a choice that cannot be made here. */

import { byId, make } from "../dom.js";
import { call, callBinary } from "../service.js";
import { wireImport } from "../textures/import_control.js";
import { byGroup } from "../textures/groups.js";

const SINUSOID = "sinusoid";

/** Connects the menu to `state`, a SceneState. textures: the TextureList. tell(sentence). */
export function wireTextureMenu({ state, textures, tell }) {
  const menu = byId("texture");
  const other = make("option", { value: "", hidden: true });
  const onDeleted = () => {
    state.write(["texture"], undefined);
    menu.focus(); // the button that deleted is gone
  };
  const about = new TextureDescription(byId("texture-about"), { textures, onDeleted, tell });
  const fill = () => {
    const groups = byGroup(textures.entries);
    const sinusoid = make("option", { value: SINUSOID, text: "Sinusoid" });
    menu.replaceChildren(other, sinusoid, ...groups.map(optionGroup));
  };
  const show = (wanted = menu.value) => {
    const { texture } = state.scene;
    const entries = textures.of(texture); // several if a surface was imported under several names
    const chosen = entries.find(({ name }) => name === wanted) ?? entries[0] ?? null;
    const kind = texture?.kind ?? SINUSOID;
    const { title, sentence } = unlisted(kind, texture?.surface);
    other.textContent = title;
    menu.value = chosen?.name ?? (kind === SINUSOID ? SINUSOID : other.value);
    about.show(chosen, sentence);
  };
  const choose = (name) => {
    const entry = textures.entries.find((one) => one.name === name);
    if (entry?.stored) state.write(["texture"], entry.scene.texture);
    else state.write(["texture", "kind"], entry?.name);
    show(name);
  };
  const refill = () => {
    const { value } = menu;
    fill();
    show(value);
  };
  const onKept = async (name) => {
    await textures.reload();
    choose(name);
    tell(`${name} is kept, and in the menu under “Yours”.`);
  };
  fill();
  menu.addEventListener("change", () => choose(menu.value));
  state.addEventListener("change", () => show());
  textures.addEventListener("change", refill);
  wireImport({ onKept, tell });
}

const titleOf = ({ name, title, stored }) => (stored ? name : title.split(":")[0].replace(" um", " µm"));

/** Returns {title, sentence} of a texture that is no entry of the list. surface: the address of a measured one. */
function unlisted(kind, surface) {
  if (kind === SINUSOID) return { title: "", sentence: "A sinusoid. Set its period and height under Scene, Texture." };
  if (surface)
    return { title: "A surface that is not listed", sentence: "A measured surface that is not in the menu." };
  const name = String(kind); // a link may hold anything
  const title = name.charAt(0).toUpperCase() + name.slice(1);
  return { title, sentence: `A texture of the kind “${name}”. Set its fields under Scene, Texture.` };
}

function optionGroup([label, entries]) {
  const option = (entry) => make("option", { value: entry.name, text: titleOf(entry) });
  return make("optgroup", { label }, ...entries.map(option));
}

/** What the page shows of the chosen texture: a picture, a sentence, and its numbers when opened. */
class TextureDescription {
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
    let shown;
    try {
      shown = entry.stored ? await this.#ownOf(entry) : await sourcesOf(entry);
    } catch ({ message }) {
      shown = message;
    }
    if (entry !== this.#entry) return;
    const focused = this.#numbers.contains(document.activeElement); // after a rename
    this.#numbers.replaceChildren(shown);
    if (focused) this.#numbers.querySelector("input")?.focus();
  }

  async #ownOf(entry) {
    const { OwnTexture } = await import("../textures/own_texture.js");
    return new OwnTexture(entry, this.own).element;
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
