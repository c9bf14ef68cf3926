/* The texture from above, with a scale bar, a legend of heights, and the fingers.

Model: with a relief, the surface is lit (relief/relief.js). Without one, heights repeat along x and are averaged over each device pixel. Those over an area repeat in both directions, and
are interpolated between the heights that are given. Without a relief the colour changes linearly with the height from --valley to
--crest. Slopes that face left are lighter and those that face right darker, by at most RELIEF of that range, in
proportion to the steepest slope. The left edge is position 0, the middle y = 0.
Limits: a fine area is not averaged. Fingers are elements over the canvas, so that they move without a drawing. */

import { Relief } from "../relief/relief.js";
import { inWords } from "../scene/quantities.js";
import { roundBelow } from "./axes.js";
import { Panel } from "./panel.js";

const RELIEF = 0.28;
const NEAREST = 2e-6; // m per CSS px
const FARTHEST = 1e-3;
const PERIOD_PIXELS = 36; // CSS px per period at first
const STEP = 2 ** 0.25; // zoom per key press or notch of the wheel
const WIDEST_BAR = 140; // CSS px
const FINEST = 3; // CSS px per period; with fewer, ridges cannot be distinguished
const SLENDER = 0.8; // width of a finger's mark over its length

/** Dispatches the event "zoom" {metresPerPixel} on the canvas when the user zooms. */
export class TextureTopView {
  #heights = null;
  #sums;
  #area = null; // {rows: heights (m), across: period (m)}
  #marks = [];
  #touches = document.createElement("div");
  #image = document.createElement("canvas"); // one device pixel high, or a period of an area

  /** relief: whether the surface is lit, where the browser can. */
  constructor(canvas, { relief = false } = {}) {
    this.metresPerPixel = 5e-5; // m per CSS px
    /** {left, bottom, width, height (CSS px), metresPerPixel}: a part of the relief at another scale; null: none. */
    this.inset = null;
    this.panel = new Panel(canvas, "Texture from above: not loaded yet.", () => this.#draw());
    /** The last drawing: `bar` {length (m), pixels, left, top (CSS px)}. */
    this.drawn = { bar: null };
    const place = document.createElement("div");
    place.className = "texture-view";
    canvas.replaceWith(place);
    this.#touches.className = "finger-marks";
    this.#touches.setAttribute("aria-hidden", "true");
    place.append(canvas, this.#touches);
    if (relief) this.#light(place);
    canvas.tabIndex = 0;
    canvas.setAttribute("aria-keyshortcuts", "+ - 0");
    canvas.addEventListener("keydown", (event) => this.#key(event));
    canvas.addEventListener("wheel", (event) => this.#wheel(event), { passive: false });
  }

  /** Puts the relief under the canvas. */
  #light(place) {
    const canvas = document.createElement("canvas");
    canvas.setAttribute("aria-hidden", "true");
    this.relief = Relief.on(canvas);
    if (!this.relief) return;
    place.prepend(canvas);
    place.classList.add("relief");
    this.relief.onLost = () => {
      canvas.remove();
      place.classList.remove("relief");
      this.relief = null;
      this.panel.restyle();
    };
  }

  /** Shows a texture. heights: m, over one period. period: m. area: rows of heights, m, over one period in both
   *  directions, and across: period across, m; absent for a line. contactLength: m, length of a finger's mark; null:
   *  unknown. finger: {begin, length, heights} (m) of a picture, for a relief. */
  show({ heights, period, area = null, across = null, contactLength = null, finger = null }) {
    const fresh = period !== this.period;
    this.#heights = Float64Array.from(heights);
    this.#area = area && { rows: area, across };
    this.period = period;
    this.contactLength = contactLength;
    [this.low, this.high] = [Infinity, -Infinity];
    for (const row of area ?? [heights])
      for (const height of row) {
        this.low = Math.min(this.low, height);
        this.high = Math.max(this.high, height);
      }
    this.#sums = new Float64Array(heights.length + 1);
    this.#heights.forEach((height, index) => {
      // integral of the heights, interpolated linearly
      this.#sums[index + 1] = this.#sums[index] + (height + this.#heights[(index + 1) % heights.length]) / 2;
    });
    this.relief?.show({ heights, period, area, across });
    if (finger) this.relief?.touchWith(finger, SLENDER * finger.length);
    if (fresh) this.#zoomTo(this.fitting(), false);
    else this.panel.request();
  }

  /** Returns the metres per CSS px at which single ridges are clearly visible. */
  fitting() {
    return limited((this.period ?? 36 * 5e-5) / PERIOD_PIXELS);
  }

  /** Sets the scale, metres per CSS px. */
  zoom(metresPerPixel) {
    this.#zoomTo(metresPerPixel, false);
  }

  /** Marks fingers. positions: m, or {position (m), across (0 to 1 of the height)}; for a relief also z (m; null: unknown)
   *  and size, that of the footprint. */
  touch(positions) {
    while (this.#marks.length < positions.length) {
      this.#marks.push(this.#touches.appendChild(document.createElement("i")));
    }
    this.#marks.forEach((mark, index) => {
      mark.hidden = index >= positions.length;
      if (mark.hidden) return;
      const one = positions[index];
      const { position, across = 0.5 } = typeof one === "number" ? { position: one } : one;
      const length = this.contactLength ? Math.max(14, this.contactLength / this.metresPerPixel) : 28;
      const height = Math.min(length * SLENDER, this.panel.height * 0.8);
      const [x, y] = [position / this.metresPerPixel - length / 2, across * this.panel.height - height / 2];
      mark.style.width = `${length}px`;
      mark.style.height = `${height}px`;
      mark.style.transform = `translate(${x.toFixed(2)}px, ${y.toFixed(2)}px)`;
    });
    this.touching = positions;
    this.relief?.touch(positions.map((one) => this.#onRelief(one)));
  }

  #onRelief({ position, across, z = null, size = 1 }) {
    return { position, y: (0.5 - across) * this.panel.height * this.metresPerPixel, z, size };
  }

