/* The choice of a texture from the catalogue, with its sentence and its source. */

import { byId, make } from "../knobs/element.js";

const OWN = "sinusoid";

/** Wire the menu to `state`; catalogue: the entries of GET /v1/textures. */
export function wireTextures(state, catalogue) {
  const menu = byId("texture");
  menu.append(
    make("option", { value: OWN, text: "Sinusoid, by the knobs" }),
    ...catalogue.map(({ name, title, scene }) => make("option", { value: name, text: shortOf(title, scene) })),
  );
  menu.addEventListener("change", () => state.write(["texture", "kind"], menu.value === OWN ? undefined : menu.value));
  state.addEventListener("change", ({ detail: { scene } }) => {
    const chosen = catalogue.find(({ name }) => name === scene.texture?.kind);
    menu.value = chosen?.name ?? OWN;
    byId("texture-about").textContent = chosen
      ? `${chosen.title}. Source: ${chosen.source}.`
      : "One sinusoid; its period and height are under Knobs, Texture.";
  });
}

/** A name that fits the menu: the period, and the title up to its colon. */
function shortOf(title, scene) {
  const { period } = scene?.texture ?? {};
  const [head] = title.split(":");
  return typeof period === "string" ? `${period.replace("um", "µm")}: ${head}` : head;
}
