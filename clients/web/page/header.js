/* The header: start and stop, volume, connection state, latency and gaps. */

import { byId } from "../dom.js";
import { STATE_WORDS } from "./status_texts.js";

const INTERVAL = 500; // ms between updates of the meters

/** Connects the header to `session`. onStop(): called before the sound ends. */
export function wireHeader(session, { onStop }) {
  const start = byId("start");
  start.disabled = false;
  start.addEventListener("click", () => {
    if (!session.player) return session.start().catch(() => {});
    onStop();
    return session.stop();
  });
  byId("volume").addEventListener("input", () => {
    session.volume = Number(byId("volume").value);
  });
  session.addEventListener("state", ({ detail }) => {
    byId("state").textContent = STATE_WORDS[detail.state];
    for (const id of ["state", "status"]) byId(id).dataset.state = detail.state;
    start.setAttribute("aria-pressed", String(Boolean(session.player)));
    start.textContent = session.player ? "Stop" : "Touch";
  });
  setInterval(() => {
    const { underruns, latency, updateToSound } = session.stats;
    const sounds = ["live", "preparing"].includes(session.state);
    byId("latency").textContent = sounds
      ? `${Math.round(1e3 * (updateToSound === null ? latency : updateToSound + session.player.outputLatency))} ms`
      : "–";
    byId("gaps").textContent = session.player ? String(underruns) : "–";
  }, INTERVAL);
}
