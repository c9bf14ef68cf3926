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
const NEVER_ADMITTED = new Set([401, 403]); // answers that another try would only get again

/** Returns why the stream is over, null where another connection may go on with it.
 *  code: of the WebSocket's close. told: the reason of `end`, null where there was none. */
export function endOf(code, told) {
  if (told === COMES_BACK || code === FULL) return null;
  return told ?? ENDS[code] ?? null;
}

/** Asks the service over HTTP why it does not take a connection; returns its problem document, null where it has none
 *  or does not answer. */
export async function whyNot() {
  try {
    await call("GET", "/v1/textures");
    return null;
  } catch ({ problem }) {
    return problem?.status ? problem : null;
  }
}

/** Returns whether that problem will not go away by itself. */
export function isFinal(problem) {
  return NEVER_ADMITTED.has(problem.status);
}
