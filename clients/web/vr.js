/* The VR page: connects the table (vr/), the sound (sound/, hand/) and the headset.

Limits: browsers permit sound only after a click or key press. three.js is in vendor/ if the package was built with npm.
*/

import { Finger } from "./hand/finger.js";
import { Player } from "./sound/player.js";
import { loadSwatches, loadThreshold } from "./vr/swatches.js";
import { DesktopPointer, Viewpoint } from "./vr/desktop_pointer.js";
import { Fingertips } from "./vr/fingertips.js";
import { ControllerMotors } from "./vr/controller_motors.js";
import { KeyboardStrokes } from "./vr/keyboard_strokes.js";
import { Room } from "./vr/room.js";
import { enter, whyNoHeadset } from "./vr/headset_session.js";
import { WIDTH } from "./vr/table_layout.js";
import { placeBefore, readTips } from "./vr/tracked_fingertips.js";
import { MOST_LOAD, STIFFNESS } from "./vr/contact_model.js";

const RATE = 48000; // Hz, default of a scene
const TIP = 0.007; // m, radius of the fingertip without a headset
const LONGEST_STEP = 0.1; // s, so that strokes do not jump after a pause of the page
const ASLEEP = "The browser keeps this page silent until you click, press a key or lift your finger.";
const READOUT = 0.2; // s between updates of the readout

const LOST = "The connection is lost. This page tries again.";

const part = (id) => document.getElementById(id);
const say = (text) => (part("status").textContent = text);
const shown = { player: null, fingers: new Set(), session: null, tips: [], touches: [], fingertips: null, room: null };
window.ridgewave = shown;

let sound = null;
let volume = Number(part("volume").value);
let muted = false;
let stale = true; // the picture must be drawn again
const changed = () => (stale = true);

/** Opens the player once. Must be called in a user gesture. */
function beginSound() {
  sound ??= Player.open({ sampleRate: RATE, latencyHint: "interactive" }).then(
    (player) => {
      shown.player = player;
      player.volume = muted ? 0 : volume;
      player.addEventListener("awake", tellAwake);
      tellAwake();
      return player;
    },
    (error) => {
      sound = null;
      say(`The sound could not start: ${error.message}`);
      return null;
    },
  );
  return sound;
}

/** Tells the user while the browser does not permit sound. */
function tellAwake() {
  if (!shown.player.awake) say(ASLEEP);
  else if (part("status").textContent === ASLEEP) say("");
}

/** Returns an open Finger for a scene, null before the sound has begun. signal: an AbortSignal that ends the opening. */
async function openFinger(scene, signal) {
  const player = await sound;
  if (!player || muted || signal?.aborted) return null;
  const finger = new Finger({ player, scene });
  shown.fingers.add(finger);
  signal?.addEventListener("abort", () => finger.close());
  finger.addEventListener("problem", ({ detail: { problem } }) => say(problem.detail ?? problem.title));
  finger.addEventListener("broken", () => part("status").textContent || say(LOST));
  for (const kind of ["ready", "resumed"])
    finger.addEventListener(kind, () => {
      say("");
      tellAwake();
    });
  finger.addEventListener("ended", () => {
    shown.fingers.delete(finger);
    if (!shown.fingers.size && part("status").textContent === LOST) say("");
  });
  await finger.open();
  return finger;
}

function sendToPad(text, words) {
  const link = Object.assign(document.createElement("a"), { href: "/", textContent: words });
  part("status").replaceChildren(text, link);
}

/** Returns three.js; tells the user and returns null if it is missing. */
async function loadThree() {
  try {
    return await import("./vendor/three.module.js");
  } catch {
    const hint = "Install a ridgewave package that was built with Node";
    sendToPad(`This installation lacks three.js, which draws the table. ${hint}. `, "The pad works without it.");
    return null;
  }
}

async function begin() {
  const three = await loadThree();
  if (!three) return;
  say("Loading the swatches.");
  const [swatches, threshold] = await Promise.all([loadSwatches(), loadThreshold()]);
  const look = matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";
  let room;
  try {
    room = new Room(three, part("view"), swatches, look);
  } catch {
    sendToPad("This browser cannot draw WebGL. Turn on its hardware acceleration. ", "The pad works without it.");
    return;
  }
  const motors = new ControllerMotors(threshold, (hand) => say(`The ${hand} controller refuses to vibrate.`));
  const fingertips = new Fingertips({
    room,
    swatches,
    open: openFinger,
    onBlock: (hand, finger, samples) => motors.play(hand, finger, samples),
    onLift: (hand) => motors.stop(hand),
    onProblem: (error) => say(error.message),
    onLimited: (reduction) => tellLimited(reduction, fingertips),
  });
  Object.assign(shown, { room, fingertips });
  const viewpoint = new Viewpoint();
  const pointer = new DesktopPointer(part("view"), {
    view: viewpoint,
    under: (x, y) => room.under(x, y),
    onChange: changed,
  });
  const keys = new KeyboardStrokes(part("list"), swatches, room.layout.places, changed);
  tellScale();
  followControls(fingertips);
  followSize(room, viewpoint);
  followHeadset(room, fingertips, motors);

  let last = 0;
  let told = 0;
  room.renderer.setAnimationLoop((_, frame) => {
    const time = performance.now() / 1e3;
    const passed = Math.min(LONGEST_STEP, time - last);
    last = time;
    const session = shown.session;
    const tips = frame && session ? session.tips(frame) : desktopTips(pointer.point(passed), keys.point(passed));
    const held = shown.touches.length > 0;
    Object.assign(shown, { tips, touches: fingertips.step(tips, time) });
    if (!session && !(stale || held || shown.touches.length)) return;
    stale = false;
    if (!session) viewpoint.place(room.camera, room.table.position);
    room.draw();
    if (time - told < READOUT && held === shown.touches.length > 0) return;
    told = time;
    tellTouches(shown.touches, swatches);
  });
  say("");
  part("view").dataset.ready = "true";
}

