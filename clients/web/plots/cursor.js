/* The cursor of a plot: the nearest point of its first line, and its value as text. */

import { indexOf } from "./plot_drawing.js";

const ROOM = 5; // CSS px around the text

/** Returns the index of the point of the first line that is nearest to `x`, a value of the horizontal axis. */
export function nearestPoint({ lines: [{ xs }], across }, x) {
  const next = Math.min(indexOf(xs, x), xs.length - 1);
  if (next < 1) return Math.max(0, next);
  const apart = (one) => (across.log ? Math.abs(Math.log(xs[one] / x)) : Math.abs(xs[one] - x));
  return apart(next - 1) < apart(next) ? next - 1 : next;
}

/** Draws the cursor at the point nearest to `x`, with `text`. shown: {plot, axes}. */
export function drawCursor(panel, { plot, axes: { box, across, up } }, x, text) {
  const { context } = panel;
  const [{ xs, ys }] = plot.lines;
  const index = nearestPoint(plot, x);
  if (!xs.length) return;
  const left = across.place(xs[index]);
  if (left < box.left - 1 || left > box.right + 1) return;
  const top = Math.min(box.bottom, Math.max(box.top, up.place(up.low > 0 ? Math.max(ys[index], up.low) : ys[index])));
  context.strokeStyle = panel.colour("ink");
  context.lineWidth = 1;
  context.setLineDash([]);
  context.beginPath();
  context.moveTo(Math.round(left) + 0.5, box.top);
  context.lineTo(Math.round(left) + 0.5, box.bottom);
  context.stroke();
  context.fillStyle = panel.colour("ink");
  context.beginPath();
  context.arc(left, top, 3.5, 0, 2 * Math.PI);
  context.fill();
  context.font = panel.font(12, 600);
  const wide = context.measureText(text).width + 2 * ROOM;
  const begin = Math.max(box.left, Math.min(panel.width - wide, left + 8));
  context.fillStyle = panel.colour("plate");
  context.fillRect(begin, box.top + 2, wide, 20);
  context.fillStyle = panel.colour("ink");
  context.textAlign = "left";
  context.textBaseline = "middle";
  context.fillText(text, begin + ROOM, box.top + 12);
}
