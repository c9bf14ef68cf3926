/* The box "True ratio": all textures at the full scale of the present one, so that a weaker one is quieter.

Model: the box is checked while the scene states its full scale. To check it writes the full scale of the present stream
into the scene, to uncheck it removes it; both can be undone. Unchecked, each texture has its automatic full scale. */

import { byId } from "../dom.js";
import { explanationOf } from "../explained.js";
import { hasFullScale, withFullScales } from "../scene/merge.js";
import { quantityOf } from "../scene/quantities.js";
import { showQuantity } from "../scene/units.js";

const DIGITS = 4; // the level differs by less than 0.05 %

/** Connects the box to `session` and `state`, the SceneState. tell(sentence). */
export function wireTrueRatio({ session, state, tell }) {
  const box = byId("true-ratio");
  const show = () => {
    box.checked = hasFullScale(state.scene);
  };
  const choose = async () => {
    if (!box.checked) return state.take(withFullScales(state.scene, null));
    await session.start();
    const { full_scale: scales, quantities } = session.fingers[0].connection.ready;
    const written = scales.map((scale, index) => showQuantity(scale, siUnitOf(quantities[index]), DIGITS));
    state.take(withFullScales(state.scene, written));
    tell(`All textures now have the full scale ${written[0]}.`);
  };
  state.addEventListener("change", show);
  box.addEventListener("change", () =>
    choose().catch((error) => {
      show();
      tell(explanationOf(error));
    }),
  );
}

const siUnitOf = (quantity) => quantityOf(quantity).unit.replace("²", "^2");
