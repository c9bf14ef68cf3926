/* The wall of textures: a sinusoid, the catalogue by groups, and the imported textures, each with a lit picture.

Model: each texture is a radio button, so the arrow keys go from one to the next. A picture is requested when it comes into
view, and kept. The search hides what has none of its words. A texture that is none of these is shown by its name or its kind,
with no button chosen. */

import { byId, make } from "../dom.js";
import { withField } from "../scene/merge.js";
import { callBinary } from "../service.js";
import { withEverydayEffects } from "../textures/everyday_effects.js";
import { colour } from "../textures/material_colours.js";
import { byGroup } from "../textures/groups.js";
import { wireImport } from "../textures/import_control.js";
import { TextureDescription } from "../textures/texture_description.js";

const SINUSOID = "sinusoid";
const GENERATED = "Generated";
const AHEAD = "120px"; // around the wall, in which pictures are requested

/** Connects the wall to `state`, a SceneState. textures: the TextureList. tell(sentence). Returns the TextureWall. */
export function wireTextureWall({ state, textures, tell }) {
  const wall = new TextureWall(byId("texture"), (name) => choose(name));
  const onDeleted = () => {
    state.write(["texture"], undefined);
    wall.focus(); // the button that deleted is gone
  };
  const about = new TextureDescription(byId("texture-about"), { textures, onDeleted, tell });
  const show = (wanted = wall.value) => {
    const { texture } = state.scene;
    const entries = textures.of(texture); // several if a surface was imported under several names
    const chosen = entries.find(({ name }) => name === wanted) ?? entries[0] ?? null;
    const kind = texture?.kind ?? SINUSOID;
    const { title, sentence } = unlisted(kind, texture?.surface);
    wall.value = chosen?.name ?? (kind === SINUSOID ? SINUSOID : "");
    byId("texture-name").textContent = chosen ? titleOf(chosen) : title;
    about.show(chosen, sentence);
  };
  const choose = (name) => {
    const entry = textures.entries.find((one) => one.name === name);
    const [path, value] = entry?.stored ? [["texture"], entry.scene.texture] : [["texture", "kind"], entry?.name];
    state.take(withEverydayEffects(withField(state.scene, path, value), entry, textures.entries));
    show(name);
  };
  const onKept = async (name) => {
    await textures.reload();
    choose(name);
    tell(`${name} is kept, and among the textures under “Yours”.`);
  };
  wall.fill(textures.offered);
  state.addEventListener("change", () => show());
  textures.addEventListener("change", () => {
    const { value } = wall;
    wall.fill(textures.offered);
    show(value);
  });
  wireImport({ onKept, tell });
  return wall;
}

/** Returns the name that people read. */
export const titleOf = ({ name, title, stored }) => (stored ? name : title.split(":")[0].replace(" um", " µm"));

/** Returns {title, sentence} of a texture that is no entry of the list. surface: the address of a measured one. */
function unlisted(kind, surface) {
  if (kind === SINUSOID)
    return { title: "Sinusoid", sentence: "A sinusoid. Set its period and height under Scene, Texture." };
  if (surface)
    return { title: "A surface that is not listed", sentence: "A measured surface that is not in the list." };
  const name = String(kind); // a link may hold anything
  const title = name.charAt(0).toUpperCase() + name.slice(1);
  return { title, sentence: `A texture of the kind “${name}”. Set its fields under Scene, Texture.` };
}

/** The buttons in `element`. onChoose(name): called when one is chosen. */
export class TextureWall {
  #pictures = new Map(); // address of a picture -> promise of its object URL
  #watch = null; // IntersectionObserver, once pictures may be requested

  constructor(element, onChoose) {
    this.element = element;
    element.addEventListener("change", ({ target }) => onChoose(target.value));
    byId("texture-search").addEventListener("input", ({ target }) => this.search(target.value));
  }

  /** The name of the chosen texture; "" for none. */
  get value() {
    return this.#inputs.find(({ checked }) => checked)?.value ?? "";
  }

