/* The lamp of the safety limiter, and a new full scale at one click.

Model: the service tells at most once a second by how much it turned the sound down. The lamp is lit while it does, the
sentence stays until the streams or their scene are new. A full scale is fixed for a stream, so "Rescale" opens new ones
under the same hands; a full scale that the scene names is taken out of it, for an automatic one. */

import { byId } from "../knobs/element.js";
import { withField } from "../knobs/merge.js";
import { showQuantity } from "../knobs/units.js";
import { pinned } from "../live/stream_scene.js";
import { QUANTITIES } from "../sight/scale.js";

const ROOM = 1.25; // between what the limiter called for and a full scale: it told of the past only
const LIT = 1500; // ms after what the service told; it tells once a second while it limits

/** Wire the lamp to `session`; state: the SceneState. onRescaled(): the streams are new. tell(sentence). */
export function wireLimiter({ session, state, tell, onRescaled }) {
  let dark = 0;
  const [lamp, button] = [byId("limiter"), byId("rescale")];
  session.addEventListener("limited", ({ detail: { reduction } }) => {
    const told = reduction ? `turned down by ${Math.ceil(reduction)} dB` : "–";
    if (lamp.textContent !== told) lamp.textContent = told; // read out when it changes, and not once a second
    lamp.toggleAttribute("data-lit", reduction > 0);
    button.hidden = !reduction;
    clearTimeout(dark);
    dark = setTimeout(() => lamp.removeAttribute("data-lit"), LIT);
  });
  button.addEventListener("click", async () => {
    button.disabled = true;
    try {
      const automatic = withoutScale(state.scene);
      if (automatic) return state.take(automatic);
      const scaled = await session.rescale();
      if (!scaled) return;
      onRescaled();
      tell(`Full scale is ${inWords(scaled)} now: a new stream, the same hand, the same volume.`);
    } catch (error) {
      tell(error.message);
    } finally {
      button.disabled = false;
    }
  });
}

const inWords = ({ full_scale: value, quantity }) => showQuantity(value, QUANTITIES[quantity]?.unit ?? "", 3);

/** Opens streams of `scene` for `count` hands, one at least: with an automatic full scale, or, where that is no larger
 *  than that of the stream that was `ready`, with the one that a limiter of `reduction` dB called for there, so that
 *  every click gives room. opened(scene) gives a live finger. */
export async function roomier({ scene, ready, reduction, count }, opened) {
  const [present] = ready.full_scale;
  let first = await opened(scene);
  if (first.connection.ready.full_scale[0] <= present && pinned(scene, ready) !== scene) {
    first.close();
    const needed = present * 10 ** (reduction / 20) * ROOM;
    first = await opened(withField(scene, ["output", "full_scale"], needed));
  }
  const fresh = [first];
  while (fresh.length < count) fresh.push(await opened(pinned(scene, first.connection.ready)));
  return fresh;
}

/** Returns `scene` without the full scales that it names; null where it names none. */
function withoutScale(scene) {
  const { full_scale: scale, channels } = scene.output ?? {};
  if (scale) return withField(scene, ["output", "full_scale"], undefined);
  if (!channels?.some(({ full_scale: one }) => one)) return null;
  return withField(
    scene,
    ["output", "channels"],
    channels.map(({ quantity }) => ({ quantity })),
  );
}