  /** Returns the mean height (m) between two positions (m) of the repeated texture. */
  heightBetween(begin, end) {
    const count = this.#heights.length;
    const [from, to] = [(begin / this.period) * count, (end / this.period) * count];
    return (this.#integral(to) - this.#integral(from)) / (to - from);
  }

  #integral(place) {
    const count = this.#heights.length;
    const turns = Math.floor(place / count);
    const inside = place - turns * count;
    const index = Math.min(Math.floor(inside), count - 1);
    const part = inside - index;
    const [first, next] = [this.#heights[index], this.#heights[(index + 1) % count]];
    return turns * this.#sums[count] + this.#sums[index] + part * (first + (part * (next - first)) / 2);
  }

  #draw() {
    if (!this.#heights) return;
    if (this.relief) this.#drawRelief();
    else if (this.#area) this.#drawArea();
    else this.#drawLine();
    this.#drawBar();
    this.#drawLegend();
    this.#tell();
    if (this.touching) this.touch(this.touching);
  }

  #drawRelief() {
    const { width, height, ratio } = this.panel;
    const names = { material: "relief-crest", ground: "relief-valley", glow: "glow", flesh: "finger" };
    const rgb = (name) => [...rgbOf(this.panel.colour(name))].slice(0, 3).map((part) => part / 255);
    const colours = Object.fromEntries(Object.entries(names).map(([key, name]) => [key, rgb(name)]));
    this.relief.view = { width, height, ratio, metresPerPixel: this.metresPerPixel, colours, inset: this.inset };
  }

  #drawLine() {
    const { context, width, height } = this.panel;
    const image = this.#stripe();
    context.imageSmoothingEnabled = false;
    context.drawImage(image, 0, 0, image.width, 1, 0, 0, width, height);
  }

