/* What the tests reach the page's modules by, and tools of theirs: polling, scripted hands, samples as text. */

import * as service from "/web/service.js";
import * as contact from "/web/live/contact_update.js";
import * as connection from "/web/live/connection.js";
import * as changes from "/web/live/scene_changes.js";
import * as player from "/web/sound/player.js";
import * as depth from "/web/sound/queue_depth.js";
import * as finger from "/web/hand/finger.js";
import * as pointers from "/web/hand/pointers.js";
import * as automaticStroke from "/web/hand/automatic_stroke.js";
import * as envelope from "/web/motors/strength.js";
import * as motors from "/web/motors/motors.js";

const PATIENCE = 60000; // ms

function pause(milliseconds) {
  return new Promise((resolve) => setTimeout(resolve, milliseconds));
}

async function until(happened, what = String(happened)) {
  const deadline = performance.now() + PATIENCE;
  while (!happened()) {
    if (performance.now() > deadline) throw new Error(`it never happened: ${what}; ${fingers.map(stateOf).join("; ")}`);
    await pause(5);
  }
}

const fingers = []; // all that a test opened

/** A finger whose state is told where something never happened. */
class Finger extends finger.Finger {
  constructor(how) {
    super(how);
    fingers.push(this);
  }
}

function stateOf({ connection, source, touching, player: { context } }) {
  const { state, outstanding, frame } = connection;
  const { queued, given, played, missing } = source ?? {};
  const sound = { queued, given, played, missing, audio: context.state, seconds: context.currentTime };
  return JSON.stringify({ state, touching, outstanding, frame, ...sound });
}

function once(target, type) {
  return new Promise((resolve) => target.addEventListener(type, ({ detail }) => resolve(detail), { once: true }));
}

/** Keeps all events of `target` as [type, detail]. */
function heard(target, ...types) {
  const kept = [];
  for (const type of types) target.addEventListener(type, ({ detail }) => kept.push([type, detail]));
  return kept;
}

/** Moves a finger for so many seconds of its own clock, as `path(t)` says: {position, load}, each 8 ms. */
async function stroke(hand, seconds, path) {
  const began = performance.now() / 1e3;
  for (let count = 0; 0.008 * count <= seconds; count += 1) {
    const time = 0.008 * count;
    while (performance.now() / 1e3 < began + time) await pause(1);
    hand.move({ ...path(time), time: began + time });
  }
}

/** Float32Array or bytes as base64, to be taken out of the page bit for bit. */
function packed(samples) {
  const bytes = new Uint8Array(samples.buffer ?? samples, samples.byteOffset ?? 0, samples.byteLength);
  let text = "";
  for (let place = 0; place < bytes.length; place += 32768) {
    text += String.fromCharCode(...bytes.subarray(place, place + 32768));
  }
  return btoa(text);
}

window.modules = {
  ...service,
  ...contact,
  ...connection,
  ...changes,
  ...player,
  ...depth,
  ...finger,
  Finger,
  ...pointers,
  ...automaticStroke,
  ...envelope,
  ...motors,
  pause,
  until,
  once,
  heard,
  stroke,
  packed,
};
