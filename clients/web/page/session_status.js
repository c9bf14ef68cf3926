/* State, status and meters of a session, from the states of its fingers. */

import { siValue } from "../scene/units.js";

const STATES = ["broken", "full", "ended", "connecting", "preparing", "live"]; // worst first

const stateOfOne = ({ connection, scene }) => {
  if (connection.state === "live") return scene.pending ? "preparing" : "live";
  return connection.trouble ?? connection.state;
};

/** Returns the worst state of `fingers`: "broken", "full", "ended", "connecting", "preparing" (a change is being solved) or
 *  "live"; "asleep" if the browser keeps the page silent; "not started" without a player. */
export function stateOf(player, fingers) {
  if (!player) return "not started";
  const worst = STATES.find((state) => fingers.some((finger) => stateOfOne(finger) === state)) ?? "connecting";
  return worst === "live" && !player.awake ? "asleep" : worst;
}

/** Returns whether the sound belongs to the present scene: "none" (no sound), "broken" (no connection), "full" (no room),
 *  "pending", "refused" or "current". Fingers without a stream count only if none has one. */
export function soundStatusOf(player, fingers) {
  if (!player) return "none";
  const heard = fingers.filter(({ connection }) => !connection.trouble);
  if (fingers.length && !heard.length) return stateOf(player, fingers);
  if (heard.some(({ scene }) => scene.refused)) return "refused";
  const current = heard.length > 0 && heard.every((one) => stateOfOne(one) === "live" && one.scene.isCurrent);
  return current ? "current" : "pending";
}

/** Returns {underruns: of all fingers, latency: s, updateToSound: s, of the slowest finger, or null}. */
export function statsOf(player, fingers) {
  const all = fingers.map(({ stats }) => stats);
  const delays = all.map(({ updateToSound }) => updateToSound).filter((delay) => delay !== null);
  const underruns = all.reduce((sum, one) => sum + one.underruns, 0);
  return { underruns, latency: player?.latency ?? 0, updateToSound: delays.length ? Math.max(...delays) : null };
}

/** Returns the sample rate of a scene, Hz. */
export const rateOf = (scene) => siValue(scene.output?.sample_rate ?? 48000, "Hz");