  set value(name) {
    const before = this.value;
    for (const input of this.#inputs) input.checked = input.value === name;
    if (name !== before) this.#reveal();
  }

  get #inputs() {
    return [...this.element.querySelectorAll("input")];
  }

  /** Moves the focus to the chosen texture. */
  focus() {
    (this.#inputs.find(({ checked }) => checked) ?? this.#inputs[0]).focus();
  }

  /** Makes a button for each of `entries`, those that a TextureList offers. */
  fill(entries) {
    const sinusoid = { name: SINUSOID, title: "Sinusoid", group: GENERATED, note: "" };
    const groups = byGroup([sinusoid, ...entries]);
    const group = ([label, some]) =>
      make(
        "div.wall-group",
        { role: "group", "aria-label": label },
        make("p.group-name", { text: label }),
        ...some.map(tileOf),
      );
    this.element.replaceChildren(
      ...groups.map(group),
      make("p.hint", { text: "No texture has these words.", hidden: true }),
    );
    this.search(byId("texture-search").value);
    this.#observe();
  }

  /** Hides what lacks one of the words of `text`. */
  search(text) {
    const words = text.toLowerCase().split(/\s+/);
    const fits = (tile) => words.every((word) => tile.dataset.words.includes(word));
    for (const tile of this.element.querySelectorAll(".tile")) tile.hidden = !fits(tile);
    for (const group of this.element.querySelectorAll(".wall-group"))
      group.hidden = !group.querySelector(".tile:not([hidden])");
    this.element.lastElementChild.hidden = Boolean(this.element.querySelector(".tile:not([hidden])"));
  }

  /** Requests pictures from now on, of those in view. */
  load() {
    const seen = (found) => {
      for (const { isIntersecting, target } of found) if (isIntersecting) this.#draw(target);
    };
    this.#watch ??= new IntersectionObserver(seen, { root: this.element, rootMargin: AHEAD });
    this.#observe();
    this.#reveal();
  }

  #observe() {
    this.#watch?.disconnect();
    for (const picture of this.element.querySelectorAll("img:not([src])")) this.#watch?.observe(picture);
  }

  async #draw(image) {
    this.#watch.unobserve(image);
    const { picture } = image.dataset;
    const asked = this.#pictures.get(picture) ?? this.#request(picture);
    image.src = await asked.catch(() => ""); // the wall works without its pictures
  }

  #request(picture) {
    const asked = callBinary("GET", picture)
      .then((answer) => answer.blob())
      .then((blob) => URL.createObjectURL(blob));
    this.#pictures.set(picture, asked);
    asked.catch(() => this.#pictures.delete(picture)); // the next one in view tries again
    return asked;
  }

  /** Scrolls the wall, not the page, to the chosen texture. */
  #reveal() {
    const tile = this.element.querySelector("input:checked")?.closest(".tile");
    if (!tile) return;
    const [all, one] = [this.element, tile].map((element) => element.getBoundingClientRect());
    if (one.top < all.top || one.bottom > all.bottom)
      this.element.scrollTop += one.top - all.top - (all.height - one.height) / 2;
    if (one.left < all.left || one.right > all.right)
      this.element.scrollLeft += one.left - all.left - (all.width - one.width) / 2;
  }
}

function tileOf(entry) {
  const words = [entry.name, entry.title, entry.group].join(" ").toLowerCase();
  const picture = make(
    "span.picture",
    { "aria-hidden": "true" },
    entry.picture ? make("img", { alt: "", width: 240, height: 240, "data-picture": entry.picture }) : null,
  );
  if (!entry.picture) picture.classList.add("waves");
  colour(picture, entry.name);
  return make(
    "label.tile",
    { "data-words": words, title: entry.title },
    make("input", { type: "radio", name: "texture", value: entry.name }),
    picture,
    make("span.tile-name", { text: titleOf(entry) }),
  );
}
