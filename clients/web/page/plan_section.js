/* The section "Plan and accuracy".

Model: the accuracy control requests the plan of a scene when changes stop. The same answer fills the list of the plan
and gives the page the values of fields that the scene leaves to their defaults. */

import { byId, make } from "../dom.js";
import { same } from "../scene/merge.js";
import { AccuracyControl } from "../plan/accuracy_control.js";
import { PlanView } from "../plan/plan_view.js";
import { call } from "../service.js";

export class PlanSection {
  #scene = {};

  /** state: the SceneState. onPlan(plan): the plan of the newest scene. onRefused({problem, sentence}). */
  constructor({ state, onRefused, onPlan }) {
    const list = new PlanView(byId("plan"));
    this.control = new AccuracyControl(byId("accuracy"), { call });
    this.control.addEventListener("change", ({ detail }) => state.write(["accuracy", "tolerance"], detail.tolerance));
    this.control.addEventListener("refused", ({ detail }) => onRefused(detail));
    this.control.addEventListener("plan", ({ detail: { scene, plan } }) => {
      list.show(plan);
      state.setDefaults(scene, plan.scene);
      if (same({ ...scene, accuracy: null }, { ...this.#scene, accuracy: null })) onPlan(plan);
    });
  }

  /** Shows the errors of a stream that follows a hand. */
  hand(plan) {
    this.control.hand(plan);
  }

  /** Requests the plan of `scene` after a short delay. */
  show(scene) {
    this.#scene = scene;
    this.control.show(scene);
  }
}

/** The warnings of the plan under the pad. Their number differs, so they wait while a hand touches: what is under it must
 *  not move. */
export class Warnings {
  #waiting = null;

  /** pad: the Pad. */
  constructor(pad) {
    this.pad = pad;
    pad.addEventListener("released", () => this.#waiting && this.show(this.#waiting));
  }

  show(warnings) {
    this.#waiting = this.pad.isHeld ? warnings : null;
    if (this.#waiting) return;
    const place = byId("warnings");
    place.replaceChildren(...warnings.map((warning) => make("p", { text: warning })));
    place.hidden = !warnings.length;
  }
}
