/* How the fingers of the page stand, all together: their state, whether their sound is of the scene, and their meters. */

import { siValue } from "../knobs/units.js";

const STATES = ["broken", "ended", "connecting", "preparing", "live"]; // the worst of them is the page's

const stateOfOne = ({ connection, scene }) =>
  connection.state === "live" && scene.pending ? "preparing" : connection.state;

/** The worst state of `fingers`: "live"; "preparing" where a change is being solved; "asleep" where the browser does not
 *  let the page sound yet; "connecting", "broken", "ended"; "not started" where there is no player. */
export function stateOf(player, fingers) {
  if (!player) return "not started";
  const worst = STATES.find((state) => fingers.some((finger) => stateOfOne(finger) === state)) ?? "connecting";
  return worst === "live" && !player.awake ? "asleep" : worst;
}

/** How the sound stands to the scene: "none" where there is no sound, "coming", "refused", or "there". */
export function agreementOf(player, fingers) {
  if (!player) return "none";
  if (fingers.some(({ scene }) => scene.refused)) return "refused";
  const there = fingers.length > 0 && fingers.every((one) => stateOfOne(one) === "live" && one.scene.agrees);
  return there ? "there" : "coming";
}

/** underruns: of all fingers. latency: s. updateToSound: s, of the slowest finger, or null. */
export function statsOf(player, fingers) {
  const all = fingers.map(({ stats }) => stats);
  const delays = all.map(({ updateToSound }) => updateToSound).filter((delay) => delay !== null);
  const underruns = all.reduce((sum, one) => sum + one.underruns, 0);
  return { underruns, latency: player?.latency ?? 0, updateToSound: delays.length ? Math.max(...delays) : null };
}

/** The rate of a scene, Hz. */
export const rateOf = (scene) => siValue(scene.output?.sample_rate ?? 48000, "Hz");
