/* Plot of error against computing time, from the answer of `POST /v1/accuracy`.

Model: x is the computing time per second of sound, with set-up spread over the duration of the scene. y is the largest
error relative to peak-to-peak. Both are logarithmic. A line joins methods that differ in size only; open
points are the baseline with a table of one period. The broad line is the Pareto front. The ring marks the method of the
plan.
Limits: an error of zero is drawn at the lower edge. Labels without free space are omitted; the table has all methods.
*/

import { inWords } from "../scene/quantities.js";
import { logAxis } from "../views/axes.js";

const FAMILIES = ["baseline", "sampled", "exact", "cells", "steps", "table", "harmonics", "closed"]; // as they are shown
const ROUNDING = 2 ** -25; // error of a float32 sample near full scale
const MARGIN_DB = 6; // distance of imperceptible errors from the detection threshold
const SVG = "http://www.w3.org/2000/svg";
const DISTANCES = [1, 1.6, 2.4, 3.4]; // of a label from its point, tried in order, times `reach`
const PLACES = [
  [1, 0],
  [-1, 0],
  [0, -1],
  [0, 1],
  [1, -1],
  [1, 1],
  [-1, -1],
  [-1, 1],
];

/** Returns the computing time per second of sound, s, with set-up spread over the duration. */
export function costOf(document, row) {
  return row.setup_seconds / document.duration + row.seconds_per_second;
}

