/* What all pictures share: numbers in words with SI prefixes, axes, colours of the page, and a canvas that is drawn
when something changed.

Colours come from CSS custom properties (sight.css names them), so dark and light are the page's affair; one that is not
set is the colour of the text. Lengths on the canvas are CSS pixels; the device's own pixels are used for sharpness.
Limits: a Panel lives as long as its page; numbers are shown to three digits. */

const PREFIXES = [
  [1e9, "G"],
  [1e6, "M"],
  [1e3, "k"],
  [1, ""],
  [1e-3, "m"],
  [1e-6, "µ"],
  [1e-9, "n"],
  [1e-12, "p"],
];
const SPEAK_EVERY = 500; // ms between two changes of a text alternative
const CALM_EVERY = 250; // ms between two drawings where less motion is asked for

/** What a sample may be: its SI unit, and how often displacement is differentiated to get it (null: it is none of it).
 *  */
export const QUANTITIES = {
  approach: { name: "approach", unit: "m", order: 0 },
  displacement: { name: "displacement", unit: "m", order: 0 },
  velocity: { name: "velocity", unit: "m/s", order: 1 },
  acceleration: { name: "acceleration", unit: "m/s²", order: 2 },
  tangential_force: { name: "tangential force", unit: "N", order: null },
};

/** Returns {factor, prefix} of the SI prefix for numbers about as large as `size`: 2e-5 -> 1e-6, "µ". */
export function prefixOf(size) {
  const large = Math.abs(size) * 1.0005;
  const [factor, prefix] = PREFIXES.find(([least]) => large >= least) ?? (size ? PREFIXES.at(-1) : [1, ""]);
  return { factor, prefix };
}

/** Returns a number of an SI unit as a person reads it: 0.0000203 m -> "20.3 µm". */
export function inWords(value, unit, digits = 3) {
  const { factor, prefix } = prefixOf(value);
  return `${Number((value / factor).toPrecision(digits))} ${prefix}${unit}`.trim().replace("-", "−");
}

/** Returns the largest of 1, 2, 5 times a power of ten that is not above `size`. */
export function roundBelow(size) {
  const power = 10 ** Math.floor(Math.log10(size) + 1e-12);
  return power * [5, 2, 1].find((step) => step * power <= size * (1 + 1e-9));
}

/** Returns an axis {place(value) -> px, low, high, ticks: [{value, label}], unit} with round steps; `most` ticks at
 *  most. */
export function linearAxis(low, high, from, to, unit, most = 5) {
  const step = roundAbove((high - low) / most);
  const { factor, prefix } = prefixOf(Math.max(Math.abs(low), Math.abs(high)));
  const ticks = [];
  for (let index = Math.ceil(low / step - 1e-9); index * step <= high + 1e-9 * step; index++) {
    const label = String(Number(((index * step) / factor).toPrecision(6))).replace("-", "−");
    ticks.push({ value: index * step, label, main: index === 0 });
  }
  return {
    low,
    high,
    ticks,
    unit: prefix + unit,
    place: (value) => from + ((value - low) / (high - low)) * (to - from),
  };
}

/** Returns a logarithmic axis as `linearAxis` does; ticks at 1 to 9 of each decade, labels at decades `apart` px apart.
 *  */
export function logAxis(low, high, from, to, unit, apart = 18) {
  const decades = Math.log10(high / low);
  const every = Math.max(1, Math.ceil(apart / (Math.abs(to - from) / decades)));
  const ticks = [];
  for (let power = Math.floor(Math.log10(low) + 1e-9); power <= Math.log10(high) + 1e-9; power++) {
    for (let digit = 1; digit < 10; digit++) {
      const value = digit * 10 ** power;
      if (value < low * (1 - 1e-9) || value > high * (1 + 1e-9)) continue;
      const told = digit === 1 && power % every === 0;
      if (digit === 1 || decades <= 4)
        ticks.push({ value, label: told ? inWords(value, unit) : "", main: digit === 1 });
    }
  }
  return {
    low,
    high,
    ticks,
    unit,
    place: (value) => from + (Math.log(value / low) / Math.log(high / low)) * (to - from),
  };
}

/** Returns the smallest of 1, 2, 5 times a power of ten that is not below `size`. */
export function roundAbove(size) {
  const power = 10 ** Math.floor(Math.log10(size) + 1e-12);
  return power * [1, 2, 5, 10].find((step) => step * power >= size * (1 - 1e-9));
}

/** A canvas that draws itself on request, at most once a frame. `draw(panel)` is called with `context` set up in CSS
 *  px. */
export class Panel {
  #draw;
  #pace;
  #waiting = false;
  #last = -Infinity;
  #colours = new Map();
  #layer = null;
  #layerKey = null;
  #said = { text: "", time: -Infinity, timer: 0 };

  /** name: its text alternative until `say` says more; pace: ms between two drawings, at least. */
  constructor(canvas, name, draw, pace = 0) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.width = 0; // CSS px
    this.height = 0;
    this.ratio = 1; // device pixels in a CSS px
    this.milliseconds = 0; // that the last drawing took
    this.drawings = 0;
    this.#draw = draw;
    this.#pace = pace;
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", name);
    new ResizeObserver(() => this.#measure()).observe(canvas);
    for (const query of ["(prefers-color-scheme: dark)", "(prefers-contrast: more)"]) {
      matchMedia(query).addEventListener("change", () => this.restyle());
    }
  }

