/* The plan of the scene and how exact it is to be: one question to the service answers both.

Model: the accuracy control asks for the plan of each scene that rests; its answer also fills the plan's list, and tells
the page what stands where nothing is written. */

import { byId, make } from "../knobs/element.js";
import { same } from "../knobs/merge.js";
import { AccuracyControl } from "../plan/accuracy.js";
import { PlanView } from "../plan/plan.js";
import { call } from "../service.js";

export class Planning {
  #seen = {};

  /** state: learns what stands where nothing is written. onPlan(plan): of the newest scene. onRefused({problem,
   *  sentence}). */
  constructor({ state, onRefused, onPlan }) {
    const list = new PlanView(byId("plan"));
    this.control = new AccuracyControl(byId("accuracy"), { call });
    this.control.addEventListener("change", ({ detail }) => state.write(["accuracy", "tolerance"], detail.tolerance));
    this.control.addEventListener("refused", ({ detail }) => onRefused(detail));
    this.control.addEventListener("plan", ({ detail: { scene, plan } }) => {
      list.show(plan);
      state.learn(scene, plan.scene);
      if (same({ ...scene, accuracy: null }, { ...this.#seen, accuracy: null })) onPlan(plan);
    });
  }

  /** Ask for the plan of `scene`, after a moment. */
  look(scene) {
    this.#seen = scene;
    this.control.show(scene);
  }
}

/** Tells, under the pad, what the plan warns of. */
export function showWarnings(warnings) {
  const place = byId("warnings");
  place.replaceChildren(...warnings.map((warning) => make("p", { text: warning })));
  place.hidden = !warnings.length;
}