/** Returns the methods as series [{family, name, open, rows}], in order of families and of size. */
export function seriesOf(document) {
  const groups = new Map();
  for (const row of document.methods) {
    const pattern = row.method.replaceAll(/\d+/g, "#");
    const key = `${row.family}|${pattern}`;
    if (!groups.has(key)) groups.set(key, { family: row.family, pattern, rows: [] });
    groups.get(key).rows.push(row);
  }
  const order = (one) => FAMILIES.indexOf(one.family);
  const series = [...groups.values()].sort((one, other) => order(one) - order(other));
  for (const one of series) {
    const [heading, ...parts] = one.pattern.split(",").map((part) => part.trim());
    const kind = parts.filter((part) => !/[#\d]/.test(part));
    one.name = [heading, ...kind].join(", ");
    one.open = kind.includes("tabled");
    one.rows.sort((first, second) => numberOf(first.method) - numberOf(second.method));
  }
  return series;
}

/** Returns the error at which the first method comes within MARGIN_DB of the detection threshold. Assumes that the
 *  spectrum of an error keeps its shape. */
function feltError(document) {
  return Math.min(
    ...document.methods
      .filter((row) => row.max_error && row.threshold_margin_db !== null)
      .map((row) => row.max_error * 10 ** ((row.threshold_margin_db - MARGIN_DB) / 20)),
  );
}

/** Draws into `svg`, at its present size on the page. window: {across, up}: [low, high] of what is shown; absent: all.
 *  Returns {box, across, up}, its axes; null without a size. */
export function drawErrorPlot(svg, document, window = null) {
  const { width, height } = svg.getBoundingClientRect();
  if (!width) return null;
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  svg.replaceChildren();
  const box = { left: 58, right: width - 14, top: 30, bottom: height - 42 };
  const costs = document.methods.map((row) => costOf(document, row));
  const tolerance = document.scene.accuracy.tolerance;
  const errors = document.methods.map((row) => row.max_error).filter((error) => error > 0);
  const low = 10 ** Math.floor(Math.log10(Math.min(ROUNDING, ...errors) / 3));
  const highest = Math.max(10, decade(Math.max(...costs) * 1.5, Math.ceil));
  const [least, most] = window?.across ?? [decade(Math.min(...costs) / 1.5, Math.floor), highest];
  const across = logAxis(least, most, box.left, box.right, "s", 56);
  const [bottom, top] = window?.up ?? [low, Math.max(1, 2 * Math.max(...errors))];
  const up = logAxis(bottom, top, box.bottom, box.top, "", 24);
  const place = (row) => [across.place(costOf(document, row)), up.place(Math.max(row.max_error, low))];
  const series = seriesOf(document);
  const labels = new Labels(
    svg,
    box,
    series.flatMap(({ rows }) => dotted(rows.map(place))),
  );
  drawFrame(svg, box, across, up);
  const inside = add(svg, "g", window ? { "clip-path": clipOf(svg, box) } : {});
  drawFront(inside, document, place);
  drawLevel(svg, labels, [box.left, up.place(ROUNDING)], [box.right, up.place(ROUNDING)], "float32 rounding");
  const felt = feltError(document);
  if (felt > low && felt < 1) {
    drawLevel(svg, labels, [box.left, up.place(felt)], [box.right, up.place(felt)], "imperceptible below");
  }
  if (typeof tolerance === "number") {
    drawLevel(svg, labels, [box.left, up.place(tolerance)], [box.right, up.place(tolerance)], `tolerance ${tolerance}`);
  }
  drawLevel(svg, labels, [across.place(1), box.bottom], [across.place(1), box.top], "real time");
  for (const one of series) drawSeries(inside, one, place);
  drawChosen(inside, labels, document, place);
  for (const one of series) {
    for (const row of new Set([one.rows.at(-1), one.rows[0]])) {
      if (row.method !== document.chosen && labels.holds(place(row)))
        labels.put(sizeOf(row.method), place(row), `size family-${one.family}`);
    }
  }
  return { box, across, up };
}

/** Adds a clip to `box`; returns its reference. */
function clipOf(svg, { left, top, right, bottom }) {
  const clip = add(svg, "clipPath", { id: "error-plot-box" });
  add(clip, "rect", { x: left, y: top, width: right - left, height: bottom - top });
  return "url(#error-plot-box)";
}

/** Returns the text alternative of the plot: the method of the plan and the most accurate one. */
export function plotInWords(document) {
  const tell = (row) =>
    `${row.method}, with an error of ${row.max_error.toExponential(1)} ` +
    `and ${inWords(costOf(document, row), "s", 2)} per second of sound`;
  const chosen = document.methods.find((row) => row.method === document.chosen);
  const mostAccurate = document.methods.reduce((best, row) => (row.max_error < best.max_error ? row : best));
  const used = chosen ? `The plan uses ${tell(chosen)}. ` : "";
  return (
    `Error against computing time of ${document.methods.length} methods for the ${document.quantity}. ` +
    `${used}The most accurate is ${tell(mostAccurate)}. The table below has all of them.`
  );
}

function drawFrame(svg, box, across, up) {
  for (const { value, label, main } of across.ticks) {
    if (!main) continue;
    add(svg, "path", { class: "grid", d: `M${across.place(value)} ${box.top}V${box.bottom}` });
    text(svg, label, across.place(value), box.bottom + 16, value === across.high ? "end" : "middle");
  }
  for (const { value, main } of up.ticks) {
    if (!main) continue;
    add(svg, "path", { class: "grid", d: `M${box.left} ${up.place(value)}H${box.right}` });
    const share = value >= 1e-3 ? `${Number((value * 100).toPrecision(1))} %` : `10${raised(Math.log10(value))}`;
    text(svg, share, box.left - 7, up.place(value) + 4, "end");
  }
  text(svg, "Largest error, relative to peak-to-peak", 2, 14, "start", "title");
  text(svg, "computing time per second of sound, with set-up", box.right, box.bottom + 36, "end");
}

function drawFront(svg, document, place) {
  const front = document.methods
    .filter((row) => row.pareto)
    .map(place)
    .sort((one, other) => one[0] - other[0]);
  if (!front.length) return;
  const steps = front.slice(1).map(([x, y]) => `H${x}V${y}`);
  add(svg, "path", { class: "front", d: `M${front[0]}${steps.join("")}` });
}

function drawSeries(svg, { family, open, rows }, place) {
  const group = add(svg, "g", { class: `family-${family}` });
  add(group, "path", { class: "series", d: `M${rows.map(place).join("L")}` });
  for (const row of rows) {
    const [cx, cy] = place(row);
    const point = add(group, "circle", { class: open ? "point open" : "point", cx, cy, r: 3 });
    add(point, "title", {}).textContent = `${row.method}: error ${row.max_error.toExponential(1)}`;
  }
}

function drawLevel(svg, labels, from, to, words) {
  if (!labels.holds(from) || !labels.holds(to)) return;
  add(svg, "path", { class: "level", d: `M${from}L${to}` });
  const upright = from[0] === to[0];
  const place = upright ? [from[0], to[1] + 8] : [to[0] + 4, from[1]];
  labels.put(
    words,
    place,
    "level-words",
    upright
      ? [
          [-1, 0],
          [1, 0],
        ]
      : [
          [-1, -0.7],
          [-1, 0.7],
        ],
  );
  labels.avoid(dotted([from, to]));
}

function drawChosen(svg, labels, document, place) {
  const chosen = document.methods.find((row) => row.method === document.chosen);
  if (!chosen) return;
  const [cx, cy] = place(chosen);
  add(svg, "circle", { class: "ring", cx, cy, r: 7.5 });
  if (labels.holds([cx, cy])) labels.put("the plan’s choice", [cx, cy], "chosen", PLACES, 10);
}

/** Labels that overlap neither points nor each other. */
class Labels {
  #svg;
  #box;
  #points;
  #taken = [];

  constructor(svg, box, points) {
    [this.#svg, this.#box, this.#points] = [svg, box, points];
  }

  put(words, [x, y], look, directions = PLACES, reach = 7) {
    const label = text(this.#svg, words, 0, 0, "start", look);
    const [width, height] = [label.getComputedTextLength(), 12];
    for (const [right, down] of DISTANCES.flatMap((far) =>
      directions.map(([one, other]) => [far * one, far * other]),
    )) {
      const left = x + right * reach + (Math.sign(right) - 1) * (width / 2);
      const top = y + down * reach + (Math.sign(down) - 1) * (height / 2);
      const room = { left, top, right: left + width, bottom: top + height };
      if (this.#free(room)) {
        this.#taken.push(room);
        label.setAttribute("x", left);
        label.setAttribute("y", top + height - 3);
        return;
      }
    }
    label.remove();
  }

  /** Whether a place is in the box. */
  holds([x, y]) {
    const { left, top, right, bottom } = this.#box;
    return x >= left - 1 && x <= right + 1 && y >= top - 1 && y <= bottom + 1;
  }

  /** Keeps later labels away from `points`. */
  avoid(points) {
    this.#points.push(...points);
  }

  #free(room) {
    const box = this.#box;
    if (room.left < box.left || room.right > box.right || room.top < box.top - 2 || room.bottom > box.bottom)
      return false;
    const meets = (other) =>
      room.left < other.right + 4 && room.right > other.left - 4 && room.top < other.bottom && room.bottom > other.top;
    if (this.#taken.some(meets)) return false;
    return !this.#points.some(
      ([x, y]) => x > room.left - 3 && x < room.right + 3 && y > room.top - 1 && y < room.bottom + 1,
    );
  }
}

function add(parent, tag, attributes) {
  const made = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  return parent.appendChild(made);
}

function text(svg, words, x, y, anchor, look = "") {
  const made = add(svg, "text", { x, y, "text-anchor": anchor, class: look });
  made.textContent = words;
  return made;
}

/** Returns points along a line, 4 px apart. */
function dotted(points) {
  return points.flatMap(([x, y], index) => {
    const [fromX, fromY] = points[Math.max(0, index - 1)];
    const count = Math.max(1, Math.ceil(Math.hypot(x - fromX, y - fromY) / 4));
    return Array.from({ length: count }, (_, step) => [
      x + ((fromX - x) * step) / count,
      y + ((fromY - y) * step) / count,
    ]);
  });
}

function decade(value, rounded) {
  return 10 ** rounded(Math.log10(value));
}

function numberOf(method) {
  return Number(/\d+/.exec(method)?.[0] ?? 0);
}

function sizeOf(method) {
  const parts = method.split(",").map((part) => part.trim());
  return parts.slice(1).find((part) => /\d/.test(part)) ?? /\d.*/.exec(parts[0])?.[0] ?? method;
}

function raised(power) {
  return String(Math.round(power)).replaceAll(/./g, (sign) => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".indexOf(sign)]);
}
