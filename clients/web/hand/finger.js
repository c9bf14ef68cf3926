/* One finger on the texture: a live stream, and the source that plays it.

Model: while the finger touches, and after a lift until the sound has faded, the finger grants the credit that keeps the
queue of the player full. At other times it grants none, so the service sends nothing and no underruns are counted. A
finger at rest repeats its contact update, because the watchdog of the service lifts fingers that send none.
Limits: the sample rate of the scene must be that of the player. Browsers slow down pages in the background; the
watchdog then lifts the finger. */

import { Explained } from "../explained.js";
import { LiveConnection } from "../live/connection.js";
import { StreamScene } from "../live/stream_scene.js";
import { liveUrl } from "../service.js";

const EVENTS = ["ready", "block", "applied", "scene", "limited", "problem", "broken", "resumed", "ended"];
const FILLED = 0.8; // part of the queue that is filled before sound begins; less risks a gap, more delays the sound
const LEAST_GRANT = 64; // frames; smaller credits cost more messages
const QUIET = 0.05; // s of zeros after a lift until credit ends
const FADING = 2; // s after a lift until credit ends in any case
const RESTS = 2.5; // mean intervals without a move until the finger counts as resting and its update is repeated
const SOONEST = 20; // ms, least time until then; less would stop a finger between reports of a slow pointer
const LATEST = 80; // ms, longest time until then; the watchdog waits 250 ms (RIDGEWAVE_MAX_SILENCE)
const DRAINED = 1000; // ms allowed for the end to be played
const PUMP = 50; // ms between single blocks that are requested for a change without a touch
const KEPT = 33; // delays from update to sound, for the median

export class Finger extends EventTarget {
  /** The LiveConnection. */
  connection = null;
  /** The StreamScene. */
  scene = null;
  /** The Source; null until the stream is ready. */
  source = null;
  /** Whether it touches. */
  touching = false;
  #sounding = false;
  #rested = true;
  #quiet = 0; // frames of zeros since the lift
  #lifted = 0; // frames since the lift
  #missing = 0;
  #shift = 0; // frames given to the source before the session's frame 0
  #place = null; // of the last update: position, speed, or x, y and direction
  #load; // N, its load
  #sentAt = 0; // ms
  #movedAt = 0; // ms
  #interval = 8; // ms between moves, running mean
  #sent = new Map(); // number of an update -> time at which it was sent, s
  #coming = []; // updates that were applied but not heard yet
  #delays = [];
  #timer = 0;
  #pump = 0;
  #unheard = false; // blocks belong to no touch and are not played

