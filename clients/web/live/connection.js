/* One live stream of the service (docs/live.md), over as many WebSockets as it takes.

Frames are counted from the session's first; `frame` of them came, whole messages only. When the connection breaks, the
next one asks for frame `frame`, so no sample is lost or comes twice. Where the session is gone (the service was started
anew, or the break was too long) a new one is opened with the same scene, its changes and the same hand: its frames
begin at 0 again, and "ready" says `renewed`.
A contact waits in one place, where the newer takes that of the older, and is said ahead of the credit that follows it.
Events (CustomEvent, `detail`): ready {ready, renewed}, block {frame, samples}, applied {seq, frame},
scene {frame, plan}, refused {problem}: a change; limited {frame, gain_reduction_db}, problem {problem}, broken {tries}, resumed {frame},
ended {reason, problem, frame}.
Limits: samples are read in the machine's byte order, little-endian wherever browsers run. An upgrade that is refused (a
wrong key, say) looks like a break to a page, so after a connection that never opened the service is asked over HTTP. */

import { openLive } from "../service.js";
import { Changes } from "./changes.js";
import { answering, endOf, isFinal } from "./closing.js";
import { packContact } from "./contact.js";

const FIRST_DELAY = 0.2; // s before the first try; longer is a longer silence
const LARGEST_DELAY = 5; // s between tries; longer wastes the time for which the service keeps a session
const SPACING = 0.001; // s between contacts: a mouse of 8 kHz would pass RIDGEWAVE_MAX_UPDATES
const SILENCE = 4; // s without an answer to credit, or to a hello that resumes, after which a connection is given up
const CHANGE_REFUSED = /#problem-(scene-refused|fixed|cannot-render)$/;
const NOT_FOUND = /#problem-not-found$/;

export class LiveConnection extends EventTarget {
  /** The document of `ready`, null before it. */
  ready = null;
  /** Number of the next frame that comes. */
  frame = 0;
  /** "connecting", "live", "broken" or "ended". */
  state = "connecting";
  /** Frames granted that have not come. */
  outstanding = 0;
  #socket = null;
  #attached = false; // `ready` has come on this socket
  #anew = true; // the next hello asks for a new session
  #changes = new Changes();
  #contact = null; // the newest, and whether it was said
  #seq = 0;
  #saidAt = 0;
  #heardAt = 0;
  #applied = -1;
  #tries = 0;
  #told = null; // the last problem on this socket
  #end = null; // the reason of `end` on this socket
  #stopping = false;
  #timer = 0;
  #watch = 0;

  /** scene: as over HTTP. record: keep a recording. block: frames of a message at most. open: makes the WebSocket. */
  constructor({ url, scene = {}, record = false, block = 480, open = openLive }) {
    super();
    Object.assign(this, { url, scene, record, block, open });
  }

  /** Connects; "ready" follows, or "ended". */
  start() {
    this.#watch = setInterval(() => this.#look(), 1000);
    this.#connect();
  }