/** Shows the gain reduction of the limiter. A headset does not show the page, so there the table rescales
 *  automatically. */
function tellLimited(reduction, fingertips) {
  if (shown.session) return fingertips.rescale();
  const told = reduction ? `The limiter reduces this swatch by ${Math.ceil(reduction)} dB.` : "";
  if (part("limiter").textContent !== told) part("limiter").textContent = told;
  part("rescale").hidden = !reduction;
}

function desktopTips(pointer, keys) {
  return Object.entries({ pointer, keys })
    .filter(([, point]) => point)
    .map(([id, { x, y, z }]) => ({ id, centre: { x, y: y + TIP, z }, radius: TIP }));
}

function tellTouches(touches, swatches) {
  const words = touches.map(
    ({ index, position, load }) =>
      `${swatches[index].title.split(":")[0]}: ${(position * 1e3).toFixed(0)} mm, ${load.toFixed(2)} N`,
  );
  part("touch").textContent = words.join("   ");
}

function tellScale() {
  const depth = `${(1e3 / STIFFNESS).toFixed(0)} mm of depth are 1 N, up to ${MOST_LOAD} N`;
  part("scale").textContent =
    `Swatches are ${(WIDTH * 1e3).toFixed(0)} mm wide and are touched at true scale. Only their drawing is magnified, as ` +
    `the labels say. With a headset, ${depth}. Each swatch has its own full scale, so loudness cannot be compared.`;
}

function followControls(fingertips) {
  for (const kind of ["pointerdown", "keydown"])
    window.addEventListener(kind, beginSound, { once: true, capture: true });
  const set = () => {
    if (shown.player) shown.player.volume = muted ? 0 : volume;
  };
  part("volume").addEventListener("input", ({ target }) => {
    volume = Number(target.value);
    set();
  });
  part("silence").addEventListener("click", ({ currentTarget }) => {
    muted = !muted;
    currentTarget.setAttribute("aria-pressed", String(muted));
    set();
    if (muted) fingertips.close();
  });
  part("rescale").addEventListener("click", () => {
    fingertips.rescale();
    tellLimited(0, fingertips);
  });
  window.addEventListener("pagehide", () => fingertips.close());
  document.addEventListener("visibilitychange", () => document.hidden && !shown.session && fingertips.close());
}

function followSize(room, viewpoint) {
  const view = part("view");
  const fit = () => {
    room.fit(view.parentElement.clientWidth, view.parentElement.clientHeight, devicePixelRatio);
    viewpoint.fit(room.layout, room.camera);
    changed();
  };
  new ResizeObserver(() => shown.session || fit()).observe(view.parentElement);
  room.refit = fit;
  fit();
}

function followHeadset(room, fingertips, motors) {
  const button = part("enter");
  const look = async () => {
    const why = await whyNoHeadset();
    button.disabled = Boolean(why);
    part("why").textContent = why;
  };
  look();
  navigator.xr?.addEventListener?.("devicechange", look);
  button.addEventListener("click", async () => {
    if (shown.session) {
      shown.session.end();
      return;
    }
    button.disabled = true;
    try {
      beginSound();
      const { session, floor } = await enter(room.renderer);
      motors.follow(session);
      session.addEventListener("end", () => motors.follow(null));
      shown.session = followSession(session, floor, room, fingertips, button);
      button.textContent = "Leave VR";
    } catch (error) {
      say(`The headset session did not start: ${error.message}`);
    }
    button.disabled = false;
  });
}

/** Returns {tips(frame): the fingertips in a frame, end(): ends the session}. */
function followSession(session, floor, room, fingertips, button) {
  let placed = null;
  room.floor.visible = floor;
  fingertips.close();
  session.addEventListener("visibilitychange", () => session.visibilityState === "visible" || fingertips.close());
  session.addEventListener("end", () => {
    shown.session = null;
    fingertips.close();
    room.useDesktop();
    room.refit();
    button.textContent = "Enter VR";
    button.focus();
  });
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

begin().catch((error) => {
  if (error.problem?.status === 401) sendToPad("This service requires a key. ", "Enter it on the pad, then return.");
  else say(error.message);
});
