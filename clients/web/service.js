/* Calls to the service that serves the page: HTTP, the address of the live stream, and the key for both.

Model: the address of the page may contain `#key=KEY`. The key is removed from the address, so that a copied link does
not contain it, and is kept for this tab. HTTP requests send it as `Authorization: Bearer`, WebSockets as a further
subprotocol. A proxy may offer the service under a prefix: every address is relative to this file, `PREFIX/web/service.js`.
Limits: anyone who can read the storage of the page can read the key. */

import { Explained } from "./explained.js";

const ROOT = new URL("..", import.meta.url);
const KEY_PLACE = "ridgewave.key";
const KEY_IN_HASH = /(^#?|&)key=([^&]*)/;
const SUBPROTOCOLS = ["ridgewave.v2", "ridgewave.v1"]; // versions of the live protocol, the newest first
const KEY_SUBPROTOCOL = "ridgewave.key.";

/** An error response of the service, or no response. problem: its document (RFC 9457). message: a sentence. */
export class ServiceProblem extends Explained {
  constructor(problem) {
    super(sentenceOf(problem));
    this.name = "ServiceProblem";
    this.problem = problem;
  }
}

/** Returns the most helpful sentence of a problem document. */
function sentenceOf(problem) {
  return problem.detail || problem.title || "The service refused the request.";
}

const TEMPORARY = [0, 429, 502, 503, 504]; // statuses; 0: no answer

/** Returns whether the same request may succeed soon: no answer, or from a service that is busy or restarts. */
export function isTemporary(problem) {
  return TEMPORARY.includes(problem?.status) && !problem.type?.endsWith("cannot-render");
}

let key = null;
key = takeKey();

/** Returns the address of `path`, which begins with /v1/, or with a prefix before it, as in links of the service. */
export function addressOf(path) {
  return new URL(path.slice(path.lastIndexOf("/v1/") + 1), ROOT);
}

/** Returns the JSON of the response, null if it is empty. body: JSON value, FormData or undefined. signal: an
 *  AbortSignal that ends the request, and with it the work of the service. Throws ServiceProblem. */
export async function call(method, path, body, signal) {
  const answer = await callBinary(method, path, body, signal);
  const text = await answer.text();
  return text ? JSON.parse(text) : null;
}

/** Returns the Response. Throws ServiceProblem. */
export async function callBinary(method, path, body, signal) {
  const headers = key === null ? {} : { Authorization: `Bearer ${key}` };
  const request = { method, headers, signal };
  if (body instanceof FormData) request.body = body;
  else if (body !== undefined) {
    headers["Content-Type"] = "application/json";
    request.body = JSON.stringify(body);
  }
  let answer;
  try {
    answer = await fetch(addressOf(path), request);
  } catch {
    throw new ServiceProblem(problemOf(0, "The service does not answer. Check that it is running, then try again."));
  }
  if (!answer.ok) throw new ServiceProblem(await refusalOf(answer));
  return answer;
}

/** Returns the recording of a live session with `record`: JSON text that `ridgewave render` reads. */
export async function recordingOf(session) {
  const answer = await callBinary("GET", `/v1/sessions/${encodeURIComponent(session)}/recording`);
  return answer.text();
}

/** Returns the address of the live stream. */
export function liveUrl() {
  const url = addressOf("/v1/live");
  url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
  return url.href;
}

/** Returns a WebSocket to `url` with the subprotocol and, if there is one, the key. Throws Explained if the browser opens none. */
export function openLive(url) {
  const protocols = key === null ? SUBPROTOCOLS : [...SUBPROTOCOLS, KEY_SUBPROTOCOL + base64url(key)];
  try {
    return new WebSocket(url, protocols);
  } catch {
    throw new Explained("This browser opens no stream to the service. Update it, or use another one.");
  }
}

/** Sets the key, null for none. It is kept for this tab. */
export function useKey(text) {
  key = text || null;
  try {
    if (key === null) sessionStorage.removeItem(KEY_PLACE);
    else sessionStorage.setItem(KEY_PLACE, key);
  } catch {
    /* without storage the key is lost with a reload */
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
    /* not JSON: the error page of a proxy, for example */
  }
  return problemOf(answer.status, `The service answered with status ${answer.status}. Try again, or look at its log.`);
}

function problemOf(status, detail) {
  return { type: "about:blank", title: "No answer", status, detail, errors: [] };
}
