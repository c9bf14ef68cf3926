/* What the end of a connection means for the stream: that it is over, and why, or that it is worth another try.

Worth another try are a break (a reset, no close frame), a service that goes away to come back, that restarts, that is
full (1013), and a mistake of its own of which it said nothing. Over is a stream that was told its end, and a connection
that was closed because of what this side said: another would be closed the same. */

import { call } from "../service.js";

const ENDS = {
  1000: "stopped",
  1002: "policy",
  1003: "policy",
  1007: "policy",
  1008: "policy",
  1009: "too large",
  1010: "policy",
  4408: "slow reader",
};
const FULL = 1013;
const COMES_BACK = "shutting down";
const AWAY = new Set([502, 503, 504]); // a proxy's answers for a service that is not there
const SOONEST = 0.4; // s between two questions at first; sooner is asked in vain
const LATEST = 15; // s; later is a page that seems dead
const BACK = ["online", "pointerdown", "keydown"];
const NEVER_ADMITTED = new Set([401, 403]); // answers that another try would only get again

/** Returns why the stream is over, null where another connection may go on with it.
 *  code: of the WebSocket's close. told: the reason of `end`, null where there was none. */
export function endOf(code, told) {
  if (told === COMES_BACK || code === FULL) return null;
  return told ?? ENDS[code] ?? null;
}

let asking = null;

/** Resolves once the service answers over HTTP: to null, or to its problem document. Whoever waits shares one question at
 *  a time, asked ever more seldom, and at once when the network or a hand is back: each that fails is a line on the
 *  console, which no page can keep from it. */
export function answering() {
  asking ??= ask().finally(() => {
    asking = null;
  });
  return asking;
}

async function ask() {
  for (let delay = SOONEST; ; delay = Math.min(LATEST, 2 * delay)) {
    try {
      await call("GET", "/v1/textures");
      return null;
    } catch ({ problem }) {
      if (problem?.status && !AWAY.has(problem.status)) return problem;
    }
    await restOrReturn(delay);
  }
}

/** Returns after so many seconds, or as soon as the network is back, or somebody touches the page. */
function restOrReturn(seconds) {
  return new Promise((resolve) => {
    const done = () => {
      clearTimeout(timer);
      for (const kind of BACK) removeEventListener(kind, done, true);
      resolve();
    };
    const timer = setTimeout(done, 1e3 * seconds);
    for (const kind of BACK) addEventListener(kind, done, true);
  });
}

/** Returns whether that problem will not go away by itself. */
export function isFinal(problem) {
  return NEVER_ADMITTED.has(problem.status);
}
