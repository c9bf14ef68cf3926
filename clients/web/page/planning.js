/* The plan of the scene and how exact it is to be: one question to the service answers both.

Model: the accuracy control asks for the plan of each scene that rests; its answer also fills the plan's list, and tells
the form what stands where nothing is written. */

import { byId } from "../knobs/element.js";
import { AccuracyControl } from "../plan/accuracy.js";
import { PlanView } from "../plan/plan.js";
import { call } from "../service.js";

export class Planning {
  /** form: learns what stands where nothing is written. onRefused({problem, sentence}), onPlan(): what came of a
   *  question. */
  constructor({ form, onRefused, onPlan }) {
    const list = new PlanView(byId("plan"));
    this.control = new AccuracyControl(byId("accuracy"), { call });
    this.control.addEventListener("change", ({ detail }) => form.write(["accuracy", "tolerance"], detail.tolerance));
    this.control.addEventListener("refused", ({ detail }) => onRefused(detail));
    this.control.addEventListener("plan", ({ detail: { scene, plan } }) => {
      list.show(plan);
      form.learn(scene, plan.scene);
      onPlan();
    });
  }

  /** Ask for the plan of `scene`, after a moment. */
  look(scene) {
    this.control.show(scene);
  }
}
