/* Cursor, zoom and export of the plot of error against computing time.

Model: the cursor goes through the methods in the order of their computing time. A zoom is about the method under the
cursor, equally along both axes. There is nothing to freeze: a plot stays until the next measurement.
Limits: the cursor finds the method that is nearest along the horizontal axis. */

import { make } from "../dom.js";
import { exportPlot } from "../plots/export_plot.js";
import { captionOf } from "../plots/file_header.js";
import { followGestures } from "../plots/gestures.js";
import { PlotPanel } from "../plots/plot_panel.js";
import { escaped } from "../plots/svg_context.js";
import { inWords } from "../scene/quantities.js";
import { hashOfScene } from "../scene/scene_hash.js";
import { call } from "../service.js";
import { costOf } from "./error_plot.js";

const COLUMNS = {
  method: "method",
  family: "family",
  max_error: "max_error",
  setup_seconds: "setup_s",
  seconds_per_second: "per_second_of_sound_s",
  memory_bytes: "memory_B",
  threshold_margin_db: "threshold_margin_dB",
  pareto: "pareto",
};
const LOOKS = [
  ...["fill", "stroke", "stroke-width", "stroke-dasharray", "stroke-linejoin", "stroke-linecap"],
  ...["font-size", "font-weight", "font-family"],
]; // of the style sheet that a file needs
const CAPTION = 20; // CSS px
const TOOLS = [
  ["out", "−", "Zoom out"],
  ["in", "+", "Zoom in"],
  ["svg", "SVG", "Download as SVG"],
  ["png", "PNG", "Download as PNG"],
  ["csv", "CSV", "Download the numbers as CSV"],
];

/** Fills the toolbar `place` of a plot. shown: {svg, axes, window, draw()}, see accuracy_control.js. measured: the
 *  answer of `POST /v1/accuracy`. */
export function mountErrorTools(place, shown, measured) {
  const rows = [...measured.methods].sort((one, other) => costOf(measured, one) - costOf(measured, other));
  const lines = [{ xs: rows.map((row) => costOf(measured, row)), ys: rows.map((row) => row.max_error) }];
  const describe = (x) => describedAt(rows, lines[0].xs.indexOf(x), x);
  const live = () => shown.axes && { plot: { lines, across: shown.axes.across, describe }, axes: shown.axes };
  const panel = new PlotPanel(shown.svg, live);
  const whole = () => showWindow(shown, null);
  const gestures = {
    point: (x) => panel.point(x),
    step: (by) => panel.step(by),
    zoom: (factor) => zoomBy(shown, panel.place, factor),
    whole,
  };
  shown.svg.setAttribute("tabindex", "0");
  followGestures(shown.svg, gestures, () => {});
  const act = { in: () => gestures.zoom(2), out: () => gestures.zoom(0.5) };
  place.append(
    ...TOOLS.map(([action, text, title]) => {
      const attributes = { type: "button", "data-action": action, title, "aria-label": title, text };
      const click = act[action] ?? (() => exportPlot(action, plotOf(shown, measured), panel.panel, null));
      return make("button", { ...attributes, click });
    }),
  );
}

function describedAt(rows, index, cost) {
  const { method, max_error: error } = rows[index];
  return `${method}: error ${error.toExponential(1)}, ${inWords(cost, "s", 2)}`;
}

/** Zooms by a factor about `place`, {x, y} in values of the axes, or about the middle. */
function zoomBy(shown, place, factor) {
  if (!shown.axes) return;
  const { across, up } = shown.axes;
  shown.whole ??= { across: [across.low, across.high], up: [up.low, up.high] };
  const [x, y] = [place?.x ?? Math.sqrt(across.low * across.high), place?.y ?? Math.sqrt(up.low * up.high)];
  const part = (axis, about, [low, high]) => {
    const [first, last] = [about * (axis.low / about) ** (1 / factor), about * (axis.high / about) ** (1 / factor)];
    return [Math.max(low, first), Math.min(high, last)];
  };
  const window = { across: part(across, x, shown.whole.across), up: part(up, y, shown.whole.up) };
  const isWhole = ["across", "up"].every((axis) =>
    window[axis].every((end, index) => end === shown.whole[axis][index]),
  );
  showWindow(shown, isWhole ? null : window);
}

function showWindow(shown, window) {
  shown.window = window;
  shown.draw();
}

/** Returns the plot for `exportPlot`. */
function plotOf({ svg, axes }, measured) {
  const names = Object.keys(COLUMNS);
  return {
    kind: "error",
    header: () => headerOf(measured),
    svg: (header) => svgOf(svg, axes, header),
    columns: [...Object.values(COLUMNS), "with_setup_s", "chosen"],
    rows: () =>
      measured.methods.map((row) => [
        ...names.map((name) => row[name]),
        costOf(measured, row),
        row.method === measured.chosen,
      ]),
  };
}

async function headerOf({ scene, quantity, duration }) {
  const plan = await call("POST", "/v1/explain", scene).catch(() => null);
  return {
    ...{ program: "ridgewave", plot: "error", quantity, duration_s: duration },
    scene_sha256: await hashOfScene(scene),
    estimated_error: plan?.estimated_error ?? null,
    scene,
  };
}

/** Returns {text, width, height} of the plot as a file of its own, with the look that the style sheet gives it. */
function svgOf(svg, { across, up }, header) {
  const { width, height } = svg.getBoundingClientRect();
  const copy = svg.cloneNode(true);
  const [from, to] = [svg, copy].map((one) => [...one.querySelectorAll("*")]);
  from.forEach((element, index) => {
    const style = getComputedStyle(element);
    for (const name of LOOKS) to[index].setAttribute(name, style.getPropertyValue(name)); // a page may set no `style`
  });
  const style = getComputedStyle(svg);
  const told = ({ low, high, log, place }) => ({ low, high, log, from: place(low), to: place(high) });
  const metadata = escaped(JSON.stringify({ ...header, axes: { across: told(across), up: told(up) } }));
  const ground = `<rect width="${width}" height="${height + CAPTION}" fill="${style.getPropertyValue("--ground")}"/>`;
  const look = `font-size="10" font-family="sans-serif" fill="${style.getPropertyValue("--muted")}"`;
  const caption = `<text x="2" y="${height + CAPTION - 7}" ${look}>${escaped(captionOf(header)[0])}</text>`;
  const size = `width="${width}" height="${height + CAPTION}" viewBox="0 0 ${width} ${height + CAPTION}"`;
  const inner = [...copy.childNodes].map((child) => new XMLSerializer().serializeToString(child)).join("");
  const text = `<svg xmlns="http://www.w3.org/2000/svg" ${size}><metadata>${metadata}</metadata>${ground}${inner}${caption}</svg>`;
  return { text, width, height: height + CAPTION };
}
