/* A live stream of the service (docs/live.md), which survives broken connections.

Model: frames are counted from the first of the session; `frame` is the number received, in whole messages. After a
break the next connection resumes at `frame`, so no sample is lost or comes twice. If the session is gone (the service
was restarted, or the break was too long), a new session is opened with the same scene, changes and contact. Its frames
begin at 0, and the event "ready" has `renewed`. At most one contact update waits; a newer one replaces it. It is sent
with the next credit. A contact with x and y is sent as a position where the texture is along a line, or the service
speaks only version 1 of the protocol.
Where the limiter acted, `unlimited` of a block holds its samples before the limiter; elsewhere it is `samples`.
Events (CustomEvent, `detail`): ready {ready, renewed}, block {frame, samples, unlimited}, applied {seq, frame}, scene {frame, plan},
refused {problem} for a change of the scene, limited {frame, gain_reduction_db}, problem {problem}, broken {tries},
resumed {frame}, ended {reason, problem, frame}.
Limits: samples are read in the byte order of the machine, which is little-endian wherever browsers run. A refused
upgrade (a wrong key, for example) looks like a break. A connection that never opened is therefore followed by an HTTP
request, whose answer says why. */

import { explanationOf } from "../explained.js";
import { openLive } from "../service.js";
import { SceneChanges } from "./scene_changes.js";
import { endOf, FULL, isFinal, serviceAnswer } from "./connection_end.js";
import { alongLine, packContact } from "./contact_update.js";

const FIRST_DELAY = 0.2; // s before the first try; more prolongs the silence
const LARGEST_DELAY = 5; // s between tries; the service keeps a session for a limited time only
const SPACING = 0.001; // s between contact updates: a mouse of 8 kHz would exceed RIDGEWAVE_MAX_UPDATES
const SILENCE = 4; // s without an answer to credit or to a hello that resumes, until a connection counts as broken
const CHANGE_REFUSED = /#problem-(scene-refused|fixed|cannot-render)$/;
const NOT_FOUND = /#problem-not-found$/;

export class LiveConnection extends EventTarget {
  /** The document of `ready`, null before it. */
  ready = null;
  /** Whether the texture is over an area; false where the service does not report it (version 1). */
  overArea = false;
  /** Number of the next frame. */
  frame = 0;
  /** "connecting", "live", "broken" or "ended". */
  state = "connecting";
  /** Why there is no connection: "broken", or "full" if the service has no room; null while there is one. */
  trouble = null;
  /** Credit: frames granted and not received yet. */
  outstanding = 0;
  #socket = null;
  #attached = false; // this socket has received `ready`
  #opensSession = true; // the next hello opens a new session
  #changes = new SceneChanges();
  #contact = null; // the newest update, and whether it was sent
  #load; // the last of `move`, N: the service misses updates that are replaced, and those of a break
  #direction; // the last of `move`, rad
  #seq = 0;
  #sentAt = 0;
  #receivedAt = 0;
  #applied = -1;
  #before = []; // messages `before_limiter` of the next block
  #tries = 0;
  #problem = null; // the last problem on this socket
  #end = null; // reason of `end` on this socket
  #stopping = false;
  #timer = 0;
  #watch = 0;

  /** scene: the first scene. record: whether the service records. block: largest number of frames per message.
   *  open(url): returns a WebSocket. */
  constructor({ url, scene = {}, record = false, block = 480, open = openLive }) {
    super();
    Object.assign(this, { url, scene, record, block, open });
  }

  /** Connects; "ready" follows, or "ended". */
  start() {
    this.#watch = setInterval(() => this.#checkAlive(), 1000);
    this.#connect();
  }

