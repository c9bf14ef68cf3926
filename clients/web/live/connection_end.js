/* The end of a connection: whether the stream is over, and why, or whether to connect again.

Connect again after a break (a reset, no close frame), if the service restarts or is full (1013), and after an internal
error. The stream is over after a message `end`, and if the service closed the connection because of an invalid message:
it would close another one too. */

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
/** Close code of a service without room for another stream. */
export const FULL = 1013;
const COMES_BACK = "shutting down";
const AWAY = new Set([502, 503, 504]); // answers of a proxy if the service is down
const FIRST_DELAY = 0.4; // s between the first requests; the service needs about that to restart
const LARGEST_DELAY = 15; // s; with more the page seems dead
const RETRY_EVENTS = ["online", "pointerdown", "keydown"];
const NEVER_ADMITTED = new Set([401, 403]); // answers that do not change with another try

/** Returns why the stream is over; null if another connection may resume it.
 *  code: of the WebSocket's close. reason: that of the message `end`, or null. */
export function endOf(code, reason) {
  if (reason === COMES_BACK || code === FULL) return null;
  return reason ?? ENDS[code] ?? null;
}

let asking = null;

/** Resolves when the service answers over HTTP: to null, or to its problem document. All callers share one request at a
 *  time, since each failure is an error on the console of the browser. Delays between requests grow; the next request
 *  is immediate when the network returns or the user touches the page. */
export function serviceAnswer() {
  asking ??= ask().finally(() => {
    asking = null;
  });
  return asking;
}

async function ask() {
  for (let delay = FIRST_DELAY; ; delay = Math.min(LARGEST_DELAY, 2 * delay)) {
    try {
      await call("GET", "/v1/textures");
      return null;
    } catch ({ problem }) {
      if (problem?.status && !AWAY.has(problem.status)) return problem;
    }
    await delayOrEvent(delay);
  }
}

/** Resolves after so many seconds, when the network returns or when the user touches the page. */
function delayOrEvent(seconds) {
  return new Promise((resolve) => {
    const done = () => {
      clearTimeout(timer);
      for (const kind of RETRY_EVENTS) removeEventListener(kind, done, true);
      resolve();
    };
    const timer = setTimeout(done, 1e3 * seconds);
    for (const kind of RETRY_EVENTS) addEventListener(kind, done, true);
  });
}

/** Returns whether another try cannot succeed. */
export function isFinal(problem) {
  return NEVER_ADMITTED.has(problem.status);
}