  /** player: an open Player. scene: a scene with the player's sample rate. record: whether the service records. block:
   *  frames. */
  constructor({ player, scene = {}, record = false, block = 480, url = liveUrl(), open }) {
    super();
    this.player = player;
    const how = { url, scene, record, block };
    this.connection = new LiveConnection(open ? { ...how, open } : how);
    this.scene = new StreamScene(this.connection, scene, () => this.#scenePending());
  }

  /** Connects; returns the document of `ready`. Throws an Explained with `problem` (null: none) if the stream ends before. */
  async open() {
    const { connection } = this;
    connection.addEventListener("ready", ({ detail }) => this.#begin(detail.ready));
    connection.addEventListener("resumed", () => this.#feed());
    connection.addEventListener("block", ({ detail }) => this.#play(detail.samples));
    connection.addEventListener("applied", ({ detail }) => this.#note(detail));
    connection.addEventListener("ended", () => this.#rest());
    const opened = new Promise((resolve, reject) => {
      connection.addEventListener("ready", ({ detail }) => resolve(detail.ready), { once: true });
      connection.addEventListener("ended", ({ detail }) => reject(refusalOf(detail)), { once: true });
    });
    for (const type of EVENTS) {
      connection.addEventListener(type, ({ detail }) => this.dispatchEvent(new CustomEvent(type, { detail })));
    }
    connection.start();
    const ready = await opened;
    if (ready.sample_rate !== this.player.sampleRate) {
      connection.stop();
      throw new Error(
        `The stream has ${ready.sample_rate} Hz and the player another rate: open a player of that rate.`,
      );
    }
    return ready;
  }

  /** Moves the finger. place: position (m), or speed (m/s), or x and y (m) with a direction (rad) if it is known. load:
   *  N; absent: unchanged. time: s. */
  move({ load, time, ...place }) {
    const now = performance.now();
    const interval = now - this.#movedAt;
    if (interval < LATEST) this.#interval += (interval - this.#interval) / 8;
    this.#movedAt = now;
    this.#place = place;
    if (load !== undefined) this.#load = load;
    if (load !== undefined) this.touching = load !== 0;
    if (this.touching) this.#quiet = this.#lifted = 0;
    this.#send({ ...place, load, time });
    if (this.touching && !this.#timer) this.#hold();
    if (this.touching && !this.#sounding) {
      this.#sounding = true;
      this.#unheard = false;
      this.#feed();
    }
  }

  /** The last place and load, with the present time, as arguments of `move`. */
  get contact() {
    return { ...this.#place, load: this.#load, time: performance.now() / 1e3 };
  }

  /** Lifts the finger at its place. */
  lift() {
    if (this.touching) this.move({ ...this.#place, load: 0 });
  }

  /** Changes the stream to `scene`. The event "sceneStatus" follows. */
  change(scene) {
    this.scene.change(scene);
  }

  /** Ends the stream; returns when its fade was played. */
  async close() {
    clearInterval(this.#timer);
    clearInterval(this.#pump);
    this.touching = this.#sounding = false;
    const { connection, source } = this;
    if (connection.outstanding === 0) this.#rest();
    if (connection.state !== "ended") {
      const ended = new Promise((resolve) => connection.addEventListener("ended", resolve, { once: true }));
      connection.stop();
      await ended;
    }
    if (!source) return;
    const deadline = performance.now() + DRAINED;
    while (source.played < source.given && performance.now() < deadline) await pause(10);
    source.close();
  }

  /** underruns: their number. queued: frames. latency: s from the queue to the loudspeaker, as far as the browser
   *  knows. updateToSound: s from `move` to the first sample that depends on it, at the audio thread; median of the
   *  last ones, null before the first. */
  get stats() {
    const { player, source } = this;
    const queued = source ? source.queued : 0;
    const latency = player.outputLatency + queued / player.sampleRate;
    const delays = [...this.#delays].sort((one, other) => one - other);
    const updateToSound = delays[delays.length >> 1] ?? null;
    return { underruns: source ? source.underruns : 0, queued, latency, updateToSound };
  }

  #begin(ready) {
    if (ready.sample_rate !== this.player.sampleRate) return;
    if (!this.source) {
      this.source = this.player.source(ready.channels);
      this.source.onreport = (frames, report) => this.#onReport(frames, report);
    }
    this.#shift = this.source.given - ready.frame;
    this.#coming = [];
    this.#feed();
  }

  #send(contact) {
    const seq = this.connection.move(contact);
    if (seq === null) return;
    this.#sentAt = performance.now();
    this.#sent.set(seq, this.#sentAt / 1e3);
    if (this.#sent.size > 1000) this.#sent.delete(this.#sent.keys().next().value);
  }

  /** Repeats the contact update while the finger touches and rests. */
  #hold() {
    this.#timer = setInterval(() => {
      const rests = Math.min(LATEST, Math.max(SOONEST, RESTS * this.#interval));
      if (this.touching && performance.now() - this.#sentAt >= rests) this.#send(this.#place);
      if (this.touching) return;
      clearInterval(this.#timer);
      this.#timer = 0;
    }, SOONEST / 2);
  }

  /** Requests blocks for a change without a touch: the service applies changes at the beginning of a block. */
  #scenePending() {
    this.dispatchEvent(new CustomEvent("sceneStatus"));
    clearInterval(this.#pump);
    this.#pump = this.scene.pending ? setInterval(() => this.#advance(), PUMP) : 0;
  }

  #advance() {
    const { connection } = this;
    if (connection.state === "ended") clearInterval(this.#pump);
    if (this.#sounding || connection.state !== "live" || connection.outstanding) return;
    if (!this.#place) {
      this.#unheard = true; // a scene with a motion of its own sounds until the first update
      this.move({ speed: 0, load: 0 });
    }
    connection.grant(connection.block);
  }

  #feed() {
    if (!this.#sounding || !this.source) return;
    const missing = this.player.depth.frames - this.source.queued - this.connection.outstanding;
    if (missing >= LEAST_GRANT) this.connection.grant(missing);
  }

  #play(samples) {
    if (this.#unheard) {
      this.#shift -= samples.length / this.source.channels;
      return;
    }
    const granted = this.source.queued + samples.length / this.source.channels + this.connection.outstanding;
    this.source.ahead = Math.min(FILLED * this.player.depth.frames, granted); // never wait for more than was granted
    this.source.play(samples);
    this.#rested = false;
    const frames = samples.length / this.source.channels;
    if (this.#sounding && !this.touching) {
      this.#lifted += frames;
      this.#quiet = samples.every((sample) => sample === 0) ? this.#quiet + frames : 0;
      const rate = this.player.sampleRate;
      if (this.#quiet >= QUIET * rate || this.#lifted >= FADING * rate) this.#sounding = false;
    }
    if (!this.#sounding && this.connection.outstanding === 0) this.#rest();
  }

  #rest() {
    if (this.source && !this.#rested) this.source.rest();
    this.#rested = true;
  }

  #onReport(played, { least, missing }) {
    const { depth } = this.player;
    const live = this.#sounding && this.connection.state === "live";
    if (live) depth.observe({ played, least, missing: missing - this.#missing });
    this.#missing = missing;
    this.#feed();
    while (this.#coming.length && this.#coming[0].frame < this.source.played) {
      const { frame, at } = this.#coming.shift();
      this.#delays.push(performance.now() / 1e3 - (this.source.played - frame) / this.player.sampleRate - at);
      if (this.#delays.length > KEPT) this.#delays.shift();
    }
  }

  #note({ seq, frame }) {
    const at = this.#sent.get(seq);
    for (const earlier of this.#sent.keys()) {
      if (earlier > seq) break;
      this.#sent.delete(earlier);
    }
    if (at !== undefined) this.#coming.push({ frame: frame + this.#shift, at });
  }
}

/** Returns why a stream ended, as a sentence. Takes the detail of the event "ended". */
export function whyEnded({ reason, problem }) {
  return problem?.detail ?? `The live stream ended: ${reason}.`;
}

function refusalOf(detail) {
  return Object.assign(new Explained(whyEnded(detail)), { problem: detail.problem ?? null });
}

function pause(milliseconds) {
  return new Promise((resolve) => setTimeout(resolve, milliseconds));
}