  /** Draws in the next frame, or later where the last drawing is too recent. */
  request() {
    if (this.#waiting) return;
    this.#waiting = true;
    const pace = Math.max(this.#pace, this.#live && calm.matches ? CALM_EVERY : 0);
    const wait = this.#last + pace - performance.now();
    if (wait > 4) setTimeout(() => requestAnimationFrame(() => this.#frame()), wait);
    else requestAnimationFrame(() => this.#frame());
  }

  /** Reads the colours anew and draws. */
  restyle() {
    this.#colours.clear();
    this.#layerKey = null;
    this.request();
  }

  /** Returns the CSS colour of a custom property, "ink" for --ink. */
  colour(name) {
    if (!this.#colours.has(name)) {
      const style = getComputedStyle(this.canvas);
      this.#colours.set(name, style.getPropertyValue(`--${name}`).trim() || style.color);
    }
    return this.#colours.get(name);
  }

  /** Returns the font of the page at a size in CSS px. */
  font(size, weight = 400) {
    if (!this.#colours.has("font")) this.#colours.set("font", getComputedStyle(this.canvas).fontFamily);
    return `${weight} ${size}px ${this.#colours.get("font")}`;
  }

  /** Draws what `paint` draws; it is called only where `key`, the size or the colours have changed. */
  layer(key, paint) {
    const full = `${key}|${this.canvas.width}|${this.canvas.height}`;
    if (this.#layerKey !== full) {
      this.#layer ??= document.createElement("canvas");
      this.#layer.width = this.canvas.width;
      this.#layer.height = this.canvas.height;
      const own = this.context;
      this.context = this.#layer.getContext("2d");
      this.context.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
      paint(this);
      this.context = own;
      this.#layerKey = full;
    }
    this.context.drawImage(this.#layer, 0, 0, this.width, this.height);
  }

  /** Sets the text alternative, not more often than people can hear it; the newest text comes through. */
  say(text) {
    const said = this.#said;
    said.text = text;
    if (said.timer) return;
    said.timer = setTimeout(
      () => {
        said.timer = 0;
        said.time = performance.now();
        if (this.canvas.getAttribute("aria-label") !== said.text) this.canvas.setAttribute("aria-label", said.text);
      },
      Math.max(0, said.time + SPEAK_EVERY - performance.now()),
    );
  }

  /** Marks the panel as one that moves by itself, which is drawn less often where less motion is asked for. */
  moving() {
    this.#live = true;
    return this;
  }

  #live = false;

  #measure() {
    const ratio = devicePixelRatio || 1;
    const { clientWidth, clientHeight } = this.canvas;
    if (clientWidth === this.width && clientHeight === this.height && ratio === this.ratio) return;
    [this.width, this.height, this.ratio] = [clientWidth, clientHeight, ratio];
    this.canvas.width = Math.round(clientWidth * ratio);
    this.canvas.height = Math.round(clientHeight * ratio);
    this.restyle();
  }

  #frame() {
    this.#waiting = false;
    if (devicePixelRatio !== this.ratio) this.#measure();
    if (!this.width || !this.height) return;
    const begin = performance.now();
    this.#last = begin;
    this.context.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    this.context.clearRect(0, 0, this.width, this.height);
    this.#draw(this);
    this.drawings++;
    this.milliseconds = performance.now() - begin;
  }
}

const calm = matchMedia("(prefers-reduced-motion: reduce)");

/** Draws the grid, ticks and labels of two axes in `box` {left, top, right, bottom} (CSS px), and their titles. */
export function drawAxes(panel, box, across, up, { acrossTitle = "", upTitle = "" } = {}) {
  const { context } = panel;
  context.lineWidth = 1;
  context.font = panel.font(11);
  for (const [axis, vertical] of [
    [across, true],
    [up, false],
  ]) {
    context.textAlign = vertical ? "center" : "right";
    context.textBaseline = vertical ? "top" : "middle";
    for (const { value, label, main } of axis.ticks) {
      const place = Math.round(axis.place(value)) + 0.5;
      context.strokeStyle = panel.colour(main ? "line" : "line-faint");
      context.beginPath();
      context.moveTo(vertical ? place : box.left, vertical ? box.top : place);
      context.lineTo(vertical ? place : box.right, vertical ? box.bottom : place);
      context.stroke();
      if (!label) continue;
      context.fillStyle = panel.colour("muted");
      const half = context.measureText(label).width / 2;
      if (vertical) context.fillText(label, Math.min(place, panel.width - half - 1), box.bottom + 6);
      else context.fillText(label, box.left - 7, Math.max(place, 7));
    }
  }
  context.fillStyle = panel.colour("muted");
  context.textBaseline = "alphabetic";
  context.textAlign = "right";
  context.fillText(acrossTitle, box.right, panel.height - 4);
  context.textAlign = "left";
  context.font = panel.font(12, 600);
  context.fillStyle = panel.colour("ink");
  context.fillText(upTitle, 2, 13);
}
