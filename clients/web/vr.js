/* The VR page: connects the table (vr/), the sound (sound/, hand/) and the headset.

Limits: three.js is in vendor/ if the package was built with npm. */

import { explanationOf } from "./explained.js";
import { loadSwatches, loadThreshold } from "./vr/swatches.js";
import { DesktopPointer, Viewpoint } from "./vr/desktop_pointer.js";
import { Fingertips } from "./vr/fingertips.js";
import { ControllerMotors } from "./vr/controller_motors.js";
import { ControlPanel } from "./vr/control_panel.js";
import { HeadsetEntry } from "./vr/headset_entry.js";
import { KeyboardStrokes } from "./vr/keyboard_strokes.js";
import { hintOf, nameOf, scaleInWords, touchesInWords } from "./vr/readout.js";
import { Room } from "./vr/room.js";
import { TableSound } from "./vr/table_sound.js";
import { STIFFNESS, swatchUnder } from "./vr/contact_model.js";

const TIP = 0.007; // m, radius of the fingertip without a headset
const LONGEST_STEP = 0.1; // s, so that strokes do not jump after a pause of the page
const READOUT = 0.2; // s between updates of the readout
const TALL = 0.9; // width over height of the picture below which the table has two columns
const STIFFER = 2; // factor of a press on "Load +"
const SOFTEST = STIFFNESS / 8; // N/m
const STIFFEST = STIFFNESS * 8;
const GAIN_STEP = 0.1;

const part = (id) => document.getElementById(id);
const status = {
  get text() {
    return part("status").textContent;
  },
  say: (text) => (part("status").textContent = text),
};
const { say } = status;
const sound = new TableSound(Number(part("volume").value), status);
const shown = {
  get player() {
    return sound.player;
  },
  get session() {
    return headset?.session ?? null;
  },
  ...{ fingers: sound.fingers, tips: [], touches: [], fingertips: null, room: null, panel: null },
};
window.ridgewave = shown;

let headset = null;
let stale = true; // the picture must be drawn again
const changed = () => (stale = true);

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
  const { clientWidth, clientHeight } = part("view").parentElement;
  let room;
  try {
    room = new Room(three, part("view"), swatches, look, clientWidth < TALL * clientHeight);
  } catch {
    sendToPad("This browser cannot draw WebGL. Turn on its hardware acceleration. ", "The pad works without it.");
    return;
  }
  const motors = new ControllerMotors(threshold, (hand) => say(`The ${hand} controller refuses to vibrate.`));
  const fingertips = new Fingertips({
    room,
    swatches,
    open: (scene, signal) => sound.openFinger(scene, signal),
    onBlock: (hand, finger, samples) => motors.play(hand, finger, samples),
    onLift: (hand) => motors.stop(hand),
    onProblem: (error) => say(explanationOf(error)),
    onLimited: (reduction) => tellLimited(reduction, fingertips),
  });
  const viewpoint = new Viewpoint();
  const panel = new ControlPanel(room, (action) => press(action, fingertips, [pointer, keys]));
  const pointer = new DesktopPointer(part("view"), {
    view: viewpoint,
    under: (x, y) => room.under(x, y),
    press: (x, y) => panel.pressAt(room.rayAt(x, y)),
    isSwatch: (point) => swatchUnder(room.layout.places, point) !== null,
    onChange: changed,
  });
  const keys = new KeyboardStrokes(part("list"), swatches, room.layout.places, changed);
  Object.assign(shown, { room, fingertips, panel });
  part("scale").textContent = scaleInWords();
  followControls(fingertips);
  const refit = followSize(room, viewpoint);
  followObject({ room, swatches, keys, refit });
  const [button, why] = [part("enter"), part("why")];
  const parts = { button, why, room, fingertips, motors, panel, begin: () => sound.begin(), say };
  headset = new HeadsetEntry(parts);
  run({ room, fingertips, viewpoint, pointer, keys, panel, swatches });
  sound.tellSilence();
  part("view").dataset.ready = "true";
}

