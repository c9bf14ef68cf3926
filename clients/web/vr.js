/* The VR page: wires the table (vr/), the sound (sound/, hand/) and the headset together.

Limits: sound begins with the first click or key press, as browsers want it; three.js is loaded from vendor/, where a
build with Node has put it. */

import { Finger } from "./hand/finger.js";
import { Player } from "./sound/player.js";
import { loadSwatches, loadThreshold } from "./vr/catalogue.js";
import { DesktopHand, Eye } from "./vr/desktop.js";
import { Hands } from "./vr/hands.js";
import { Buzz } from "./vr/buzz.js";
import { SwatchKeys } from "./vr/keys.js";
import { Room } from "./vr/room.js";
import { enter, whyNoHeadset } from "./vr/session.js";
import { WIDTH } from "./vr/table.js";
import { placeBefore, readTips } from "./vr/tips.js";
import { MOST_LOAD, STIFFNESS } from "./vr/touch.js";

const RATE = 48000; // Hz, that of a scene which names none
const TIP = 0.007; // m, radius of the fingertip that a desktop shows
const LONGEST_STEP = 0.1; // s: after a pause of the page, what is held does not leap
const ASLEEP = "Silent so far: the browser lets the page sound once you lift your finger, click or press a key.";
const READOUT = 0.2; // s between two texts of the readout

const part = (id) => document.getElementById(id);
const say = (text) => (part("status").textContent = text);
const shown = { player: null, fingers: new Set(), session: null, tips: [], touches: [], hands: null, room: null };
window.ridgewave = shown;

let sound = null;
let volume = Number(part("volume").value);
let silent = false;
let stale = true; // the desktop picture differs from what it should show
const changed = () => (stale = true);

/** Begins sound, once; to be called in a user gesture. */
function beginSound() {
  sound ??= Player.open({ sampleRate: RATE, latencyHint: "interactive" }).then(
    (player) => {
      shown.player = player;
      player.volume = silent ? 0 : volume;
      player.addEventListener("awake", tellAwake);
      tellAwake();
      return player;
    },
    (error) => {
      sound = null;
      say(`Sound could not begin: ${error.message}`);
      return null;
    },
  );
  return sound;
}

/** Tells where the browser does not let the page sound yet. */
function tellAwake() {
  if (!shown.player.awake) say(ASLEEP);
  else if (part("status").textContent === ASLEEP) say("");
}

/** Gives an opened finger for a scene, null before sound has begun. */
async function openFinger(scene) {
  const player = await sound;
  if (!player || silent) return null;
  const finger = new Finger({ player, scene });
  shown.fingers.add(finger);
  finger.addEventListener("ended", () => shown.fingers.delete(finger));
  await finger.open();
  return finger;
}

function sendToPad(text, words) {
  const link = Object.assign(document.createElement("a"), { href: "/", textContent: words });
  part("status").replaceChildren(text, link);
}

/** Loads three.js, or says what is missing. */
async function loadThree() {
  try {
    return await import("./vendor/three.module.js");
  } catch {
    const hint = "install a ridgewave that was built where Node is installed";
    sendToPad(`This installation lacks three.js, which draws the table: ${hint}. `, "The pad works without it.");
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
    sendToPad("This browser draws no WebGL: switch its hardware acceleration on. ", "The pad works without it.");
    return;
  }
  const buzz = new Buzz(threshold);
  const hands = new Hands({
    room,
    swatches,
    open: openFinger,
    onBlock: (hand, finger, samples) => buzz.feel(hand, finger, samples),
    onLift: (hand) => buzz.rest(hand),
    onProblem: (error) => say(error.message),
    onLimited: (reduction) => tellLimited(reduction, hands),
  });
  Object.assign(shown, { room, hands });
  const eye = new Eye();
  const pointer = new DesktopHand(part("view"), { eye, under: (x, y) => room.under(x, y), onChange: changed });
  const keys = new SwatchKeys(part("list"), swatches, room.layout.places, changed);
  tellScale();
  followControls(hands);
  followSize(room, eye);
  followHeadset(room, hands, buzz);

  let last = 0;
  let told = 0;
  room.renderer.setAnimationLoop((_, frame) => {
    const time = performance.now() / 1e3;
    const passed = Math.min(LONGEST_STEP, time - last);
    last = time;
    const session = shown.session;
    const tips = frame && session ? session.tips(frame) : desktopTips(pointer.point(passed), keys.point(passed));
    const held = shown.touches.length > 0;
    Object.assign(shown, { tips, touches: hands.step(tips, time) });
    if (!session && !(stale || held || shown.touches.length)) return;
    stale = false;
    if (!session) eye.hold(room.camera, room.table.position);
    room.draw();
    if (time - told < READOUT && held === shown.touches.length > 0) return;
    told = time;
    tellTouches(shown.touches, swatches);
  });
  say("");
  part("view").dataset.ready = "true";
}

