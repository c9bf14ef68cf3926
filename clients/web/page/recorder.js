/* Recording and replay of strokes.

Model: a recording is a separate stream with one finger. The service stores everything that determines its samples
(docs/live.md, "Recordings"). Replay sends the recorded contact updates to a new stream of the recorded scene.
Limits: replay is exact to a block of 10 ms, because of the timers of browsers. `ridgewave render` is exact. */

import { byId, whileDisabled } from "../dom.js";
import { explanationOf } from "../explained.js";
import { recordingOf } from "../service.js";
import { saveText } from "./download.js";

const TICK = 4; // ms between checks for updates that are due
const REPLAY = "replay";
const ABOUT = "A recording stores every contact update. ridgewave render computes exactly the same samples from it.";

export class Recorder {
  #text = null; // JSON of the last recording
  #session = null; // id of the session that is recorded
  #playing = 0; // timer of the replay

  /** session: the TouchSession. pad: the Pad, which shows replayed contacts. tell(sentence). show(scene): makes `scene`
   *  the scene of the page. */
  constructor({ session, pad, tell, show }) {
    Object.assign(this, { session, pad, tell, show });
    byId("record").addEventListener("click", () =>
      this.#guarded(this.#session ? this.#finish() : whileDisabled(byId("record"), () => this.#begin())),
    );
    byId("replay").addEventListener("click", () => this.#guarded(this.#playing ? this.#end() : this.replay()));
    byId("save-recording").addEventListener("click", () => saveText(this.#text, "recording.json"));
  }

  async #begin() {
    byId("record").textContent = "Preparing…";
    byId("recording-about").textContent = "Recording starts when the contact is solved.";
    try {
      await this.session.start();
      this.pad.release();
      await this.session.renew(this.session.scene, { record: true });
      this.#session = this.session.fingers[0].connection.ready.session;
      this.#show("Recording. Stroke the pad with one finger, then stop the recording.");
    } catch (error) {
      this.#show(ABOUT);
      throw error;
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
    if (!contacts) return this.#show("Nothing was recorded. Stroke the pad during the recording.");
    this.#text = text;
    this.#show(`Recorded ${contacts} contact updates${complete ? "" : "; the rest of the stroke was too long"}.`);
  }

  /** Ends the recording, because the streams are new. */
  renewed() {
    if (!this.#session) return;
    this.#session = null;
    this.#show("The recording ended because a new stream was opened. Record again.");
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
    this.#show("Replaying to within 10 ms. ridgewave render computes exactly the recorded samples.");
  }

  #act([, kind, ...rest], time) {
    if (kind === "contact") {
      this.pad.move(REPLAY, { ...contactOf(rest), time });
    } else if (kind === "lift") this.pad.lift(REPLAY);
    else if (kind === "scene") this.show(rest[0]);
  }

  #end() {
    clearInterval(this.#playing);
    this.#playing = 0; // timer of the replay
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
    Promise.resolve(action).catch((error) => this.tell(explanationOf(error)));
  }
}

/** Returns a recorded update (docs/live.md) as a contact of the pad: the finger moves opposite to the surface. */
function contactOf([, , position, speed, load, across = null, direction = null]) {
  const place = position === null ? { speed: 0 - speed } : { position: 0 - position, y: 0 - across };
  return {
    ...place,
    ...(direction === null ? {} : { direction }),
    ...(load === null ? {} : { load }),
  };
}
