/* The menu of textures: a sinusoid, and the catalogue by groups, with a picture of the chosen one and its sources. */

import { byId, make } from "../dom.js";
import { call, callBinary } from "../service.js";

const SINUSOID = "sinusoid";

/** Connects the menu to `state`, a SceneState. catalogue: the entries of `GET /v1/textures`. */
export function wireTextureMenu(state, catalogue) {
  const menu = byId("texture");
  const about = new TextureDescription(menu, byId("texture-about"));
  const groups = Map.groupBy(catalogue, ({ group }) => group);
  menu.append(make("option", { value: SINUSOID, text: "Sinusoid" }), ...[...groups].map(optionGroup));
  menu.addEventListener("change", () =>
    state.write(["texture", "kind"], menu.value === SINUSOID ? undefined : menu.value),
  );
  state.addEventListener("change", ({ detail: { scene } }) => {
    const chosen = catalogue.find(({ name }) => name === scene.texture?.kind);
    menu.value = chosen?.name ?? SINUSOID;
    about.show(chosen ?? null);
  });
}

function optionGroup([label, entries]) {
  const option = ({ name, title }) => make("option", { value: name, text: title.split(":")[0].replace(" um", " µm") });
  return make("optgroup", { label }, ...entries.map(option));
}

/** What the page tells of the chosen texture: a picture before the menu, a sentence, and its numbers when opened. */
class TextureDescription {
  #text;
  #picture = make("img", { id: "texture-picture", alt: "", hidden: true });
  #list = make("ul");
  #sources = make(
    "details",
    { id: "texture-sources", hidden: true },
    make("summary", { text: "Numbers and sources" }),
    this.#list,
  );
  #entry; // null: none is chosen

  constructor(menu, text) {
    this.#text = text;
    menu.before(this.#picture);
    text.after(this.#sources);
    this.#sources.addEventListener("toggle", () => this.#sources.open && this.#listNumbers(this.#entry));
  }

  /** Shows an entry of the catalogue; null for none. */
  show(entry) {
    if (entry === this.#entry) return;
    this.#entry = entry;
    this.#text.textContent = entry
      ? `${entry.title}. ${entry.note}`
      : "A sinusoid. Set its period and height under Scene, Texture.";
    this.#sources.hidden = !entry;
    this.#sources.open = false;
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

  async #listNumbers(entry) {
    let lines;
    try {
      const { numbers } = await call("GET", `/v1/textures/${entry.name}`);
      lines = Object.entries(numbers).map(
        ([field, { value, source }]) => `${field} ${[value].flat().join(", ")} (${source})`,
      );
    } catch ({ message }) {
      lines = [message];
    }
    if (entry === this.#entry) this.#list.replaceChildren(...lines.map((text) => make("li", { text })));
  }
}
