/* The button that enters and leaves the headset, and what a session does to the table.

Model: the table is placed before the person at the first pose, and again when the headset resets its origin. A
controller's "select" presses the button of the panel at which its ray points. */

import { explanationOf } from "../explained.js";
import { enter, whyNoHeadset } from "./headset_session.js";
import { placeBefore, readTips } from "./tracked_fingertips.js";

const NOT_STARTED = "The headset did not start. Permit VR for this page, check the headset, then press Enter VR again.";

export class HeadsetEntry {
  /** What runs: {tips(frame): the fingertips in a frame, end(): ends the session}; null without a headset. */
  session = null;

  /** button, why: elements of the page. room, fingertips, motors, panel: of the table. begin(): opens the sound.
   *  say(text): tells the user. */
  constructor({ button, why, room, fingertips, motors, panel, begin, say }) {
    Object.assign(this, { button, why, room, fingertips, motors, panel, begin, say });
    this.#look();
    navigator.xr?.addEventListener?.("devicechange", () => this.#look());
    button.addEventListener("click", () => (this.session ? this.session.end() : this.#enter()));
  }

  async #look() {
    const why = await whyNoHeadset();
    this.button.disabled = Boolean(why);
    this.why.textContent = why;
  }

  async #enter() {
    const { button, motors } = this;
    button.disabled = true;
    try {
      this.begin();
      const { session, floor } = await enter(this.room.renderer);
      motors.follow(session);
      session.addEventListener("end", () => motors.follow(null));
      this.session = this.#follow(session, floor);
      button.textContent = "Leave VR";
    } catch (error) {
      this.say(explanationOf(error, NOT_STARTED));
    }
    button.disabled = false;
  }

  #follow(session, floor) {
    const { room, fingertips } = this;
    let placed = null;
    room.floor.visible = floor;
    fingertips.close();
    session.addEventListener("visibilitychange", () => session.visibilityState === "visible" || fingertips.close());
    session.addEventListener("select", (event) => this.#select(event));
    session.addEventListener("end", () => this.#left());
    const tips = (frame) => {
      const space = room.renderer.xr.getReferenceSpace();
      if (placed !== space) {
        const head = frame.getViewerPose(space);
        if (!head) return [];
        room.stand(placeBefore(head.transform, floor));
        space.addEventListener?.("reset", () => (placed = null));
        placed = space;
      }
      return readTips(session, frame, space).map((tip) => {
        return { ...tip, centre: room.onTable(tip.centre), ahead: room.onTable(tip.ahead) };
      });
    };
    return { tips, end: () => session.end() };
  }

  /** Presses the button of the panel at which an input source points. */
  #select({ frame, inputSource }) {
    const pose = frame.getPose(inputSource.targetRaySpace, this.room.renderer.xr.getReferenceSpace());
    if (!pose) return;
    const { Vector3 } = this.room.three;
    const { position, matrix } = pose.transform;
    this.panel.pressAt({
      origin: new Vector3(position.x, position.y, position.z),
      direction: new Vector3(-matrix[8], -matrix[9], -matrix[10]),
    });
  }

  #left() {
    this.session = null;
    this.fingertips.close();
    this.room.useDesktop();
    this.room.refit();
    this.button.textContent = "Enter VR";
    this.button.focus();
  }
}
