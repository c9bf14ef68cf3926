/* What the page says in each state: a few words in the header, and a sentence on the pad.

Model: the header tells the state of the streams. The pad tells the first sentence whose condition holds: what keeps the
page silent, what keeps the service away, then what is not of the present scene. */

/** Words of the header, by the state of the session (session_status.js). */
export const STATE_WORDS = {
  "not started": "not started",
  connecting: "connecting…",
  preparing: "solving the contact…",
  asleep: "waiting for a click",
  live: "live",
  broken: "no connection",
  full: "no room, waiting…",
  ended: "ended",
};

/** Sentences about the picture, by why there is none of the present scene. */
const NO_PICTURE = {
  away: "The service does not answer. The picture follows when it is back.",
  busy: "The service is busy. The picture follows.",
  barred: "The service does not admit this page.",
  locked: "The service requires a key. Enter it above.",
  failed: "The service failed to draw this scene.",
};

/** Returns the sentence of the pad, "" for none. sound: `soundStatusOf`. picture: "current", "pending", or one of
 *  `pictureStatusOf`. output: "awake" or "asleep". silent: why no sound is possible
 *  (sound/player.js), "" if it is. shown: whether there is a picture, of whatever scene. */
export function padSentence({ sound, picture, output, silent, shown }) {
  if (picture === "locked") return NO_PICTURE.locked;
  if (sound === "broken") return "There is no connection to the service. This page tries again.";
  if (sound === "full") return "The service has no room for another stream. This page tries again.";
  if (silent) return silent;
  if (output === "asleep")
    return "The browser keeps this page silent until you click, press a key or lift your finger.";
  if (NO_PICTURE[picture]) return NO_PICTURE[picture];
  const parts = { sound, picture };
  const refused = Object.keys(parts).filter((part) => parts[part] === "refused");
  if (refused.length && !shown) return "The service refuses this scene. Change it under Scene, or open another one.";
  if (refused.length > 1) return "This scene is refused. Sound and picture are still of the previous scene.";
  if (refused.length) return `This scene is refused. The ${refused[0]} is still of the previous scene.`;
  const late = Object.keys(parts).filter((part) => parts[part] === "pending");
  return late.length ? `Not updated yet: ${late.join(" and ")}.` : "";
}

/** Returns why a picture or plan was not answered: "away", "busy", "barred", "locked", "refused" or "failed". */
export function pictureStatusOf(problem) {
  const status = problem?.status ?? 500;
  if ([0, 502, 504].includes(status)) return "away";
  if (status === 401) return "locked";
  if (status === 403) return "barred";
  if (status === 429 || (status === 503 && !problem.type?.endsWith("cannot-render"))) return "busy";
  return status < 500 ? "refused" : "failed";
}

const ENDS = {
  stopped: "Everything was stopped at the service. Press Touch to go on.",
  "too long": "The stream has reached the longest duration of this service. Press Touch to go on.",
};

/** Returns why a stream ended, which the page did not end. Takes the detail of the event "ended". */
export function endSentence({ reason, problem }) {
  return problem?.detail ?? ENDS[reason] ?? `The service ended the stream: ${reason}. Press Touch to go on.`;
}

/** What the page says while it cannot load: a sentence about the answer of the service. */
export const LOADING_FAILS = {
  away: "The service does not answer. Check that it is running, then reload the page.",
  busy: "The service is busy. Reload the page in a moment.",
  failed: "The service failed to answer. Its log says why. Then reload the page.",
};
