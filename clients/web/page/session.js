/* The fingers of the page: one output, and as many live streams as fingers touch at once.

Model: a finger is opened when the first pointer needs it, kept, and taken by the next. All have the same scene; a
change goes to all of them. What is fixed for a stream (rate, channels, quantity, full scale) is changed by new ones.
Limits: MOST fingers at once; a recording has one. Events: "state" {state}, "block" {ready, samples, finger}, "ready",
"problem" {problem, sentence}, "limited" {gain_reduction_db}. */

import { Finger } from "../hand/finger.js";
import { changesWhatIsFixed, partBetween, withField } from "../knobs/merge.js";
import { siValue } from "../knobs/units.js";
import { turned } from "../live/contact.js";
import { Player } from "../sound/player.js";

const MOST = 5; // fingers of a hand; each is a stream of its own at the service
const STATES = ["broken", "ended", "connecting", "preparing", "live"]; // the worst of them is the page's

const stateOf = ({ connection, preparing }) =>
  connection.state === "live" && preparing ? "preparing" : connection.state;

/** The rate of a scene, Hz. */
const rateOf = (scene) => siValue(scene.output?.sample_rate ?? 48000, "Hz");

export class Session extends EventTarget {
  /** The Player, null before `start`. */
  player = null;
  /** The open fingers. */
  fingers = [];
  /** Whether the one finger is recorded. */
  recording = false;
  #holders = new Map(); // id of a pointer -> finger
  #volume = 0.1;
  #starting = null;
  #renewing = Promise.resolve();

  /** scene: what is touched. */
  constructor(scene) {
    super();
    this.scene = scene;
  }

  /** Master volume, 0 to 1. */
  set volume(volume) {
    this.#volume = volume;
    if (this.player) this.player.volume = volume;
  }

  /** Opens the output and the first finger; in a click or a key press. Returns once it is live. */
  start() {
    this.#starting ??= this.#open().catch((error) => {
      this.#starting = null;
      this.#refuse(error);
      throw error;
    });
    return this.#starting;
  }

  /** Ends all streams and the output. */
  async stop() {
    this.#starting = null;
    const { player } = this;
    this.player = null;
    await this.#closeFingers();
    await player?.close();
    this.#tell("state", { state: "not started" });
  }

  /** Opens new streams with `scene`; the output too, where its rate is another. One such change waits for another. */
  renew(scene = this.scene, { record = false } = {}) {
    this.scene = scene;
    this.#renewing = this.#renewing.catch(() => {}).then(() => this.#renew(scene, record));
    return this.#renewing;
  }

  async #renew(scene, record) {
    this.recording = record;
    if (!this.player) return;
    await this.#closeFingers();
    if (this.player.sampleRate !== rateOf(scene)) {
      await this.player.close();
      this.player = null;
      this.#starting = null;
      await this.start();
    } else {
      await this.#finger().opened;
    }
  }

  /** Takes `scene`, under the fingers where that can be; else by new streams. Returns whether they are new, once they
   *  are. */
  async take(scene) {
    if (changesWhatIsFixed(this.scene, scene)) {
      await this.renew(scene);
      return true;
    }
    const part = partBetween(this.scene, scene);
    this.scene = scene;
    if (!Object.keys(part).length) return false;
    for (const finger of this.fingers) {
      finger.preparing = true;
      finger.change(part);
    }
    this.#tell("state", { state: this.state });
    return false;
  }

  /** The finger of the pointer `id` is at position (m) on the pad, or at speed (m/s), with load (N), at time (s). */
  move(id, contact) {
    const finger = this.#holders.get(id) ?? this.#take(id);
    finger?.move(turned(contact));
  }

  /** The finger of the pointer `id` is lifted. */
  lift(id) {
    this.#holders.get(id)?.lift();
    this.#holders.delete(id);
  }

  /** The worst state of the fingers: "live"; "preparing" where a change is being solved; "connecting", "broken",
   *  "ended";  "not started" where there is none. */
  get state() {
    if (!this.player) return "not started";
    return STATES.find((state) => this.fingers.some((finger) => stateOf(finger) === state)) ?? "connecting";
  }

  /** underruns: of all fingers. latency: s. updateToSound: s, of the slowest finger, or null. */
  get stats() {
    const all = this.fingers.map(({ stats }) => stats);
    const delays = all.map(({ updateToSound }) => updateToSound).filter((delay) => delay !== null);
    const underruns = all.reduce((sum, one) => sum + one.underruns, 0);
    return { underruns, latency: this.player?.latency ?? 0, updateToSound: delays.length ? Math.max(...delays) : null };
  }

  async #open() {
    this.#tell("state", { state: "connecting" });
    this.player = await Player.open({ sampleRate: rateOf(this.scene) }).catch((error) => {
      if (error.name !== "NotSupportedError") throw error;
      throw new Error("This browser cannot play that sample rate: write 48 kHz, or download the WAV.");
    });
    this.player.volume = this.#volume;
    this.#tell("player", { player: this.player });
    await this.#finger().opened;
  }

  #take(id) {
    if (!this.player) return null;
    const held = new Set(this.#holders.values());
    const free = this.fingers.find((finger) => !held.has(finger) && finger.connection.state !== "ended");
    const most = this.recording ? 1 : MOST;
    if (!free && this.fingers.length >= most) return null;
    const finger = free ?? this.#finger();
    this.#holders.set(id, finger);
    return finger;
  }

  #finger() {
    const finger = new Finger({ player: this.player, scene: this.#pinned(), record: this.recording });
    this.fingers.push(finger);
    for (const type of ["ready", "broken", "resumed", "ended", "scene", "problem"])
      finger.addEventListener(type, ({ detail }) => this.#changed(finger, type, detail));
    finger.addEventListener("block", ({ detail }) =>
      this.#tell("block", { ...detail, finger, ready: finger.connection.ready }),
    );
    finger.addEventListener("problem", ({ detail }) =>
      this.#tell("problem", { problem: detail.problem, sentence: detail.problem.detail ?? detail.problem.title }),
    );
    finger.addEventListener("limited", ({ detail }) => this.#tell("limited", detail));
    finger.opened = finger.open();
    finger.opened.catch(() => {}); // told with "ended"
    return finger;
  }

  /** The scene with the full scale of the fingers that there are, so that the next one is as loud as they are. */
  #pinned() {
    const ready = this.fingers[0]?.connection.ready;
    const own = ready?.quantities.filter((quantity) => quantity !== "tangential_force") ?? [];
    if (own.length !== 1 || this.scene.output?.channels) return this.scene;
    return withField(this.scene, ["output", "full_scale"], ready.full_scale[0]);
  }

  #changed(finger, type, detail) {
    if (["ready", "scene", "problem"].includes(type)) finger.preparing = false;
    if (type === "ready") this.#tell("ready", detail);
    if (type === "ended") this.#drop(finger);
    this.#tell("state", { state: this.state });
  }

  /** The finger has ended by itself; with the last one the page's sound ends, until it is started again. */
  #drop(finger) {
    if (!this.fingers.includes(finger)) return;
    this.fingers = this.fingers.filter((other) => other !== finger);
    for (const [id, held] of this.#holders) if (held === finger) this.#holders.delete(id);
    if (!this.fingers.length) this.stop();
  }

  async #closeFingers() {
    const closing = this.fingers;
    this.fingers = [];
    this.#holders.clear();
    await Promise.allSettled(closing.map((finger) => finger.close()));
  }

  #refuse(error) {
    this.#tell("problem", { problem: error.problem ?? null, sentence: error.message });
    this.#tell("state", { state: this.state });
  }

  #tell(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }
}