  /** Says what the finger does now; returns the number of the update, null where the stream has ended.
   *  position: m, or speed: m/s. load: N, absent = as before. time: s, of the device's report. */
  move({ position, speed, load, time = performance.now() / 1e3 }) {
    if (this.state === "ended") return null;
    const unsaid = this.#contact && !this.#contact.said ? this.#contact.load : undefined;
    this.#contact = { seq: this.#seq, time, position, speed, load: load ?? unsaid, at: now(), said: false };
    this.#seq += 1;
    if (this.state === "live" && (load === 0 || now() - this.#saidAt >= SPACING)) this.#sayContact();
    return this.#contact.seq;
  }

  /** The scene that a new session begins with, where this one is lost, in place of the first scene and its changes. */
  set base(scene) {
    this.scene = scene;
    this.#changes = new Changes();
  }

  /** Changes the scene by a partial scene; "scene" follows, or "problem". */
  change(partial) {
    this.#changes.ask(partial);
    if (this.state === "live") this.#sayChanges();
  }

  /** Lets the service send so many frames more; nothing unless the stream is live: credit ends with a connection. */
  grant(frames) {
    if (this.state !== "live" || frames < 1) return;
    if (this.#contact && !this.#contact.said) this.#sayContact();
    if (this.outstanding === 0) this.#heardAt = now();
    this.outstanding += frames;
    this.#say({ type: "more", frames });
  }

  /** Asks for the end: the sound fades, beyond all credit, and "ended" follows. */
  stop() {
    if (this.#stopping || this.state === "ended") return;
    this.#stopping = true;
    if (this.state === "live") this.#say({ type: "stop" });
    else this.#finish("stopped");
  }

  #connect() {
    this.#told = this.#end = null;
    this.#attached = false;
    this.#heardAt = now();
    const socket = this.open(this.#anew ? this.url : resumeAt(this.url, this.ready.resume_url));
    const heed = (work) => (event) => socket === this.#socket && work(event); // an abandoned one is not heard
    let opened = false;
    this.#socket = socket;
    socket.binaryType = "arraybuffer";
    socket.onopen = heed(() => {
      opened = true;
      this.#say(this.#hello());
    });
    socket.onmessage = heed(({ data }) => this.#receive(data));
    socket.onclose = heed(({ code }) => this.#lost(code, opened));
  }

  #hello() {
    if (!this.#anew) return { type: "hello", resume: { session: this.ready.session, frame: this.frame } };
    const { scene, block, record } = this;
    return { type: "hello", scene, format: "f32le", block, pacing: "pull", record };
  }

  #receive(message) {
    this.#heardAt = now();
    if (typeof message !== "string") {
      this.#hear(new Float32Array(message));
      return;
    }
    const said = JSON.parse(message);
    if (said.type === "ready") this.#begin(said);
    else if (said.type === "problem") this.#note({ ...said, type: said.problem });
    else if (said.type === "end") this.#end = said.reason;
    else {
      if (said.type === "applied") this.#applied = said.seq;
      if (said.type === "scene") this.#changes.answered();
      this.#tell(said.type, said);
    }
  }

  #hear(samples) {
    const { frame } = this;
    const frames = samples.length / this.ready.channels;
    this.frame += frames;
    this.outstanding = Math.max(0, this.outstanding - frames); // the fade at the end comes beyond the credit
    this.#tries = 0;
    this.#tell("block", { frame, samples });
  }

  #begin(ready) {
    const resumed = !this.#anew;
    const renewed = this.#anew && this.ready !== null;
    if (resumed) this.#changes.resume();
    else if (renewed) this.#changes.beginAnew();
    if (!resumed) this.#applied = -1;
    Object.assign(this, { ready, frame: ready.frame, state: "live", outstanding: 0 });
    this.#attached = true;
    this.#anew = false;
    this.#sayChanges();
    this.#recall();
    if (resumed) this.#tell("resumed", { frame: ready.frame });
    else this.#tell("ready", { ready, renewed });
  }

  /** Says the newest contact again, or at last, where it still holds: an older one is what the hand no longer does. */
  #recall() {
    const last = this.#contact;
    if (!last || last.seq <= this.#applied) return;
    if ((now() - last.at) * 1e3 <= this.ready.max_silence_ms) this.#sayContact();
    else last.said = true;
  }

  #note(problem) {
    this.#told = problem;
    if (this.#attached && CHANGE_REFUSED.test(problem.type) && this.#changes.refused())
      this.#tell("refused", { problem });
    if (!this.#forgotten()) this.#tell("problem", { problem });
  }

  /** Whether a hello that resumes was answered that the session, or its past, is gone. */
  #forgotten() {
    return !this.#attached && !this.#anew && this.#told !== null && NOT_FOUND.test(this.#told.type);
  }

  #lost(code, opened) {
    const forgotten = this.#forgotten();
    const end = this.#stopping ? (this.#end ?? "stopped") : endOf(code, this.#end);
    this.#socket = null;
    this.outstanding = 0;
    if (forgotten && !this.#stopping) {
      this.#anew = true;
      this.#connect();
    } else if (end !== null) this.#finish(end);
    else this.#break(opened);
  }

  async #break(opened) {
    this.state = this.ready === null ? "connecting" : "broken";
    const delay = Math.min(LARGEST_DELAY, FIRST_DELAY * 2 ** this.#tries);
    this.#tell("broken", { tries: this.#tries });
    this.#tries += 1;
    if (!opened) await this.#askWhy();
    if (this.state === "ended") return;
    const jitter = 0.75 + 0.5 * Math.random(); // so that the fingers of a page do not come all at once
    this.#timer = setTimeout(() => this.#connect(), 1e3 * jitter * delay);
  }

  /** Waits until the service answers: it says why it does not take a connection, or it is back. */
  async #askWhy() {
    const problem = await answering();
    if (problem === null || this.state === "ended") return;
    this.#note(problem);
    if (isFinal(problem)) this.#finish("refused");
  }

  /** Gives up a connection that only looks alive: it owes an answer, and has long said nothing. */
  #look() {
    const owed = this.outstanding > 0 || this.#stopping || (this.#socket && !this.#attached && !this.#anew);
    if (!owed || !this.#socket || now() - this.#heardAt < SILENCE) return;
    this.#socket.close();
    this.#lost(1006, true);
  }

  #finish(reason) {
    if (this.state === "ended") return;
    this.state = "ended";
    clearTimeout(this.#timer);
    clearInterval(this.#watch);
    this.#socket?.close();
    this.#socket = null;
    this.#tell("ended", { reason, problem: this.#told, frame: this.frame });
  }

  #sayContact() {
    this.#contact.said = true;
    this.#saidAt = now();
    this.#say(packContact(this.#contact));
  }

  #sayChanges() {
    for (const scene of this.#changes.take()) this.#say({ type: "scene", scene });
  }

  #say(message) {
    if (this.#socket.readyState !== WebSocket.OPEN) return; // its end is about to be told
    this.#socket.send(message instanceof ArrayBuffer ? message : JSON.stringify(message));
  }

  #tell(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }
}

/** The URL that `ready` says to resume at: its path and query, on the host of `url`, behind what `url` has before. */
function resumeAt(url, told) {
  if (!told) return url;
  const at = new URL(url, location.href);
  const reference = new URL(told, "ws://any");
  at.pathname = at.pathname.replace(/\/v1\/live$/, "") + reference.pathname;
  for (const [name, value] of reference.searchParams) at.searchParams.set(name, value);
  return at.href;
}

function now() {
  return performance.now() / 1e3;
}
