/* Everything that sounds on the pad page: one player, and a live stream for each finger.

Model: a finger is opened when a pointer needs it, stays open, and serves the next pointer. All fingers have the same
scene. A change of what is fixed for a stream (rate, channels, quantity, full scale) opens new streams. So does the
choice of a texture, which has its own automatic full scale, so that its level does not depend on those before. The
present streams sound until the new ones are open. A full scale that the scene names, or a recording, is kept.
Limits: at most MOST_FINGERS at once; one in a recording.
Events: "state" {state}, "player" {player}, "block" {ready, samples, unlimited, finger}, "ready" {ready}, "plan" {plan: of a
stream}, "problem" {problem, sentence}, "limited" {reduction} in dB. */

import { explanationOf } from "../explained.js";
import { Finger } from "../hand/finger.js";
import { changesWhatIsFixed, hasFullScale, same, withField } from "../scene/merge.js";
import { placed } from "../live/contact_update.js";
import { forHand, neededFullScale, withFullScaleOf } from "../live/stream_scene.js";
import { Player } from "../sound/player.js";
import { endSentence } from "./status_texts.js";
import { rateOf, soundStatusOf, stateOf, statsOf } from "./session_status.js";

const MOST_FINGERS = 5; // those of a hand; each is a stream of the service

export class TouchSession extends EventTarget {
  /** The Player, null before `start`. */
  player = null;
  /** The open fingers. */
  fingers = [];
  /** Whether the service records. */
  recording = false;
  /** Largest gain reduction of the limiter, dB, since the last new stream or scene. */
  reduction = 0;
  #recent = 0; // dB, the newest report: the largest may come from the moment of touch-down
  #holders = new Map(); // id of a pointer -> its finger
  #volume = 0.1;
  #raised = 1; // gain on top of the volume
  #starting = null;
  #renewing = Promise.resolve();
  #chosen = false; // a texture is chosen whose streams are not open yet
  #changing = false; // they are being opened
  #refused = null; // the scene of which the service refused them

  /** scene: the first scene. */
  constructor(scene) {
    super();
    this.scene = scene;
  }

  /** Master volume, 0 to 1. */
  set volume(volume) {
    this.#volume = volume;
    if (this.player) this.player.volume = volume;
  }

  /** Gain on top of the volume; initially 1. */
  set raised(gain) {
    this.#raised = gain;
    if (this.player) this.player.raised = gain;
  }