  /** Sends a contact update; returns its number, null if the stream has ended.
   *  place: position (m), or speed (m/s), or x and y (m) with a direction (rad) if it is known; see `packContact`.
   *  load: N; absent: unchanged. time: s, that of the device's report. */
  move({ load, time = performance.now() / 1e3, ...place }) {
    if (this.state === "ended") return null;
    this.#load = load ?? this.#load;
    this.#direction = place.direction ?? this.#direction;
    const direction = "y" in place ? this.#direction : undefined;
    this.#contact = { ...place, direction, load: this.#load, seq: this.#seq, time, at: now(), sent: false };
    this.#seq += 1;
    if (this.state === "live" && (load === 0 || now() - this.#sentAt >= SPACING)) this.#sendContact();
    return this.#contact.seq;
  }

  /** Sets the scene of a new session, in place of the first scene and all changes. */
  set base(scene) {
    this.scene = scene;
    this.#changes = new SceneChanges();
  }

  /** Changes the scene by a partial scene. The event "scene" or "problem" follows. */
  change(partial) {
    this.#changes.add(partial);
    if (this.state === "live") this.#sendChanges();
  }

  /** Grants credit for further frames. Without effect unless the stream is live: credit ends with a connection. */
  grant(frames) {
    if (this.state !== "live" || frames < 1) return;
    if (this.outstanding === 0) this.#receivedAt = now();
    this.outstanding += frames;
    if (this.#contact && !this.#contact.sent) this.#sendContact(frames);
    else this.#send({ type: "more", frames });
  }

  /** Ends the stream. Its fade comes without credit; the event "ended" follows. */
  stop() {
    if (this.#stopping || this.state === "ended") return;
    this.#stopping = true;
    if (this.state === "live") this.#send({ type: "stop" });
    else this.#finish("stopped");
  }

  #connect() {
    this.#problem = this.#end = null;
    this.#before = [];
    this.#attached = false;
    this.#receivedAt = now();
    const socket = this.#opened(this.#opensSession ? this.url : resumeAt(this.url, this.ready.resume_url));
    if (!socket) return;
    const current = (work) => (event) => socket === this.#socket && work(event); // ignores events of replaced sockets
    let opened = false;
    this.#socket = socket;
    socket.binaryType = "arraybuffer";
    socket.onopen = current(() => {
      opened = true;
      this.#send(this.#hello());
    });
    socket.onmessage = current(({ data }) => this.#receive(data));
    socket.onclose = current(({ code }) => this.#closed(code, opened));
  }

  /** Returns a socket to `url`; null if the browser opens none, after which the stream is over. */
  #opened(url) {
    try {
      return this.open(url);
    } catch (error) {
      this.#problem = { detail: explanationOf(error), errors: [] };
      queueMicrotask(() => this.#finish("refused")); // after `start`, as with a refusal of the service
      return null;
    }
  }

  #hello() {
    if (!this.#opensSession) return { type: "hello", resume: { session: this.ready.session, frame: this.frame } };
    const { scene, block, record } = this;
    return { type: "hello", scene, format: "f32le", block, pacing: "pull", record, before_limiter: true };
  }

  #receive(message) {
    this.#receivedAt = now();
    if (typeof message !== "string") {
      this.#receiveBlock(new Float32Array(message));
      return;
    }
    const document = JSON.parse(message);
    if (document.type === "ready") this.#begin(document);
    else if (document.type === "problem") this.#note({ ...document, type: document.problem });
    else if (document.type === "end") this.#end = document.reason;
    else if (document.type === "before_limiter") this.#before.push(document);
    else {
      if (document.type === "applied") this.#applied = document.seq;
      if (document.type === "scene") {
        this.overArea = document.over_area === true;
        this.#changes.answered();
      }
      this.#dispatch(document.type, document);
    }
  }

  #receiveBlock(samples) {
    const { frame } = this;
    const frames = samples.length / this.ready.channels;
    this.frame += frames;
    this.outstanding = Math.max(0, this.outstanding - frames); // the fade at the end comes without credit
    this.#tries = 0;
    this.#dispatch("block", { frame, samples, unlimited: this.#unlimited(samples) });
  }

  /** Returns the block `samples`, which begins at the last `frame`, as it was before the limiter. */
  #unlimited(samples) {
    if (!this.#before.length) return samples;
    const { channels } = this.ready;
    const first = this.frame - samples.length / channels;
    const unlimited = samples.slice();
    for (const { frame, samples: text } of this.#before) unlimited.set(floatsOf(text), (frame - first) * channels);
    this.#before = [];
    return unlimited;
  }

  #begin(ready) {
    const resumed = !this.#opensSession;
    const renewed = this.#opensSession && this.ready !== null;
    if (resumed) this.#changes.resume();
    else if (renewed) this.#changes.restart();
    if (!resumed) this.#applied = -1;
    Object.assign(this, { ready, frame: ready.frame, state: "live", trouble: null, outstanding: 0 });
    this.overArea = ready.over_area === true;
    this.#attached = true;
    this.#opensSession = false;
    this.#sendChanges();
    this.#resendContact();
    if (resumed) this.#dispatch("resumed", { frame: ready.frame });
    else this.#dispatch("ready", { ready, renewed });
  }

  /** Sends the newest contact update (again) after a break, unless it is out of date. */
  #resendContact() {
    const last = this.#contact;
    if (!last || last.seq <= this.#applied) return;
    if ((now() - last.at) * 1e3 <= this.ready.max_silence_ms) this.#sendContact();
    else last.sent = true;
  }

  #note(problem) {
    this.#problem = problem;
    if (this.#attached && CHANGE_REFUSED.test(problem.type) && this.#changes.refused())
      this.#dispatch("refused", { problem });
    if (!this.#isGone()) this.#dispatch("problem", { problem });
  }

  /** Whether a hello that resumes was answered with not-found: the session or the frames are gone. */
  #isGone() {
    return !this.#attached && !this.#opensSession && this.#problem !== null && NOT_FOUND.test(this.#problem.type);
  }

  #closed(code, opened) {
    const gone = this.#isGone();
    const end = this.#stopping ? (this.#end ?? "stopped") : endOf(code, this.#end);
    this.#socket = null;
    this.outstanding = 0;
    if (gone && !this.#stopping) {
      this.#opensSession = true;
      this.#connect();
    } else if (end !== null) this.#finish(end);
    else this.#break(opened, code === FULL ? "full" : "broken");
  }

  async #break(opened, trouble) {
    this.trouble = trouble;
    this.state = this.ready === null ? "connecting" : "broken";
    const delay = Math.min(LARGEST_DELAY, FIRST_DELAY * 2 ** this.#tries);
    this.#dispatch("broken", { tries: this.#tries });
    this.#tries += 1;
    if (!opened) await this.#askWhy();
    if (this.state === "ended") return;
    const jitter = 0.75 + 0.5 * Math.random(); // so that the fingers of a page do not connect at the same time
    this.#timer = setTimeout(() => this.#connect(), 1e3 * jitter * delay);
  }

  /** Waits until the service answers over HTTP: with the reason of its refusal, or because it is back. */
  async #askWhy() {
    const problem = await serviceAnswer();
    if (problem === null || this.state === "ended") return;
    this.#note(problem);
    if (isFinal(problem)) this.#finish("refused");
  }

  /** Closes a connection that has not answered for a long time. */
  #checkAlive() {
    const waiting = this.outstanding > 0 || this.#stopping || (this.#socket && !this.#attached && !this.#opensSession);
    if (!waiting || !this.#socket || now() - this.#receivedAt < SILENCE) return;
    this.#socket.close();
    this.#closed(1006, true);
  }

  #finish(reason) {
    if (this.state === "ended") return;
    this.state = "ended";
    clearTimeout(this.#timer);
    clearInterval(this.#watch);
    this.#socket?.close();
    this.#socket = null;
    this.#dispatch("ended", { reason, problem: this.#problem, frame: this.frame });
  }

  /** Sends the newest contact update. more: credit that goes with it, frames. */
  #sendContact(more = 0) {
    this.#contact.sent = true;
    this.#sentAt = now();
    this.#send(packContact({ ...(this.overArea ? this.#contact : alongLine(this.#contact)), more }));
  }

  #sendChanges() {
    for (const scene of this.#changes.take()) this.#send({ type: "scene", scene });
  }

  #send(message) {
    if (this.#socket.readyState !== WebSocket.OPEN) return; // the event "close" is about to come
    this.#socket.send(message instanceof ArrayBuffer ? message : JSON.stringify(message));
  }

  #dispatch(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }
}

/** Returns the URL at which to resume: path and query of `resumeUrl` of `ready`, on the host and behind the prefix of
 *  `url`. A prefix in `resumeUrl` is that of the service, RIDGEWAVE_ROOT_PATH. */
function resumeAt(url, resumeUrl) {
  if (!resumeUrl) return url;
  const at = new URL(url, location.href);
  const reference = new URL(resumeUrl, "ws://any");
  at.pathname = at.pathname.replace(/\/v1\/live$/, "") + reference.pathname.replace(/^.*(?=\/v1\/live$)/, "");
  for (const [name, value] of reference.searchParams) at.searchParams.set(name, value);
  return at.href;
}

/** Returns the float32 numbers in base64 `text`. */
function floatsOf(text) {
  return new Float32Array(Uint8Array.from(atob(text), (byte) => byte.charCodeAt(0)).buffer);
}

function now() {
  return performance.now() / 1e3;
}
