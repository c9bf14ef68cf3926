/* The fingers of the page: one output, and as many live streams as fingers touch at once.

Model: a finger is opened when the first pointer needs it, kept, and taken by the next. All have the same scene; a
change goes to all of them. What is fixed for a stream (rate, channels, quantity, full scale) is changed by new ones.
Limits: MOST fingers at once; a recording has one. Events: "state" {state}, "block" {ready, samples, finger}, "ready",
"problem" {problem, sentence}, "limited" {reduction} in dB. */

import { Finger } from "../hand/finger.js";
import { changesWhatIsFixed } from "../knobs/merge.js";
import { turned } from "../live/contact.js";
import { pinned } from "../live/stream_scene.js";
import { Player } from "../sound/player.js";
import { roomier } from "./limiter.js";
import { agreementOf, rateOf, stateOf, statsOf } from "./standing.js";

const MOST = 5; // fingers of a hand; each is a stream of its own at the service

export class Session extends EventTarget {
  /** The Player, null before `start`. */
  player = null;
  /** The open fingers. */
  fingers = [];
  /** Whether the one finger is recorded. */
  recording = false;
  /** dB by which the limiter turned the sound down, at most, since the streams or their scene are new. */
  reduction = 0;
  #recent = 0; // dB, the last that was told: of the stroke of now, where the most may be of a landing
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

  /** Opens the output and the first finger, at any gesture; it sounds from the first one on that may wake the browser.
   *  Returns once the finger is live. */
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
    this.#limit(0);
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
    this.#limit(0);
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

  /** New streams in place of those that the limiter turned down, with an automatic full scale of the present scene, or
   *  the one that the limiter called for where that gives no room; under the same hands, at the same volume. Returns
   *  {full_scale, quantity}, null where there is nothing to rescale. */
  rescale() {
    this.#renewing = this.#renewing.catch(() => {}).then(() => this.#rescale());
    return this.#renewing;
  }

  async #rescale() {
    const { player, fingers: before } = this;
    const ready = before[0]?.connection.ready;
    if (!ready) return null;
    this.recording = false;
    const need = { scene: this.scene, ready, reduction: this.#recent, count: this.#holders.size };
    const fresh = await roomier(need, (what) => this.#made(what).opened);
    if (this.player !== player) {
      for (const finger of fresh) finger.close();
      return null;
    }
    this.#hand(fresh);
    this.#limit(0);
    const { full_scale: scale, quantities } = fresh[0].connection.ready;
    return { full_scale: scale[0], quantity: quantities[0] };
  }

  /** Each finger that touches goes on in one of `fresh`; those before fade out. */
  #hand(fresh) {
    const before = this.fingers;
    this.fingers = fresh;
    for (const [index, [id, old]] of [...this.#holders].entries()) {
      this.#holders.set(id, fresh[index]);
      if (old.touching) fresh[index].move(old.contact);
    }
    for (const finger of before) finger.close();
    for (const finger of fresh) finger.become(this.scene);
    this.#tell("state", { state: this.state });
  }

  /** Takes `scene`, under the fingers where that can be; else by new streams. Returns whether they are new, once they
   *  are. */
  async take(scene) {
    if (changesWhatIsFixed(this.scene, scene)) {
      await this.renew(scene);
      return true;
    }
    this.scene = scene;
    for (const finger of this.fingers) finger.become(scene);
    if (this.fingers.some(({ scene: { pending } }) => pending)) this.#limit(0);
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

  /** As of standing.js. */
  get state() {
    return stateOf(this.player, this.fingers);
  }

  get agreement() {
    return agreementOf(this.player, this.fingers);
  }

  get stats() {
    return statsOf(this.player, this.fingers);
  }

  async #open() {
    this.#tell("state", { state: "connecting" });
    this.player = await Player.open({ sampleRate: rateOf(this.scene) });
    this.player.volume = this.#volume;
    this.player.addEventListener("awake", () => this.#tell("state", { state: this.state }));
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
    const finger = this.#made(pinned(this.scene, this.fingers[0]?.connection.ready));
    this.fingers.push(finger);
    return finger;
  }

  #made(scene) {
    const finger = new Finger({ player: this.player, scene, record: this.recording });
    for (const type of ["ready", "broken", "resumed", "ended", "agreement"])
      finger.addEventListener(type, ({ detail }) => this.#changed(finger, type, detail));
    finger.addEventListener("block", ({ detail }) =>
      this.#tell("block", { ...detail, finger, ready: finger.connection.ready }),
    );
    finger.addEventListener("problem", ({ detail }) =>
      this.#tell("problem", { problem: detail.problem, sentence: detail.problem.detail ?? detail.problem.title }),
    );
    finger.addEventListener("limited", ({ detail }) => {
      if (!this.fingers.includes(finger)) return;
      this.#recent = detail.gain_reduction_db;
      this.#limit(Math.max(this.reduction, this.#recent));
    });
    finger.opened = finger.open().then(() => finger);
    finger.opened.catch(() => {}); // told with "ended"
    return finger;
  }

  /** Notes by how many dB the limiter turned the sound down, at most, since the streams or their scene are new. */
  #limit(reduction) {
    this.reduction = reduction;
    this.#tell("limited", { reduction });
  }

  #changed(finger, type, detail) {
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
