/* The plan of the scene and how exact it is to be: one question to the service answers both.

Model: the accuracy control asks for the plan of each scene that rests; its answer also fills the plan's list, and tells
the form what stands where nothing is written. */

import { byId } from "../knobs/element.js";
import { AccuracyControl } from "../plan/accuracy.js";
import { PlanView } from "../plan/plan.js";
import { call } from "../service.js";

export class Planning {
  /** form: is told the complete scene. onRefused({problem, sentence}), onPlan(): what came of the question. */
  constructor({ form, onRefused, onPlan }) {
    const list = new PlanView(byId("plan"));
    const asking = async (method, path, body) => {
      try {
        const answer = await call(method, path, body);
        if (path !== "/v1/explain") return answer;
        list.show(answer);
        form.complete = answer.scene;
        onPlan();
        return answer;
      } catch (error) {
        onRefused({ problem: error.problem, sentence: error.message });
        throw error;
      }
    };
    this.control = new AccuracyControl(byId("accuracy"), { call: asking });
    this.control.addEventListener("change", ({ detail }) => form.write(["accuracy", "tolerance"], detail.tolerance));
  }

  /** Ask for the plan of `scene`, after a moment. */
  look(scene) {
    this.control.show(scene);
  }
}