/** Lights the lamp of the limiter; in a headset, which shows no page, the table rescales by itself. */
function tellLimited(reduction, hands) {
  if (shown.session) return hands.rescale();
  const told = reduction ? `The limiter turns this swatch down by ${Math.ceil(reduction)} dB.` : "";
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
  const depth = `${(1e3 / STIFFNESS).toFixed(0)} mm into a swatch is 1 N, up to ${MOST_LOAD} N`;
  part("scale").textContent =
    `A swatch is ${(WIDTH * 1e3).toFixed(0)} mm wide and is stroked at its true scale; only its drawing is magnified, ` +
    `as its label says. With a headset, ${depth}. Each swatch has a loudness of its own.`;
}

function followControls(hands) {
  for (const kind of ["pointerdown", "keydown"])
    window.addEventListener(kind, beginSound, { once: true, capture: true });
  const set = () => {
    if (shown.player) shown.player.volume = silent ? 0 : volume;
  };
  part("volume").addEventListener("input", ({ target }) => {
    volume = Number(target.value);
    set();
  });
  part("silence").addEventListener("click", ({ currentTarget }) => {
    silent = !silent;
    currentTarget.setAttribute("aria-pressed", String(silent));
    set();
    if (silent) hands.close();
  });
  part("rescale").addEventListener("click", () => {
    hands.rescale();
    tellLimited(0, hands);
  });
  window.addEventListener("pagehide", () => hands.close());
  document.addEventListener("visibilitychange", () => document.hidden && !shown.session && hands.close());
}

function followSize(room, eye) {
  const view = part("view");
  const fit = () => {
    room.fit(view.parentElement.clientWidth, view.parentElement.clientHeight, devicePixelRatio);
    eye.fit(room.layout, room.camera);
    changed();
  };
  new ResizeObserver(() => shown.session || fit()).observe(view.parentElement);
  room.refit = fit;
  fit();
}

function followHeadset(room, hands, buzz) {
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
      buzz.follow(session);
      session.addEventListener("end", () => buzz.follow(null));
      shown.session = followSession(session, floor, room, hands, button);
      button.textContent = "Leave VR";
    } catch (error) {
      say(`The headset did not start: ${error.message}`);
    }
    button.disabled = false;
  });
}

/** Returns what the loop needs of a running session: its fingertips in a frame, and how to end it. */
function followSession(session, floor, room, hands, button) {
  let placed = null;
  room.floor.visible = floor;
  hands.close();
  session.addEventListener("visibilitychange", () => session.visibilityState === "visible" || hands.close());
  session.addEventListener("end", () => {
    shown.session = null;
    hands.close();
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
    return readTips(session, frame, space).map((tip) => ({ ...tip, centre: room.onTable(tip.centre) }));
  };
  return { tips, end: () => session.end() };
}

begin().catch((error) => {
  if (error.problem?.status === 401) sendToPad("This service asks for a key. ", "Give it on the pad, then come back.");
  else say(error.message);
});
