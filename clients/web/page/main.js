/* The pad page, put together: the state holds the scene, the session plays it, the pad moves it, the rest shows it.

Model: a change of the scene goes to the session (as a part, or by new streams where what is fixed changes), and, once it
rests for a moment, to the pictures and the plan. */

import { byId } from "../knobs/element.js";
import { Form } from "../knobs/form.js";
import { same } from "../knobs/merge.js";
import { SceneState } from "../knobs/state.js";
import { call } from "../service.js";
import { Agreement } from "./agreement.js";
import { Devices } from "./devices.js";
import { wireHeader } from "./header.js";
import { wireLimiter } from "./limiter.js";
import { tell } from "./notices.js";
import { Planning, showWarnings } from "./planning.js";
import { Recorder } from "./recording.js";
import { Session } from "./session.js";
import { Sight } from "./sight.js";
import { Pad } from "./stroke.js";
import { wireTextures } from "./textures.js";
import { Tools } from "./tools.js";

const REST = 250; // ms without a change before pictures and plan are made; shorter keeps the service busy with drags
const SPACING = 60; // ms between two changes said to the streams; each is a cross-fade

/** Load what the page is made of, and begin. Throws where the service does not answer. */
export async function begin() {
  const [schema, catalogue] = await Promise.all([call("GET", "/v1/scene/schema.json"), call("GET", "/v1/textures")]);
  byId("main").hidden = false;
  const state = new SceneState();
  const form = new Form(byId("form"), schema, state);
  const agreement = new Agreement();
  const session = new Session(state.scene);
  let sight = null;
  const pad = new Pad({
    session,
    state,
    tell,
    onTouch: () => sight.touch(pad.touches),
    onScale: (metresPerPixel) => sight?.scale(metresPerPixel),
  });
  sight = new Sight({ session, pad });
  sight.scale(pad.metresPerPixel);
  wireTextures(state, catalogue.textures ?? catalogue);
  const tools = new Tools({ state, form, tell });
  const recorder = new Recorder({ session, pad, tell, show: (scene) => state.take(scene) });
  const plan = new Planning({
    state,
    onPlan: (document) => {
      agreement.set("plan", "there");
      form.refuse([]);
      showWarnings(document.warnings ?? []);
    },
    onRefused: (detail) => {
      agreement.set("plan", "refused");
      refused(form, detail);
    },
  });
  new Devices({ session, sight, tell });
  wireLimiter({ session, state, tell, onRescaled: () => recorder.renewed() });
  wireHeader(session, { onStop: () => pad.release() });
  session.addEventListener("problem", ({ detail }) => refused(form, detail));
  follow({ form, state, session, sight, plan, recorder, agreement });
  window.ridgewave = {
    get player() {
      return session.player;
    },
    get fingers() {
      return session.fingers;
    },
    state,
    session,
    form: state, // the name that scripts know the scene by
  };
  if (!tools.follow()) state.take({});
}

/** Passes the changes of the scene on, and tells what is not yet of it. */
function follow({ form, state, session, sight, plan, recorder, agreement }) {
  let [resting, saying, seen] = [0, 0, null];
  const listen = () => {
    const unsaid = session.player && !sameSound(state.scene, session.scene);
    agreement.set("sound", unsaid ? "coming" : session.agreement);
    agreement.set("output", session.player?.awake === false ? "asleep" : "awake");
  };
  const say = async () => {
    saying = 0;
    const before = session.player;
    const renewed = await session.take(state.scene).catch((error) => tell(error.message));
    listen();
    if (!renewed) return;
    recorder.renewed();
    if (before)
      tell("Rate, channels, quantity and full scale are fixed for a stream: a new one was opened with yours.");
  };
  const look = async () => {
    const scene = state.scene;
    seen = scene;
    plan.look(scene);
    try {
      if ((await sight.look(scene)) && same(scene, state.scene)) agreement.set("picture", "there");
    } catch (error) {
      if (same(scene, state.scene)) agreement.set("picture", "refused");
      refused(form, { problem: error.problem, sentence: error.message });
    }
  };
  session.addEventListener("state", listen);
  state.addEventListener("change", ({ detail: { scene, fixed, settled } }) => {
    if (!same(scene, seen)) for (const part of ["picture", "plan"]) agreement.set(part, "coming");
    clearTimeout(resting);
    if (!same(scene, seen)) resting = setTimeout(look, settled ? 0 : REST);
    if (!saying && (settled || !fixed)) saying = setTimeout(say, SPACING);
    listen();
  });
}

/** Whether a stream that a hand moves sounds the same in both scenes: its load and speed are the hand's. */
const sameSound = (one, other) => same({ ...one, scan: null }, { ...other, scan: null });

/** Tells what the service refuses: beside the field where it can be, and in a sentence. */
function refused(form, { problem, sentence }) {
  form.refuse(problem?.errors ?? []);
  tell(sentence);
}
