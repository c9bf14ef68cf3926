/* The choice of a texture from the catalogue, with its sentence and its source. */

import { byId, make } from "../knobs/element.js";

const OWN = "sinusoid";

/** Wire the menu to `form`; catalogue: the entries of GET /v1/textures. Returns a function that shows the scene's
 *  choice. */
export function wireTextures(form, catalogue) {
  const menu = byId("texture");
  menu.append(
    make("option", { value: OWN, text: "Sinusoid, by the knobs" }),
    ...catalogue.map(({ name, title }) => make("option", { value: name, text: `${name}: ${title}` })),
  );
  menu.addEventListener("change", () => form.write(["texture", "kind"], menu.value === OWN ? undefined : menu.value));
  return (scene) => {
    const chosen = catalogue.find(({ name }) => name === scene.texture?.kind);
    menu.value = chosen?.name ?? OWN;
    byId("texture-about").textContent = chosen
      ? `${chosen.title}. Source: ${chosen.source}.`
      : "One sinusoid; its period and height are under Knobs, Texture.";
  };
}
