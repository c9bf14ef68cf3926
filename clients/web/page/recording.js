/* Strokes recorded and replayed.

Model: a recording is a stream of its own, with one finger; the service keeps what decided its samples (docs/live.md,
"Recordings"). Replay sends its contacts again, each at its time, to a new stream of the recorded scene.
Limits: a replay is as true as the browser's timers, a block of 10 ms; `ridgewave render` makes the very samples. */

import { byId } from "../knobs/element.js";
import { turned } from "../live/contact.js";
import { recordingOf } from "../service.js";
import { saveText } from "./save.js";

const TICK = 4; // ms between looks at what is due
const REPLAY = "replay";
const ABOUT = "A recording keeps each contact; ridgewave render makes the very samples of it.";

export class Recorder {
  #text = null; // of the last recording
  #session = null; // id of the one that runs
  #playing = 0;

  /** session: the Session. tell(sentence). show(scene): the scene that is touched. pad: where replayed contacts are
   *  made. */
  constructor({ session, pad, tell, show }) {
    Object.assign(this, { session, pad, tell, show });
    byId("record").addEventListener("click", () => this.#guarded(this.#session ? this.#finish() : this.#begin()));
    byId("replay").addEventListener("click", () => this.#guarded(this.#playing ? this.#end() : this.replay()));
    byId("save-recording").addEventListener("click", () => saveText(this.#text, "recording.json"));
  }

  async #begin() {
    byId("record").disabled = true;
    byId("record").textContent = "Preparing…";
    byId("recording-about").textContent = "Nothing is recorded yet: the contact is being solved.";
    try {
      await this.session.start();
      this.pad.release();
      await this.session.renew(this.session.scene, { record: true });
      this.#session = this.session.fingers[0].connection.ready.session;
      this.#show("Recording: stroke the pad with one finger, then stop.");
    } catch (error) {
      this.#show(ABOUT);
      throw error;
    } finally {
      byId("record").disabled = false;
    }
  }

  async #finish() {
    const id = this.#session;
    this.#session = null;
    this.pad.release();
    await this.session.renew(this.session.scene);
    const text = await recordingOf(id);
    const { events, complete } = JSON.parse(text);
    const contacts = events.filter(([, kind]) => kind === "contact").length;
    if (!contacts) return this.#show("Nothing was recorded: stroke the pad while it says that it records.");
    this.#text = text;
    this.#show(`Recorded ${contacts} contacts${complete ? "" : ", the beginning of a longer stroke"}.`);
  }

  /** Tell that the stream was opened anew: a recording that ran is over. */
  renewed() {
    if (!this.#session) return;
    this.#session = null;
    this.#show("The recording ended with its session: record again.");
  }

  async replay() {
    const { scene, events } = JSON.parse(this.#text);
    const rate = scene.output.sample_rate;
    const first = events.find(([, kind]) => kind === "contact")?.[0] ?? 0;
    await this.session.start();
    this.pad.release();
    this.show(scene);
    await this.session.renew(scene);
    const start = performance.now() / 1e3 - first / rate;
    let next = 0;
    const step = () => {
      const now = performance.now() / 1e3;
      for (; next < events.length && events[next][0] / rate <= now - start; next += 1)
        this.#act(events[next], start + events[next][0] / rate);
      if (next === events.length) this.#end();
    };
    this.#playing = setInterval(step, TICK);
    const exact = "ridgewave render makes the very samples";
    this.#show(`Replay: the recorded contacts are sent again, at their times to within a block; ${exact}.`);
  }

  #act([, kind, ...rest], time) {
    if (kind === "contact") {
      const [, , position, speed, load] = rest;
      const contact = { time, ...(position === null ? { speed } : { position }), ...(load === null ? {} : { load }) };
      this.pad.move(REPLAY, turned(contact));
    } else if (kind === "lift") this.pad.lift(REPLAY);
    else if (kind === "scene") this.show(rest[0]);
  }

  #end() {
    clearInterval(this.#playing);
    this.#playing = 0;
    this.pad.lift(REPLAY);
    this.#show(ABOUT);
  }

  #show(sentence) {
    byId("record").setAttribute("aria-pressed", String(Boolean(this.#session)));
    byId("record").textContent = this.#session ? "Stop recording" : "Record a stroke";
    byId("replay").textContent = this.#playing ? "Stop replay" : "Replay";
    byId("replay").disabled = byId("save-recording").disabled = !this.#text || Boolean(this.#session);
    byId("recording-about").textContent = sentence;
  }

  #guarded(action) {
    Promise.resolve(action).catch((error) => this.tell(error.message));
  }
}