  #stripe() {
    const count = this.panel.canvas.width;
    const perPixel = this.metresPerPixel / this.panel.ratio;
    const heights = Float64Array.from({ length: count + 2 }, (_, x) =>
      this.heightBetween((x - 1) * perPixel, x * perPixel),
    );
    return this.#shaded([heights]);
  }

  /** Draws the area: a tile of one period, repeated. y is 0 in the middle of the picture and rises. */
  #drawArea() {
    const { context, width, height } = this.panel;
    const { rows, across } = this.#area;
    const count = rows.length;
    const downwards = rows.map((_, index) => rows[(count - index) % count]);
    const closed = downwards.map((row) => [row.at(-1), ...row, row[0]]);
    const pattern = context.createPattern(this.#shaded(closed), "repeat");
    const [wide, high] = [this.period, across].map((length) => length / count / this.metresPerPixel);
    const first = [-wide / 2, height / 2 - high / 2]; // a height is in the middle of its pixel
    pattern.setTransform(new DOMMatrix([wide, 0, 0, high, ...first]));
    context.imageSmoothingEnabled = true;
    context.fillStyle = pattern;
    context.fillRect(0, 0, width, height);
  }

  /** Returns the picture of rows of heights, the first at the top. Each row has an extra height at both ends. */
  #shaded(rows) {
    const count = rows[0].length - 2;
    let steepest = 0;
    for (const row of rows)
      for (let x = 1; x <= count; x++) steepest = Math.max(steepest, Math.abs(row[x + 1] - row[x - 1]));
    const [valley, crest] = ["valley", "crest"].map((name) => rgbOf(this.panel.colour(name)));
    const span = this.high - this.low;
    const pixels = new ImageData(count, rows.length);
    let place = 0;
    for (const row of rows)
      for (let x = 1; x <= count; x++) {
        const slope = steepest ? (row[x + 1] - row[x - 1]) / steepest : 0;
        const level = span ? (row[x] - this.low) / span : 0.5;
        const light = Math.min(1, Math.max(0, level + RELIEF * slope));
        for (let part = 0; part < 3; part++)
          pixels.data[place++] = Math.round(valley[part] + light * (crest[part] - valley[part]));
        pixels.data[place++] = 255;
      }
    this.#image.width = count;
    this.#image.height = rows.length;
    this.#image.getContext("2d").putImageData(pixels, 0, 0);
    return this.#image;
  }

  #drawBar() {
    const { context, height, ratio } = this.panel;
    const widest = Math.min(WIDEST_BAR, this.panel.width / 3);
    const length = roundBelow(widest * this.metresPerPixel);
    const wide = length / this.metresPerPixel;
    const [left, top] = [22, height - 26];
    this.#plate(12, height - 48, wide + 20, 36);
    context.fillStyle = this.panel.colour("ink");
    context.fillRect(left, top, wide, 2);
    for (const x of [left, left + wide - 1 / ratio]) context.fillRect(x, top - 4, Math.max(1, 1 / ratio), 10);
    context.font = this.panel.font(12, 600);
    context.textAlign = "center";
    context.textBaseline = "alphabetic";
    context.fillText(inWords(length, "m"), left + wide / 2, top - 6);
    this.drawn.bar = { length, pixels: wide, left, top };
  }

  #drawLegend() {
    const { context, width, height } = this.panel;
    const span = this.high - this.low;
    const words = `${inWords(span, "m")} high`;
    context.font = this.panel.font(12, 600);
    const wide = context.measureText(words).width;
    if (this.relief) return this.#drawWords(words, width - 12, wide);
    const left = width - 12 - wide - 44;
    this.#plate(left, height - 60, wide + 44, 48);
    const ramp = context.createLinearGradient(0, height - 18, 0, height - 54);
    ramp.addColorStop(0, this.panel.colour("valley"));
    ramp.addColorStop(1, this.panel.colour("crest"));
    context.fillStyle = ramp;
    context.fillRect(left + 10, height - 54, 14, 36);
    context.strokeStyle = this.panel.colour("muted");
    context.lineWidth = 1;
    context.strokeRect(left + 9.5, height - 54.5, 15, 37);
    context.fillStyle = this.panel.colour("ink");
    context.textAlign = "left";
    context.textBaseline = "middle";
    context.fillText(words, left + 34, height - 36);
  }

  /** Draws the legend of a relief, whose shades are those of slopes. */
  #drawWords(words, right, wide) {
    const { context, height } = this.panel;
    this.#plate(right - wide - 20, height - 36, wide + 20, 24);
    context.fillStyle = this.panel.colour("ink");
    context.textAlign = "right";
    context.textBaseline = "middle";
    context.fillText(words, right - 10, height - 24);
  }

  #plate(left, top, width, height) {
    const { context } = this.panel;
    context.fillStyle = this.panel.colour("plate");
    context.beginPath();
    context.roundRect(left, top, width, height, 6);
    context.fill();
  }

  #tell() {
    const across = this.#area ? ` along and ${inWords(this.#area.across, "m")} across` : "";
    const fine =
      this.period / this.metresPerPixel < FINEST ? " The ridges are too fine for this magnification; press plus." : "";
    this.panel.say(
      `Texture from above: period ${inWords(this.period, "m")}${across}, height from valley to crest ` +
        `${inWords(this.high - this.low, "m")}. ${inWords(this.panel.width * this.metresPerPixel, "m")} are shown.${fine}`,
    );
  }

  #zoomTo(metresPerPixel, byHand = true) {
    this.metresPerPixel = limited(metresPerPixel);
    this.panel.request();
    if (byHand)
      this.panel.canvas.dispatchEvent(new CustomEvent("zoom", { detail: { metresPerPixel: this.metresPerPixel } }));
  }

  #key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const closer = this.metresPerPixel / STEP;
    const wanted = { "+": closer, "=": closer, "-": this.metresPerPixel * STEP, 0: this.fitting() };
    if (!(event.key in wanted)) return;
    event.preventDefault();
    this.#zoomTo(wanted[event.key]);
  }

  #wheel(event) {
    event.preventDefault();
    const notches = event.deltaY / (event.deltaMode === WheelEvent.DOM_DELTA_PIXEL ? 100 : 3);
    this.#zoomTo(this.metresPerPixel * STEP ** Math.max(-4, Math.min(4, notches)));
  }
}

function limited(metresPerPixel) {
  return Math.min(FARTHEST, Math.max(NEAREST, metresPerPixel));
}

const probe = Object.assign(document.createElement("canvas"), { width: 1, height: 1 }).getContext("2d", {
  willReadFrequently: true,
});

function rgbOf(colour) {
  probe.fillStyle = colour;
  probe.fillRect(0, 0, 1, 1);
  return probe.getImageData(0, 0, 1, 1).data;
}
