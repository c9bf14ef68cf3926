/* Drawing of a plot, in the part of its horizontal axis that is shown.

Model: a plot is plain values:
  title, acrossTitle: of the axes.
  across, up: {low, high, unit, log}: the whole axes, SI.
  lines: [{xs, ys, colour, fill, dash, legend, hidden, band}], SI; colour: a custom property of views.css.
    band: the factor up and down to which its surroundings are shaded.
  bounds: values of `up` to be marked. marks: [{x, label}]. words: lines of text under the title.
  image: {picture, left, right, low, high}: a picture in axes' values, instead of lines.
  describe(x, y): the value of the first line as text. columns, rows: as they are exported.
Limits: a line is drawn with all its points. */

import { drawAxes, drawLegend, linearAxis, logAxis } from "../views/axes.js";

const BOX = { left: 72, top: 40, right: 12, bottom: 34 }; // CSS px to the edges of the canvas
const LINE = 14; // CSS px per line of words

/** Returns {box, across, up} of `plot` in `window`, [low, high] of the horizontal axis. lines: of words under the title. */
export function axesOf({ width, height }, plot, [low, high] = [plot.across.low, plot.across.high], lines = 0) {
  const room = lines ? (lines - 1) * LINE + 4 : 0;
  const box = { left: BOX.left, top: BOX.top + room, right: width - BOX.right, bottom: height - BOX.bottom };
  const axis = ({ unit, log }, from, to, most, apart, least, largest) =>
    log ? logAxis(least, largest, from, to, unit, apart) : linearAxis(least, largest, from, to, unit, most);
  const across = axis(plot.across, box.left, box.right, Math.max(2, width / 110), 48, low, high);
  const { up } = plot;
  return { box, across, up: axis(up, box.bottom, box.top, Math.max(3, height / 45), 20, up.low, up.high) };
}

/** Draws `plot` on `panel`: {context, width, height, colour(name), font(size, weight)}. Returns its axes. */
export function drawPlot(panel, plot, window) {
  const { context, width, height } = panel;
  context.font = panel.font(11);
  const words = wrapped(context, plot.words ?? [], width - 4);
  const axes = axesOf(panel, plot, window, words.length);
  const { box, across, up } = axes;
  context.fillStyle = panel.colour("ground");
  context.fillRect(0, 0, width, height);
  const titled = (title, axis, { log }) => (log ? title : `${title} (${axis.unit})`);
  const free = drawAxes(panel, box, across, up, {
    acrossTitle: titled(plot.acrossTitle, across, plot.across),
    upTitle: titled(plot.title, up, plot.up),
  });
  drawWords(panel, plot.lines, words, box, free);
  context.save();
  context.beginPath();
  context.rect(box.left, box.top, box.right - box.left, box.bottom - box.top);
  context.clip();
  if (plot.image) drawImage(context, plot.image, across, up);
  for (const value of plot.bounds ?? []) drawBound(panel, box, up.place(value));
  for (const line of plot.lines) if (!line.hidden) drawLine(panel, line, axes);
  context.restore();
  drawMarks(panel, plot.marks ?? [], box, across);
  return axes;
}

function drawLine(panel, { xs, ys, colour, fill, band, dash = [] }, { box, across, up }) {
  const { context } = panel;
  const [first, last] = visible(xs, across);
  const lowest = up.low > 0 ? up.low / 10 : -Infinity; // a logarithm has no zero
  if (band) {
    const placed = (factor) => Array.from(xs, (x, index) => [across.place(x), up.place(ys[index] * factor)]);
    context.beginPath();
    for (const place of [...placed(band), ...placed(1 / band).reverse()]) context.lineTo(...place);
    context.fillStyle = panel.colour(`${colour}-soft`);
    context.fill();
  }
  context.beginPath();
  for (let index = first; index <= last; index++)
    context.lineTo(across.place(xs[index]), Math.min(box.bottom + 4, up.place(Math.max(ys[index], lowest))));
  context.strokeStyle = panel.colour(colour);
  context.lineWidth = 1.4;
  context.lineJoin = "round";
  context.setLineDash(dash);
  context.stroke();
  context.setLineDash([]);
  if (!fill) return;
  context.lineTo(box.right, box.bottom + 4);
  context.lineTo(box.left, box.bottom + 4);
  context.fillStyle = panel.colour(fill);
  context.fill();
}

/** Returns the first and the last index of rising `xs` on an axis, and one more to each side. */
function visible(xs, { low, high }) {
  return [Math.max(0, indexOf(xs, low) - 1), Math.min(xs.length - 1, indexOf(xs, high) + 1)];
}

/** Returns the index of the first of the rising `xs` that is not below `x`. */
export function indexOf(xs, x) {
  let [low, high] = [0, xs.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (xs[middle] < x) low = middle + 1;
    else high = middle;
  }
  return low;
}

function drawImage(context, { picture, left, right, low, high }, across, up) {
  const [x, y] = [across.place(left), up.place(high)];
  context.imageSmoothingEnabled = false;
  context.drawImage(picture, x, y, across.place(right) - x, up.place(low) - y);
}

function drawBound(panel, box, y) {
  const { context } = panel;
  context.strokeStyle = panel.colour("threshold");
  context.lineWidth = 1;
  context.setLineDash([5, 4]);
  context.beginPath();
  context.moveTo(box.left, y);
  context.lineTo(box.right, y);
  context.stroke();
  context.setLineDash([]);
}

function drawMarks(panel, marks, box, across) {
  const { context } = panel;
  context.strokeStyle = context.fillStyle = panel.colour("mark");
  context.lineWidth = 1;
  context.font = panel.font(11);
  context.textAlign = "center";
  context.textBaseline = "alphabetic";
  context.setLineDash([1, 3]);
  context.beginPath();
  let free = -Infinity;
  for (const { x, label } of marks) {
    const place = across.place(x);
    if (x < across.low || x > across.high) continue;
    context.moveTo(place, box.top - 4);
    context.lineTo(place, box.bottom);
    const half = context.measureText(label).width / 2;
    if (place - half < free) continue;
    context.fillText(label, place, box.top - 8);
    free = place + half + 6;
  }
  context.stroke();
  context.setLineDash([]);
}

/** Returns sentences as lines that are at most `width` CSS px wide in the font of `context`. */
function wrapped(context, sentences, width) {
  const lines = [];
  for (const sentence of sentences) {
    let line = "";
    for (const word of sentence.split(" ")) {
      const longer = line ? `${line} ${word}` : word;
      if (line && context.measureText(longer).width > width) lines.push(line);
      line = line && context.measureText(longer).width > width ? word : longer;
    }
    lines.push(line);
  }
  return lines;
}

/** Draws the legend to the right of the title, and the words under it. */
function drawWords(panel, lines, words, box, free) {
  const { context } = panel;
  context.font = panel.font(11);
  context.textBaseline = "alphabetic";
  context.textAlign = "right";
  let { right } = box;
  for (const { legend, colour, dash = [] } of lines) {
    if (!legend) continue;
    const wide = context.measureText(legend).width;
    if (right - wide - 24 < free) break;
    right = drawLegend(context, panel, { right, at: 13, words: legend, colour, dash });
  }
  context.textAlign = "left";
  context.fillStyle = panel.colour("ink");
  for (const [index, text] of words.entries()) context.fillText(text, 2, 30 + LINE * index);
}
