/* One finger on the texture: a live stream, and the source that plays it.

While the finger touches, and until its sound has faded after it left, the stream is granted what keeps the queue at the
player's depth; else nothing is granted, nothing is sent and nothing counts as missing. A finger that rests goes on
telling where it is, since the service lifts one that it does not hear of.
Limits: the scene's rate has to be the player's. A page in the background is slowed down by the browser, and its finger
lifted by the service. */

import { LiveConnection } from "../live/connection.js";
import { StreamScene } from "../live/stream_scene.js";
import { liveUrl } from "../service.js";

const EVENTS = ["ready", "block", "applied", "scene", "limited", "problem", "broken", "resumed", "ended"];
const FILLED = 0.8; // of the depth before sound begins; less is a gap where the first grants are late, more comes later
const LEAST_GRANT = 64; // frames: a smaller credit is a message for a millisecond of sound
const QUIET = 0.05; // s of exact zeros after a lift, then nothing more is asked for
const FADING = 2; // s after a lift, then nothing more is asked for, whatever it sounds like
const RESTS = 2.5; // intervals between moves without a move: the finger rests, and the service must not go on with it
const SOONEST = 20; // ms before that; sooner would stop a finger between the reports of a slow pointer
const LATEST = 80; // ms; RIDGEWAVE_MAX_SILENCE is 250
const DRAINED = 1000; // ms for the end to be played
const PUMP = 50; // ms between blocks that are asked for without a touch, while a change is on its way
const KEPT = 33; // updates whose way to the sound is remembered

export class Finger extends EventTarget {
  /** The LiveConnection. */
  connection = null;
  /** The StreamScene: of which scene the sound is. */
  scene = null;
  /** The Source, once the stream is ready. */
  source = null;
  /** Whether it touches. */
  touching = false;
  #sounding = false;
  #rested = true;
  #quiet = 0; // frames of zeros since the lift
  #lifted = 0; // frames since the lift
  #missing = 0;
  #shift = 0; // frames given to the source before the session's frame 0
  #place = null; // position or speed of the last contact
  #load; // N, its load
  #toldAt = 0; // ms
  #movedAt = 0; // ms
  #interval = 8; // ms between moves, about
  #sent = new Map(); // update -> when, s
  #coming = []; // updates that were applied and are not yet heard
  #delays = [];
  #timer = 0;
  #pump = 0;
  #unheard = false; // what comes is of no touch, and is not played

  /** player: an open Player. scene: as over HTTP, of the player's rate. record: keep a recording. block: frames. */
  constructor({ player, scene = {}, record = false, block = 480, url = liveUrl(), open }) {
    super();
    this.player = player;
    const how = { url, scene, record, block };
    this.connection = new LiveConnection(open ? { ...how, open } : how);
    this.scene = new StreamScene(this.connection, scene, () => this.#scenePending());
  }

  /** Connects; returns the document of `ready`, throws where the stream ends before it. */
  async open() {
    const { connection } = this;
    connection.addEventListener("ready", ({ detail }) => this.#begin(detail.ready));
    connection.addEventListener("resumed", () => this.#feed());
    connection.addEventListener("block", ({ detail }) => this.#play(detail.samples));
    connection.addEventListener("applied", ({ detail }) => this.#note(detail));
    connection.addEventListener("ended", () => this.#rest());
    const opened = new Promise((resolve, reject) => {
      connection.addEventListener("ready", ({ detail }) => resolve(detail.ready), { once: true });
      connection.addEventListener("ended", ({ detail }) => reject(new Error(whyEnded(detail))), { once: true });
    });
    for (const type of EVENTS) {
      connection.addEventListener(type, ({ detail }) => this.dispatchEvent(new CustomEvent(type, { detail })));
    }
    connection.start();
    const ready = await opened;
    if (ready.sample_rate !== this.player.sampleRate) {
      connection.stop();
      throw new Error(`The sound has ${ready.sample_rate} Hz: open a player of that rate.`);
    }
    return ready;
  }

  /** Says what the finger does: position in m (or speed in m/s), load in N (absent: as before), time in s. */
  move({ position, speed, load, time }) {
    const now = performance.now();
    const interval = now - this.#movedAt;
    if (interval < LATEST) this.#interval += (interval - this.#interval) / 8;
    this.#movedAt = now;
    this.#place = { position, speed };
    if (load !== undefined) this.#load = load;
    if (load !== undefined) this.touching = load !== 0;
    if (this.touching) this.#quiet = this.#lifted = 0;
    this.#tell({ position, speed, load, time });
    if (this.touching && !this.#timer) this.#hold();
    if (this.touching && !this.#sounding) {
      this.#sounding = true;
      this.#unheard = false;
      this.#feed();
    }
  }

  /** Where it was last, and its load, now, as `move` takes them. */
  get contact() {
    return { ...this.#place, load: this.#load, time: performance.now() / 1e3 };
  }

  /** Takes the finger off, where it is. */
  lift() {
    if (this.touching) this.move({ ...this.#place, load: 0 });
  }

  /** Changes the scene by a partial scene, under the finger. */
  change(partial) {
    this.connection.change(partial);
  }

  /** Has the stream become that of `scene`, under the finger; "agreement" tells how that stands. */
  become(scene) {
    this.scene.become(scene);
  }

  /** Ends the stream with its fade; returns once that was played. */
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

  /** underruns: how often the sound broke off. queued: frames. latency: s from what is given now to the loudspeaker,
   *  as far as the browser knows. updateToSound: s from `move` to the first sample that follows it, at the audio
   *  thread, the median of the last ones; null before the first. */
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
      this.source.onhungry = (frames, report) => this.#hungry(frames, report);
    }
    this.#shift = this.source.given - ready.frame;
    this.#coming = [];
    this.#feed();
  }

  #tell(contact) {
    const seq = this.connection.move(contact);
    if (seq === null) return;
    this.#toldAt = performance.now();
    this.#sent.set(seq, this.#toldAt / 1e3);
    if (this.#sent.size > 1000) this.#sent.delete(this.#sent.keys().next().value);
  }

  /** Tells again where the finger is, as long as it touches and does not move. */
  #hold() {
    this.#timer = setInterval(() => {
      const rests = Math.min(LATEST, Math.max(SOONEST, RESTS * this.#interval));
      if (this.touching && performance.now() - this.#toldAt >= rests) this.#tell(this.#place);
      if (this.touching) return;
      clearInterval(this.#timer);
      this.#timer = 0;
    }, SOONEST / 2);
  }

  /** A change is taken over when a block begins: without a touch some are asked for, of a finger that is lifted. */
  #scenePending() {
    this.dispatchEvent(new CustomEvent("agreement"));
    clearInterval(this.#pump);
    this.#pump = this.scene.pending ? setInterval(() => this.#advance(), PUMP) : 0;
  }

  #advance() {
    const { connection } = this;
    if (connection.state === "ended") clearInterval(this.#pump);
    if (this.#sounding || connection.state !== "live" || connection.outstanding) return;
    if (!this.#place) {
      this.#unheard = true; // a scene that moves by itself sounds until the first contact fades it out
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
    this.source.ahead = Math.min(FILLED * this.player.depth.frames, granted); // more than comes would never begin
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

  #hungry(played, { least, missing }) {
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

/** Returns why a stream ended, from the detail of "ended", as a sentence. */
export function whyEnded({ reason, problem }) {
  return problem?.detail ?? `The live stream ended: ${reason}.`;
}

function pause(milliseconds) {
  return new Promise((resolve) => setTimeout(resolve, milliseconds));
}
