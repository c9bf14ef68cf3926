/* The menu of textures: a sinusoid, and the catalogue with titles and sources. */

import { byId, make } from "../dom.js";

const SINUSOID = "sinusoid";

/** Connects the menu to `state`, a SceneState. catalogue: the entries of `GET /v1/textures`. */
export function wireTextureMenu(state, catalogue) {
  const menu = byId("texture");
  menu.append(
    make("option", { value: SINUSOID, text: "Sinusoid" }),
    ...catalogue.map(({ name, title, scene }) => make("option", { value: name, text: shortOf(title, scene) })),
  );
  menu.addEventListener("change", () =>
    state.write(["texture", "kind"], menu.value === SINUSOID ? undefined : menu.value),
  );
  state.addEventListener("change", ({ detail: { scene } }) => {
    const chosen = catalogue.find(({ name }) => name === scene.texture?.kind);
    menu.value = chosen?.name ?? SINUSOID;
    byId("texture-about").textContent = chosen
      ? `${chosen.title}. Source: ${chosen.source}.`
      : "A sinusoid. Set its period and height under Scene, Texture.";
  });
}

/** Returns a short name for the menu: the period, and the title up to its colon. */
function shortOf(title, scene) {
  const { period } = scene?.texture ?? {};
  const [head] = title.split(":");
  return typeof period === "string" ? `${period.replace("um", "µm")}: ${head}` : head;
}
