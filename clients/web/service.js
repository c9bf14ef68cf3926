/* The page's calls to the service it came from: JSON over HTTP, where the live stream is, and the key for both.

The page may be opened with `#key=KEY` in its address, where the service asks for one. The key is taken out of the
address, so that a copied link does not carry it, and is kept for this tab only. It goes with a call as
`Authorization: Bearer`, with a WebSocket as a second subprotocol.
Limits: calls go to the page's own origin. A key is what anyone who can read the page's storage can read. */

const KEY_PLACE = "ridgewave.key";
const KEY_IN_HASH = /(^#?|&)key=([^&]*)/;
const SUBPROTOCOL = "ridgewave.v1";
const KEY_SUBPROTOCOL = "ridgewave.key.";

/** A refusal of the service, or none to be had. `problem`: its document (RFC 9457); `message`: one sentence. */
export class ServiceProblem extends Error {
  constructor(problem) {
    super(sentenceOf(problem));
    this.name = "ServiceProblem";
    this.problem = problem;
  }
}

/** Returns the sentence of a problem document that says most to a person. */
export function sentenceOf(problem) {
  return problem.detail || problem.title || "The service refused the request.";
}

let key = null;
key = takeKey();

/** Returns the answer's JSON, null where it is empty; throws ServiceProblem. body: anything JSON, or undefined. */
export async function call(method, path, body) {
  const answer = await callBinary(method, path, body);
  const text = await answer.text();
  return text ? JSON.parse(text) : null;
}

/** Returns the Response as it came, once it is known to be no refusal; throws ServiceProblem. */
export async function callBinary(method, path, body) {
  const headers = key === null ? {} : { Authorization: `Bearer ${key}` };
  const request = { method, headers };
  if (body !== undefined) {
    headers["Content-Type"] = "application/json";
    request.body = JSON.stringify(body);
  }
  let answer;
  try {
    answer = await fetch(path, request);
  } catch {
    throw new ServiceProblem(problemOf(0, "The service does not answer: see whether it runs, then try again."));
  }
  if (!answer.ok) throw new ServiceProblem(await refusalOf(answer));
  return answer;
}

/** Returns the recording of a live session that was opened with `record`, as text: what `ridgewave render` reads. */
export async function recordingOf(session) {
  const answer = await callBinary("GET", `/v1/sessions/${encodeURIComponent(session)}/recording`);
  return answer.text();
}

/** Returns the address of the live stream, of the service that the page came from. */
export function liveUrl() {
  const url = new URL("/v1/live", location.href);
  url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
  url.hash = "";
  return url.href;
}

/** Returns a WebSocket to `url` that offers the protocol, and the key where there is one. */
export function openLive(url) {
  const protocols = key === null ? [SUBPROTOCOL] : [SUBPROTOCOL, KEY_SUBPROTOCOL + base64url(key)];
  return new WebSocket(url, protocols);
}

/** Uses `text` as the key from now on, null for none. It is kept for this tab. */
export function useKey(text) {
  key = text || null;
  try {
    if (key === null) sessionStorage.removeItem(KEY_PLACE);
    else sessionStorage.setItem(KEY_PLACE, key);
  } catch {
    /* a browser that keeps nothing asks for the key again after a reload */
  }
}

function takeKey() {
  const found = KEY_IN_HASH.exec(location.hash);
  if (found) {
    const rest = location.hash.replace(KEY_IN_HASH, "").replace(/^[#&]+/, "");
    history.replaceState(history.state, "", location.pathname + location.search + (rest && `#${rest}`));
    useKey(decoded(found[2]));
    return key;
  }
  try {
    return sessionStorage.getItem(KEY_PLACE);
  } catch {
    return null;
  }
}

function decoded(text) {
  try {
    return decodeURIComponent(text);
  } catch {
    return text;
  }
}

function base64url(text) {
  return btoa(text).replaceAll("+", "-").replaceAll("/", "_").replace(/=+$/, "");
}

async function refusalOf(answer) {
  try {
    const problem = await answer.json();
    if (problem && typeof problem === "object") return problem;
  } catch {
    /* not JSON: a proxy's page, say */
  }
  return problemOf(answer.status, `The service answered ${answer.status}: try again, or look at its log.`);
}

function problemOf(status, detail) {
  return { type: "about:blank", title: "No answer", status, detail, errors: [] };
}
