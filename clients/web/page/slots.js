/* The slots A and B: two textures between which one changes with one click.

Model: the pressed slot follows the texture of the scene. The other slot keeps its own, and gets it back when it is pressed.
An empty slot takes the present texture. Each has its own automatic full scale, as any chosen texture. */

import { byId } from "../dom.js";
import { copyOf, same, withField } from "../scene/merge.js";
import { withEverydayEffects } from "../textures/everyday_effects.js";
import { titleOf } from "./texture_wall.js";

const NAMES = ["a", "b"];

export class Slots {
  /** The pressed slot, "a" or "b". */
  pressed = "a";
  /** The textures of the slots, sections of a scene; undefined: that of the defaults. An empty slot is missing. */
  textures = {};

  /** state: the SceneState. textures: the TextureList. */
  constructor({ state, textures }) {
    this.state = state;
    this.list = textures;
    for (const name of NAMES) byId(`slot-${name}`).addEventListener("click", () => this.press(name));
    state.addEventListener("change", () => this.#keep());
    textures.addEventListener("change", () => this.#show());
  }

  /** Presses a slot. */
  press(name) {
    this.pressed = name;
    const texture = name in this.textures ? this.textures[name] : this.state.scene.texture;
    if (same(texture ?? null, this.state.scene.texture ?? null)) return this.#keep();
    const scene = withField(this.state.scene, ["texture"], texture === undefined ? undefined : copyOf(texture));
    this.state.take(withEverydayEffects(scene, this.list.of(texture)[0], this.list.entries));
  }

  #keep() {
    this.textures[this.pressed] = this.state.scene.texture;
    this.#show();
  }

  #show() {
    for (const name of NAMES) {
      const button = byId(`slot-${name}`);
      button.setAttribute("aria-pressed", String(name === this.pressed));
      button.lastElementChild.textContent = name in this.textures ? this.#titleOf(this.textures[name]) : "empty";
    }
  }

  #titleOf(texture) {
    const [entry] = this.list.of(texture);
    return entry ? titleOf(entry) : (texture?.kind ?? "sinusoid");
  }
}
