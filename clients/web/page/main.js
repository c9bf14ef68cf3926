/* The pad page, put together: the form holds the scene, the session plays it, the pad moves it, the rest shows it.

Model: a change of the form goes to the session (as a part, or by new streams where what is fixed changes), and, once it
rests for a moment, to the pictures and the plan. */

import { byId } from "../knobs/element.js";
import { Form } from "../knobs/form.js";
import { siValue } from "../knobs/units.js";
import { call } from "../service.js";
import { Devices } from "./devices.js";
import { wireHeader } from "./header.js";
import { tell } from "./notices.js";
import { Planning } from "./planning.js";
import { Recorder } from "./recording.js";
import { Session } from "./session.js";
import { Sight } from "./sight.js";
import { Pad } from "./stroke.js";
import { wireTextures } from "./textures.js";
import { Tools } from "./tools.js";

const REST = 250; // ms without a change before pictures and plan are made; shorter keeps the service busy with drags
const SPACING = 60; // ms between two changes said to the streams; each is a cross-fade
const LOAD = 0.3; // N, the default scene's

/** Load what the page is made of, and begin. Throws where the service does not answer. */
export async function begin() {
  const [schema, catalogue] = await Promise.all([call("GET", "/v1/scene/schema.json"), call("GET", "/v1/textures")]);
  byId("main").hidden = false;
  const form = new Form(byId("form"), schema);
  const session = new Session(form.scene);
  let sight = null;
  const pad = new Pad({
    session,
    tell,
    load: LOAD,
    onTouch: () => sight.touch(pad.touches),
    onScale: (metresPerPixel) => sight?.scale(metresPerPixel),
  });
  sight = new Sight({ session, pad });
  sight.scale(pad.metresPerPixel);
  const show = wireTextures(form, catalogue.textures ?? catalogue);
  const tools = new Tools({ form, tell });
  const recorder = new Recorder({ session, pad, tell, show: (scene) => form.take(scene) });
  const plan = new Planning({ form, onRefused: (detail) => refused(form, detail), onPlan: () => form.refuse([]) });
  new Devices({ session, tell });
  wireHeader(session, { onStop: () => pad.release() });
  session.addEventListener("problem", ({ detail }) => refused(form, detail));
  follow({ form, session, pad, sight, plan, recorder, show });
  window.ridgewave = {
    get player() {
      return session.player;
    },
    get fingers() {
      return session.fingers;
    },
    form,
  };
  form.take({});
  tools.follow();
}

/** Passes the changes of the form on. */
function follow({ form, session, pad, sight, plan, recorder, show }) {
  let [resting, saying, load] = [0, 0, null];
  const say = async () => {
    saying = 0;
    const before = session.player;
    if (!(await session.take(form.scene).catch((error) => tell(error.message)))) return;
    recorder.renewed();
    if (before)
      tell("Rate, channels, quantity and full scale are fixed for a stream: a new one was opened with yours.");
  };
  const look = () => {
    const { scene } = form;
    plan.look(scene);
    sight.look(scene).catch((error) => refused(form, { problem: error.problem, sentence: error.message }));
  };
  form.addEventListener("change", ({ detail: { scene, fixed, settled } }) => {
    show(scene);
    const asked = siValue(scene.scan?.load ?? scene.scan?.stroke?.load, "N");
    if (asked > 0 && asked !== load) pad.load.value = load = asked;
    clearTimeout(resting);
    resting = setTimeout(look, settled ? 0 : REST);
    if (!saying && (settled || !fixed)) saying = setTimeout(say, SPACING);
  });
}

/** Tells what the service refuses: beside the field where it can be, and in a sentence. */
function refused(form, { problem, sentence }) {
  form.refuse(problem?.errors ?? []);
  tell(sentence);
}
