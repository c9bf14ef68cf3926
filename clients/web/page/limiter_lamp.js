/* The lamp of the safety limiter, and the button "Rescale".

Model: the service reports the gain reduction at most once per second. The lamp is lit while reports come. The text
stays until there are new streams or a new scene. A full scale is fixed for a stream, so "Rescale" opens new streams for
the same hands. If the scene names a full scale, "Rescale" removes it, so that the automatic one applies. */

import { byId, whileDisabled } from "../dom.js";
import { explanationOf } from "../explained.js";
import { withFullScales } from "../scene/merge.js";
import { showQuantity } from "../scene/units.js";
import { quantityOf } from "../scene/quantities.js";

const LIT = 1500; // ms after a report; while the limiter acts, reports come every second

/** Connects the lamp to `session`. state: the SceneState. onRescaled(): called when the streams are new.
 *  tell(sentence). */
export function wireLimiter({ session, state, tell, onRescaled }) {
  let dark = 0;
  const [lamp, button] = [byId("limiter"), byId("rescale")];
  session.addEventListener("limited", ({ detail: { reduction } }) => {
    const told = reduction ? `reduces by ${Math.ceil(reduction)} dB` : "–";
    if (lamp.textContent !== told) lamp.textContent = told; // screen readers announce a change, not every report
    lamp.toggleAttribute("data-lit", reduction > 0);
    lamp.parentElement.toggleAttribute("data-told", reduction > 0); // a place of its own over the page
    button.hidden = !reduction;
    clearTimeout(dark);
    dark = setTimeout(() => lamp.removeAttribute("data-lit"), LIT);
  });
  const rescale = async () => {
    const automatic = withoutScale(state.scene);
    if (automatic) return state.take(automatic);
    const scaled = await session.rescale();
    if (!scaled) return;
    onRescaled();
    tell(`The full scale is now ${asText(scaled)}, in a new stream. The volume is unchanged.`);
  };
  button.addEventListener("click", () => whileDisabled(button, rescale).catch((error) => tell(explanationOf(error))));
}

const asText = ({ full_scale: value, quantity }) => showQuantity(value, quantityOf(quantity).unit, 3);

/** Returns `scene` without its full scales; null if it has none. */
function withoutScale(scene) {
  const { full_scale: scale, channels } = scene.output ?? {};
  return scale || channels?.some(({ full_scale: one }) => one) ? withFullScales(scene, null) : null;
}