/** Moves the fingertips and draws, at each picture of the screen or of the headset. */
function run({ room, fingertips, viewpoint, pointer, keys, panel, swatches }) {
  let [last, told] = [0, 0];
  let pressed = ""; // touches and hints of the last picture
  room.renderer.setAnimationLoop((_, frame) => {
    const time = performance.now() / 1e3;
    const passed = Math.min(LONGEST_STEP, time - last);
    last = time;
    const { session } = shown;
    const tips = frame && session ? session.tips(frame) : desktopTips(pointer.point(passed), keys.point(passed));
    Object.assign(shown, { tips, touches: fingertips.step(tips, time) });
    if (session) panel.touch(tips);
    const pressing = `${shown.touches.length > 0} ${[...fingertips.beside]}`;
    const moved = pressing !== pressed || shown.touches.length > 0;
    if (!session && !(stale || moved)) return;
    stale = false;
    if (!session) viewpoint.place(room.camera, room.table.position);
    if (time - told >= READOUT || pressing !== pressed) {
      [told, pressed] = [time, pressing];
      tell(fingertips, panel, swatches);
    }
    room.draw();
  });
}

/** Updates the readout and the panel. */
function tell(fingertips, panel, swatches) {
  const { beside, stiffness } = fingertips;
  const [touch] = shown.touches;
  part("touch").textContent = touchesInWords(shown.touches, beside, swatches);
  panel.show({
    texture: touch ? nameOf(swatches[touch.index]) : "",
    load: touch?.load ?? 0,
    gain: sound.volume,
    muted: sound.muted,
    stiffness,
    hint: touch ? "" : hintOf(beside, swatches),
  });
}

/** Does what a button of the panel says. strokes: the DesktopPointer and the KeyboardStrokes. */
function press(action, fingertips, strokes) {
  const factor = { harder: STIFFER, softer: 1 / STIFFER }[action];
  const step = { louder: GAIN_STEP, quieter: -GAIN_STEP }[action];
  if (factor) {
    const stiffness = Math.min(STIFFEST, Math.max(SOFTEST, fingertips.stiffness * factor));
    for (const one of [fingertips, ...strokes]) one.stiffness = stiffness;
    for (const one of strokes) one.scaleLoad(factor);
  }
  if (step) {
    sound.volume = Math.round(10 * (sound.volume + step)) / 10;
    part("volume").value = sound.volume;
  }
  if (action === "mute") mute(fingertips);
  changed();
}

/** Turns the sound off or on again. */
function mute(fingertips) {
  sound.muted = !sound.muted;
  part("silence").setAttribute("aria-pressed", String(sound.muted));
  if (sound.muted) fingertips.close();
  changed();
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

function followControls(fingertips) {
  for (const kind of ["pointerdown", "keydown"])
    window.addEventListener(kind, () => sound.begin(), { once: true, capture: true });
  part("volume").addEventListener("input", ({ target }) => {
    sound.volume = Number(target.value);
    changed();
  });
  part("silence").addEventListener("click", () => mute(fingertips));
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
    viewpoint.fit(room.layout, room.camera, room.tall);
    changed();
  };
  new ResizeObserver(() => shown.session || fit()).observe(view.parentElement);
  room.refit = fit;
  fit();
  return fit;
}

/** Adds the object of a file that the user chooses. */
function followObject({ room, swatches, keys, refit }) {
  part("object").addEventListener("change", async ({ target }) => {
    const [file] = target.files;
    target.value = "";
    if (!file) return;
    try {
      const { addObject } = await import("./vr/own_object.js");
      const added = await addObject(room, swatches, file);
      for (const swatch of added) keys.add(swatch);
      say(`${file.name}: ${added.length} ${added.length === 1 ? "part" : "parts"} can be touched.`);
      refit();
    } catch (error) {
      say(explanationOf(error, "The object was not added. Export it again as GLB, or reload the page."));
    }
  });
}

begin().catch((error) => {
  if (error.problem?.status === 401) sendToPad("This service requires a key. ", "Enter it on the pad, then return.");
  else say(explanationOf(error));
});
