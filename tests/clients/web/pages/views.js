/* The pictures, each in its place, and a few tools of the tests. */

import { Explained } from "/web/explained.js";
import * as axes from "/web/views/axes.js";
import * as quantities from "/web/scene/quantities.js";
import * as transform from "/web/views/fourier_transform.js";
import { TextureTopView } from "/web/views/texture_top_view.js";
import { Waveform } from "/web/views/waveform.js";
import { Spectrum } from "/web/views/spectrum.js";
import { ContactSideView } from "/web/views/contact_side_view.js";
import { PlanView } from "/web/plan/plan_view.js";
import { AccuracyControl } from "/web/plan/accuracy_control.js";

const place = (id) => document.getElementById(id);
const asked = [];
const answers = {};

/** Answers as the service would: with what the test put into `answers`, a path each. */
async function call(method, path, body) {
  asked.push({ method, path, body });
  if (answers[path] instanceof Error) throw answers[path];
  return answers[path];
}

/** Returns once the panel has been drawn anew. */
async function drawn(panel, change) {
  const before = panel.drawings;
  await change();
  while (panel.drawings === before) await new Promise(requestAnimationFrame);
}

function sinusoids(lines, rate, frames, begin = 0) {
  return Float32Array.from({ length: frames }, (_, frame) =>
    lines.reduce(
      (sum, [frequency, amplitude, phase = 0]) =>
        sum + amplitude * Math.cos((2 * Math.PI * frequency * (begin + frame)) / rate + phase),
      0,
    ),
  );
}

function pixels(canvas, x, y, width, height) {
  const { ratio } = window.views.panelOf(canvas);
  return Array.from(canvas.getContext("2d").getImageData(x * ratio, y * ratio, width * ratio, height * ratio).data);
}

window.views = {
  ...axes,
  ...quantities,
  ...transform,
  TextureTopView,
  Waveform,
  Spectrum,
  ContactSideView,
  PlanView,
  AccuracyControl,
  Explained,
  surface: new TextureTopView(place("surface")),
  waveform: new Waveform(place("waveform")),
  spectrum: new Spectrum(place("spectrum")),
  contact: new ContactSideView(place("contact")),
  plan: new PlanView(place("plan")),
  accuracy: new AccuracyControl(place("accuracy"), { call }),
  panelOf: (canvas) => window.views[canvas.id].panel,
  answers,
  asked,
  drawn,
  sinusoids,
  pixels,
};
