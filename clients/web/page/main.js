/* Builds the pad page from its parts and connects them.

Model: the SceneState holds the scene. Each change goes to the session, which plays it; the views and the plan follow
when changes stop for a moment. The pad moves the fingers of the session. */

import { byId } from "../dom.js";
import { explanationOf } from "../explained.js";
import { Form } from "../form/form.js";
import { same } from "../scene/merge.js";
import { PAD_SCENE } from "../scene/start_scene.js";
import { SceneState } from "../scene/state.js";
import { call, isTemporary } from "../service.js";
import { StaleParts } from "./stale_parts.js";
import { pictureStatusOf } from "./status_texts.js";
import { Devices } from "./devices.js";
import { wireHeader } from "./header.js";
import { wireLimiter } from "./limiter_lamp.js";
import { orTell, tell } from "./notice.js";
import { PlanSection, Warnings } from "./plan_section.js";
import { Recorder } from "./recorder.js";
import { TouchSession } from "./touch_session.js";
import { LiveViews } from "./live_views.js";
import { Pad } from "./pad.js";
import { wireTrueRatio } from "./true_ratio.js";
import { GhostStroke } from "./ghost_stroke.js";
import { Sheet } from "./sheet.js";
import { Slots } from "./slots.js";
import { wireTextureWall } from "./texture_wall.js";
import { TextureList } from "../textures/texture_list.js";
import { SceneActions } from "./scene_actions.js";

const REST = 250; // ms without a change before views and plan are requested; shorter loads the service
const RETRY = 2000; // ms until a picture or plan that a service could not answer is requested again
const SPACING = 60; // ms between changes of the streams; each is a cross-fade

/** Loads schema and catalogue and starts the page. Throws a ServiceProblem if the service does not answer. */
export async function begin() {
  const [schema, listed] = await Promise.all([call("GET", "/v1/scene/schema.json"), call("GET", "/v1/textures")]);
  byId("main").hidden = false;
  const state = new SceneState();
  const form = new Form(byId("form"), schema, state);
  const stale = new StaleParts();
  const session = new TouchSession(state.scene);
  let views = null;
  const pad = new Pad({
    session,
    state,
    tell,
    onTouch: () => views.touch(pad.touches),
    onScale: (metresPerPixel) => views?.scale(metresPerPixel),
  });
  views = new LiveViews({ session, pad });
  views.scale(pad.metresPerPixel);
  const textures = new TextureList(listed.textures);
  const wall = wireTextureWall({ state, textures, tell });
  const slots = new Slots({ state, textures });
  views.plots.slot = () => slots.pressed.toUpperCase();
  const sheet = new Sheet(form);
  const actions = new SceneActions({ state, form, textures, session, tell });
  const recorder = new Recorder({ session, pad, tell, show: (scene) => state.take(scene) });
  const warnings = new Warnings(pad);
  let first = true;
  const plan = new PlanSection({
    state,
    onPlan: (document) => {
      if (first && !session.player) makeTable(document);
      first = false;
      stale.set("plan", "current");
      form.refuse([]);
      warnings.show(document.warnings ?? []);
    },
    onRefused: (detail) => {
      stale.set("plan", pictureStatusOf(detail.problem));
      if (isTemporary(detail.problem)) return setTimeout(() => plan.show(state.scene), RETRY);
      refused(form, detail);
    },
  });
  session.addEventListener("plan", ({ detail }) => plan.hand(detail.plan));
  new Devices({ session, views, tell });
  wireLimiter({ session, state, tell, onRescaled: () => recorder.renewed() });
  wireTrueRatio({ session, state, tell });
  wireHeader(session, { onStop: () => pad.release() });
  session.addEventListener("problem", ({ detail }) => refused(form, detail));
  session.addEventListener("ready", ({ detail }) => {
    if (!detail.renewed) return;
    recorder.renewed();
    tell("The service has forgotten the stream, as after a restart. A new one goes on with the same scene.");
  });
  const onFirstPicture = () => {
    wall.load();
    new GhostStroke({ pad, session, views, state }).stroke();
  };
  follow({ form, state, session, views, plan, recorder, stale, onFirstPicture });
  window.ridgewave = {
    get player() {
      return session.player;
    },
    get fingers() {
      return session.fingers;
    },
    state,
    session,
    views,
    sheet,
    slots,
  };
  state.begin(actions.linked() ?? PAD_SCENE);
}

/** Requests the table that the first touch reads, so that it is ready if the user does not touch at once. A scene with
 *  effects may need another table, which the touch then requests. */
function makeTable({ scene, simulated }) {
  if (!simulated.length || Object.keys(scene.effects).length) return;
  call("POST", "/v1/tables", scene).catch(() => {}); // no answer is needed here: the touch reports any error
}

/** Passes changes of the scene on to the parts of the page, and marks those that are not updated yet. */
function follow({ form, state, session, views, plan, recorder, stale, onFirstPicture }) {
  let [resting, sending, shown] = [0, 0, null];
  let another = false; // texture or scene was chosen since the last change of the streams
  let pictured = false; // a picture was shown
  let away = false; // the service did not answer the last request for a picture
  const markSound = () => {
    const unsent = session.player && !sameSound(state.scene, session.scene);
    stale.set("sound", unsent ? "pending" : session.soundStatus);
    stale.set("output", session.player?.awake === false ? "asleep" : "awake");
  };
  const send = async () => {
    sending = 0;
    const before = session.player;
    const chosen = another;
    another = false;
    const renewed = await session.take(state.scene, chosen).catch((error) => tell(explanationOf(error)));
    markSound();
    if (!renewed) return;
    recorder.renewed();
    if (before) tell("Rate, channels, quantity and full scale are fixed for a stream, so a new stream was opened.");
  };
  const show = async () => {
    const scene = state.scene;
    shown = scene;
    plan.show(scene);
    try {
      if (!(await views.show(scene))) return;
      away = false;
      if (!pictured) onFirstPicture();
      pictured = true;
      if (same(scene, state.scene)) stale.set("picture", "current");
    } catch (error) {
      if (same(scene, state.scene)) stale.set("picture", pictureStatusOf(error.problem));
      if (isTemporary(error.problem)) {
        if (!away) tell(explanationOf(error));
        away = true;
        if (shown === scene) resting = setTimeout(show, RETRY); // a newer scene is requested anyway
        return;
      }
      refused(form, { problem: error.problem, sentence: explanationOf(error) });
    }
  };
  session.addEventListener("state", markSound);
  state.addEventListener("change", ({ detail: { scene, fixed, chosen, settled } }) => {
    another ||= chosen;
    if (!same(scene, shown)) {
      for (const part of ["picture", "plan"]) stale.set(part, "pending");
      clearTimeout(resting);
      const soundFirst = Boolean(session.player); // plan and picture would compete with it for the processor
      resting = setTimeout(show, settled && !soundFirst ? 0 : REST);
      shown = null; // so that a return to the scene that was shown is shown too
    }
    if (!sending && (settled || !fixed)) sending = setTimeout(send, SPACING);
    markSound();
  });
}

/** Returns whether a stream sounds the same in both scenes: its load and speed are those of the hand. */
const sameSound = (one, other) => same({ ...one, scan: null }, { ...other, scan: null });

/** Shows a refusal of the service: beside the field, if it names one, and as a message. */
function refused(form, { problem, sentence }) {
  if (problem?.status === 401) return orTell(import("./key_form.js")).then((loaded) => loaded?.askForKey());
  if (problem) form.refuse(problem.errors ?? []);
  tell(sentence);
}
