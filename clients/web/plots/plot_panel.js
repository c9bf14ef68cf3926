/* A plot over a canvas of the page: frozen or further plots, the cursor, and the zoom.

Model: a transparent canvas lies exactly over the live one and lets pointers through. It draws a plot, or only the
cursor where the live plot shows. So the live plot goes on below, and the page does not reflow.
Limits: a plot is zoomed along its horizontal axis, at most MOST_ZOOM times. */

import { make } from "../dom.js";
import { Panel } from "../views/panel.js";
import { drawCursor, nearestPoint } from "./cursor.js";
import { drawPlot } from "./plot_drawing.js";

const MOST_ZOOM = 1000;

export class PlotPanel {
  /** The plot that is shown, null for the live one. */
  plot = null;
  /** [low, high] of the horizontal axis, SI. */
  window = null;
  #axes = null;
  #cursor = null; // value of the horizontal axis
  #badge = "";

  /** live: the canvas or SVG below. livePlot(): {plot, axes: {box, across, up}} of what it shows, or null. */
  constructor(live, livePlot) {
    Object.assign(this, { live, livePlot });
    const canvas = make("canvas.plot-over");
    live.after(canvas);
    this.panel = new Panel(canvas, "Plot: nothing is frozen.", () => this.#draw());
    this.status = make("p.plot-status", { role: "status" });
    live.after(this.status);
    canvas.setAttribute("aria-hidden", "true");
    new ResizeObserver(() => this.#fit()).observe(live);
    this.#fit();
  }

  /** Shows `plot` with a word about it, such as "frozen"; null: the live plot. The window stays where the plot is of
   *  the same kind. */
  show(plot, badge = "") {
    const same = plot && this.plot?.kind === plot.kind;
    if (!same) this.window = plot && (plot.begin ?? [plot.across.low, plot.across.high]);
    if (same && !this.window) this.window = [plot.across.low, plot.across.high];
    Object.assign(this, { plot });
    this.#fit();
    this.#badge = badge;
    const { canvas } = this.panel;
    canvas.toggleAttribute("aria-hidden", false);
    if (!plot) canvas.setAttribute("aria-hidden", "true");
    if (plot) this.panel.say(`${badge ? `${badge}: ` : ""}${plot.told}`);
    this.panel.request();
  }

  /** Zooms the plot by a factor about the cursor or, without one, about `middle`, a value of its axis. */
  zoom(factor, middle = this.#cursor) {
    if (!this.plot) return;
    const { low, high, log } = this.plot.across;
    const [to, from] = log ? [Math.log, Math.exp] : [(value) => value, (value) => value];
    const [begin, end] = this.window.map(to);
    const least = (to(high) - to(low)) / MOST_ZOOM;
    const wide = Math.min(to(high) - to(low), Math.max(least, (end - begin) / factor));
    const about =
      middle === null || middle < this.window[0] || middle > this.window[1] ? (begin + end) / 2 : to(middle);
    const first = about - ((about - begin) / (end - begin)) * wide;
    this.#move(first, wide, [to(low), to(high)], from);
  }

  /** Moves the plot by a part of the shown width; positive: to higher values. */
  pan(part) {
    if (!this.plot) return;
    const { low, high, log } = this.plot.across;
    const [to, from] = log ? [Math.log, Math.exp] : [(value) => value, (value) => value];
    const [begin, end] = this.window.map(to);
    this.#move(begin + part * (end - begin), end - begin, [to(low), to(high)], from);
  }

  /** Shows the whole plot. */
  whole() {
    if (this.plot) this.window = [this.plot.across.low, this.plot.across.high];
    this.panel.request();
  }

  #move(first, wide, [low, high], from) {
    const begin = Math.min(high - wide, Math.max(low, first));
    this.window = [from(begin), from(begin + wide)];
    if (begin <= low) this.window[0] = this.plot.across.low; // not to its rounding
    if (begin + wide >= high) this.window[1] = this.plot.across.high;
    this.panel.request();
  }

  /** Puts the cursor to `x`, CSS px from the left edge; null removes it. */
  point(x) {
    const axes = this.#shown()?.axes;
    this.#cursor = x === null || !axes ? null : valueAt(axes.across, x);
    this.panel.request();
  }

  /** Moves the cursor by so many points, or to the first (-Infinity) or the last (Infinity), and says its value. */
  step(by) {
    const shown = this.#shown();
    if (!shown) return;
    const { xs } = shown.plot.lines[0];
    const { low, high } = shown.axes.across;
    const middle = shown.plot.across.log ? Math.sqrt(low * high) : (low + high) / 2;
    const now = this.#cursor === null ? nearestPoint(shown.plot, middle) : nearestPoint(shown.plot, this.#cursor) + by;
    const index = Math.min(xs.length - 1, Math.max(0, now));
    this.#cursor = xs[index];
    if (this.plot && (xs[index] < this.window[0] || xs[index] > this.window[1])) {
      const wide = this.window[1] - this.window[0];
      this.pan((xs[index] - (xs[index] < this.window[0] ? this.window[0] : this.window[1])) / wide);
    }
    this.status.textContent = this.reading;
    this.panel.request();
  }

  /** The point at the cursor, {x, y} in values of the axes; null without a cursor. */
  get place() {
    const shown = this.#cursor === null ? null : this.#shown();
    if (!shown) return null;
    const [{ xs, ys }] = shown.plot.lines;
    const index = nearestPoint(shown.plot, this.#cursor);
    return { x: xs[index], y: ys[index] };
  }

  /** The value at the cursor as text, "" without a cursor. */
  get reading() {
    const shown = this.#cursor === null ? null : this.#shown();
    if (!shown) return "";
    const [{ xs, ys }] = shown.plot.lines;
    const index = nearestPoint(shown.plot, this.#cursor);
    return xs.length ? shown.plot.describe(xs[index], ys[index]) : "";
  }

  /** Returns {plot, axes} of what is shown now, null before anything is. */
  #shown() {
    if (!this.plot) return this.livePlot();
    return this.#axes && { plot: this.plot, axes: this.#axes };
  }

  #draw() {
    const { plot, panel } = this;
    if (plot) this.#axes = drawPlot(panel, plot, this.window);
    if (plot && this.#badge) this.#drawBadge();
    const shown = this.#cursor === null ? null : this.#shown();
    if (!shown) return;
    drawCursor(panel, shown, this.#cursor, this.reading);
    if (!plot) panel.request(); // the live plot moves on
  }

  #drawBadge() {
    const { context, height } = this.panel;
    context.font = this.panel.font(11, 600);
    context.textAlign = "left";
    context.textBaseline = "alphabetic";
    context.fillStyle = this.panel.colour("threshold");
    context.fillText(this.#badge, 2, height - 4);
  }

  #fit() {
    const { live } = this;
    const around = this.panel.canvas.offsetParent?.getBoundingClientRect();
    if (!around) return;
    const box = live.getBoundingClientRect();
    Object.assign(this.panel.canvas.style, {
      left: `${box.left - around.left}px`,
      top: `${box.top - around.top}px`,
      width: `${box.width}px`,
      height: `${box.height}px`,
    });
  }
}

/** Returns the value of an axis at a place, CSS px. */
function valueAt({ place, low, high, log }, x) {
  const part = Math.min(1, Math.max(0, (x - place(low)) / (place(high) - place(low))));
  return log ? low * (high / low) ** part : low + part * (high - low);
}
