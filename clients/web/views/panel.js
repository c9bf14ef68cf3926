/* A canvas that is drawn when something has changed.

Colours are CSS custom properties (views.css), so the page's style sheet decides about light and dark. A property that
is not set is the colour of the text. Lengths are CSS pixels; drawings have the resolution of the device.
Limits: a Panel lasts as long as its page. */

const SPEAK_EVERY = 500; // ms between changes of the text alternative
const CALM_EVERY = 250; // ms between drawings if the user prefers reduced motion
const calm = matchMedia("(prefers-reduced-motion: reduce)");

/** A canvas that is drawn on request, at most once per picture of the screen. */
export class Panel {
  #draw;
  #pace;
  #waiting = false;
  #last = -Infinity;
  #colours = new Map();
  #layer = null;
  #layerKey = null;
  #said = { text: "", time: -Infinity, timer: 0 };

  /** name: first text alternative. draw(panel): draws into `context`, in CSS px. pace: least time between drawings, ms.
   *  */
  constructor(canvas, name, draw, pace = 0) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.width = 0; // CSS px
    this.height = 0;
    this.ratio = 1; // device pixels per CSS px
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

  /** Requests a drawing with the next picture of the screen, or later if the last one was too recent. */
  request() {
    if (this.#waiting) return;
    this.#waiting = true;
    const pace = Math.max(this.#pace, this.#live && calm.matches ? CALM_EVERY : 0);
    const wait = this.#last + pace - performance.now();
    if (wait > 4) setTimeout(() => requestAnimationFrame(() => this.#frame()), wait);
    else requestAnimationFrame(() => this.#frame());
  }

  /** Reads the colours again and requests a drawing. */
  restyle() {
    this.#colours.clear();
    this.#layerKey = null;
    this.request();
  }

  /** Returns the colour of a custom property: "ink" for --ink. */
  colour(name) {
    if (!this.#colours.has(name)) {
      const style = getComputedStyle(this.canvas);
      this.#colours.set(name, style.getPropertyValue(`--${name}`).trim() || style.color);
    }
    return this.#colours.get(name);
  }

  /** Returns the font of the page in a size in CSS px. */
  font(size, weight = 400) {
    if (!this.#colours.has("font")) this.#colours.set("font", getComputedStyle(this.canvas).fontFamily);
    return `${weight} ${size}px ${this.#colours.get("font")}`;
  }

  /** Draws a cached layer. paint(panel) draws it again if `key`, size or colours have changed. */
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

  /** Sets the text alternative, at most every SPEAK_EVERY ms. The newest text is always set. */
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

  /** Marks the panel as animated: it is drawn less often if the user prefers reduced motion. */
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
    this.#last = performance.now();
    this.context.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    this.context.clearRect(0, 0, this.width, this.height);
    this.#draw(this);
    this.drawings++;
  }
}