  /** Opens the player and the first finger. Sounds from the first gesture with which the browser permits sound. Returns
   *  when the finger is live. */
  start() {
    this.#starting ??= this.#open().catch((error) => {
      this.#starting = null;
      this.#refuse(error);
      throw error;
    });
    return this.#starting;
  }

  /** Ends all streams and closes the player. */
  async stop() {
    this.#starting = null;
    const { player } = this;
    this.player = null;
    await this.#closeFingers();
    this.#limit(0);
    await player?.close();
    this.#tell("state", { state: "not started" });
  }

  /** Opens new streams of `scene`, and a new player if the sample rate changes. Concurrent calls run one after another.
   *  */
  renew(scene = this.scene, { record = false } = {}) {
    this.scene = scene;
    this.#renewing = this.#renewing.catch(() => {}).then(() => this.#renew(scene, record));
    return this.#renewing;
  }

  async #renew(scene, record) {
    this.recording = record;
    this.#chosen = false;
    this.#refused = null;
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

  /** Replaces the streams by new ones of a larger full scale, for the same hands: the automatic full scale of the
   *  present scene or, if that is no larger than before, the one that the limiter called for. Returns {full_scale,
   *  quantity}; null if there is no stream. */
  rescale() {
    this.#renewing = this.#renewing.catch(() => {}).then(() => this.#rescale());
    return this.#renewing;
  }

  async #rescale() {
    const { player, fingers: before } = this;
    const ready = before[0]?.connection.ready;
    if (!ready) return null;
    this.recording = false;
    const fresh = await this.#openRescaled(ready);
    if (this.player !== player) {
      for (const finger of fresh) finger.close();
      return null;
    }
    this.#hand(fresh);
    this.#limit(0);
    const { full_scale: scale, quantities } = fresh[0].connection.ready;
    return { full_scale: scale[0], quantity: quantities[0] };
  }

  /** Opens a finger for each hand, at least one, with a larger full scale than the stream `ready`. */
  async #openRescaled(ready) {
    const { scene } = this;
    let first = await this.#made(scene).opened;
    if (first.connection.ready.full_scale[0] <= ready.full_scale[0] && withFullScaleOf(ready, scene) !== scene) {
      first.close();
      const needed = neededFullScale(ready, this.#recent);
      first = await this.#made(withField(scene, ["output", "full_scale"], needed)).opened;
    }
    return this.#withFurther(first, scene);
  }

  /** Returns `first` and, for further hands, fingers as loud. */
  async #withFurther(first, scene) {
    const fresh = [first];
    const further = withFullScaleOf(first.connection.ready, scene);
    while (fresh.length < this.#holders.size) fresh.push(await this.#made(further).opened);
    return fresh;
  }

  /** Moves the hands to the fingers `fresh`; the previous fingers fade out. */
  #hand(fresh) {
    const before = this.fingers;
    this.fingers = fresh;
    for (const [index, [id, old]] of [...this.#holders].entries()) {
      const finger = fresh[index] ?? this.#finger(); // for a hand that came meanwhile
      this.#holders.set(id, finger);
      if (old.touching) finger.move(old.contact);
    }
    for (const finger of before) finger.close();
    for (const finger of this.fingers) finger.change(this.scene);
    this.#tell("state", { state: this.state });
  }

  /** Changes the scene, in the present streams if possible, else with new ones. chosen: it has another texture. Returns
   *  whether the streams are new because of what is fixed for a stream, when they are open. */
  async take(scene, chosen = false) {
    if (changesWhatIsFixed(this.scene, scene)) {
      await this.renew(scene);
      return true;
    }
    this.scene = scene;
    this.#chosen ||= chosen || this.#refused !== null;
    this.#refused = null;
    if (!this.fingers.length || this.recording || hasFullScale(scene)) this.#chosen = false;
    if (this.#changing) return false;
    if (this.#chosen) {
      this.#renewing = this.#renewing.catch(() => {}).then(() => this.#change());
      return false;
    }
    for (const finger of this.fingers) finger.change(scene);
    if (this.fingers.some(({ scene: { pending } }) => pending)) this.#limit(0);
    this.#tell("state", { state: this.state });
    return false;
  }

  /** Replaces the streams by those of the chosen texture, for the same hands. Of several choices, the newest counts. */
  async #change() {
    this.#changing = true;
    await this.#starting?.catch(() => {});
    while (this.#chosen && this.player) {
      this.#chosen = false;
      this.#tell("state", { state: this.state });
      await this.#changeTo(this.scene, this.player);
    }
    this.#changing = false;
    this.#tell("state", { state: this.state });
  }

  async #changeTo(scene, player) {
    let fresh;
    try {
      fresh = await this.#withFurther(await unlessBroken(this.#made(scene)), scene);
    } catch ({ problem }) {
      if (this.player !== player) return;
      if (problem && this.scene === scene) this.#refused = scene;
      else if (problem)
        this.#chosen = true; // the scene was changed meanwhile
      else await this.#renewInPlace();
      return;
    }
    if (this.#chosen || this.player !== player || changesWhatIsFixed(scene, this.scene)) {
      for (const finger of fresh) finger.close();
      return;
    }
    this.#hand(fresh);
    this.#limit(0);
  }

  /** Opens new streams after the present ones: perhaps there is no room for both. */
  async #renewInPlace() {
    await this.#renew(this.scene, false);
    for (const finger of this.fingers) finger.change(this.scene);
  }

  /** Moves the finger of the pointer `id`. contact: {position and y (m), or speed (m/s), on the pad, load (N), time (s)}.
   */
  move(id, contact) {
    const finger = this.#holders.get(id) ?? this.#take(id);
    finger?.move(placed(contact));
  }

  /** Lifts the finger of the pointer `id`. */
  lift(id) {
    this.#holders.get(id)?.lift();
    this.#holders.delete(id);
  }

  /** See session_status.js. */
  get state() {
    const state = stateOf(this.player, this.fingers);
    return state === "live" && this.#changing ? "preparing" : state;
  }

  get soundStatus() {
    if (this.player && this.#changing) return "pending";
    if (this.player && this.#refused && same(this.#refused, this.scene)) return "refused";
    return soundStatusOf(this.player, this.fingers);
  }

  get stats() {
    return statsOf(this.player, this.fingers);
  }

  async #open() {
    this.#tell("state", { state: "connecting" });
    this.player = await Player.open({ sampleRate: rateOf(this.scene) });
    this.player.volume = this.#volume;
    this.player.raised = this.#raised;
    this.player.addEventListener("awake", () => this.#tell("state", { state: this.state }));
    this.#tell("player", { player: this.player });
    await this.#finger().opened;
  }

  #take(id) {
    if (!this.player) return null;
    const held = new Set(this.#holders.values());
    const free = this.fingers.find((finger) => !held.has(finger) && finger.connection.state !== "ended");
    const most = this.recording ? 1 : MOST_FINGERS;
    if (!free && this.fingers.length >= most) return null;
    const finger = free ?? this.#finger();
    this.#holders.set(id, finger);
    return finger;
  }

  #finger() {
    const finger = this.#made(withFullScaleOf(this.fingers[0]?.connection.ready, this.scene));
    this.fingers.push(finger);
    return finger;
  }

  #made(scene) {
    const finger = new Finger({ player: this.player, scene: forHand(scene), record: this.recording });
    for (const type of ["ready", "broken", "resumed", "ended", "sceneStatus"])
      finger.addEventListener(type, ({ detail }) => this.#changed(finger, type, detail));
    finger.addEventListener("block", ({ detail }) =>
      this.#tell("block", { ...detail, finger, ready: finger.connection.ready }),
    );
    finger.addEventListener("scene", ({ detail }) => this.#tell("plan", { plan: detail.plan }));
    finger.addEventListener("problem", ({ detail }) =>
      this.#tell("problem", { problem: detail.problem, sentence: detail.problem.detail ?? detail.problem.title }),
    );
    finger.addEventListener("limited", ({ detail }) => {
      if (!this.fingers.includes(finger)) return;
      this.#recent = detail.gain_reduction_db;
      this.#limit(Math.max(this.reduction, this.#recent));
    });
    finger.opened = finger.open().then(() => finger);
    finger.opened.catch(() => {}); // reported by the event "ended"
    return finger;
  }

  /** Sets `reduction`, dB. */
  #limit(reduction) {
    this.reduction = reduction;
    this.#tell("limited", { reduction });
  }

  #changed(finger, type, detail) {
    if (type === "ready") this.#tell("ready", detail);
    if (type === "ready") this.#tell("plan", { plan: detail.ready.plan });
    if (type === "ended") this.#drop(finger, detail);
    this.#tell("state", { state: this.state });
  }

  /** Removes a finger whose stream has ended; stops the session with the last one. */
  #drop(finger, detail) {
    if (!this.fingers.includes(finger)) return;
    this.#tell("problem", { problem: detail.problem, sentence: endSentence(detail) });
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
    this.#tell("problem", { problem: error.problem ?? null, sentence: explanationOf(error) });
    this.#tell("state", { state: this.state });
  }

  #tell(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }
}

/** Returns `finger` when it is open. Throws if its connection breaks before, though it would be tried again. */
function unlessBroken(finger) {
  const broken = new Promise((_, reject) => {
    finger.addEventListener("broken", () => reject(Object.assign(new Error("no connection"), { problem: null })));
  });
  return Promise.race([finger.opened, broken]).catch((error) => {
    finger.close();
    throw error;
  });
}
