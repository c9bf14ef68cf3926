/* The lit relief of a texture, WebGL 2: the surface under one light that drifts across once, with fingers on it.

Model: the shaders are in shaders.js, the heights in height_levels.js. The left edge is position 0, the middle y = 0. z of a
finger comes from the picture of the scene; its place is the middle of the finger.
Limits: z is that of the line through the middle of the finger, also over an area. Without WebGL 2 there is no relief. */

import { heightLevels } from "./height_levels.js";
import { FRAGMENT, MOST_FINGERS, VERTEX } from "./shaders.js";

const [LEVEL, COMPRESSION] = [0.6, 0.3]; // of slopes, as in synth/surfaces/lit_picture.py
const [FROM, TO] = [
  [2.1, 0.7, 0.45],
  [0.2, 1.3, 0.85],
]; // places of the light before and after its drift, parts of the height of the pad
const DRIFT = 4500; // ms
const [SLOW, FEWEST] = [45, 8]; // ms between pictures of the screen, over so many, with which a relief becomes coarser
const MEASURED = 12; // pictures, at least, by which the pace is known
const COARSE = 0.5; // of the resolution of the device, where its drawing is slow
const calm = matchMedia("(prefers-reduced-motion: reduce)");

export class Relief {
  #gl;
  #program;
  #places = new Map();
  #light = TO;
  #began = null; // ms, of the drift
  #shape = null;
  #waiting = false;
  #fineness = 1; // of the resolution of the device
  #paces = []; // ms between drawings that follow each other
  #last = 0; // ms, time of the last drawing
  #fingers = [];
  /** Number of drawings. */
  drawings = 0;

  /** Returns the relief on `canvas`, a canvas without a context; null where the browser cannot draw it. */
  static on(canvas) {
    const gl = canvas.getContext("webgl2", { antialias: false, alpha: false, powerPreference: "low-power" });
    if (!gl) return null;
    try {
      return new Relief(canvas, gl);
    } catch (error) {
      console.warn("No relief:", error);
      return null;
    }
  }

  /** gl: the WebGL 2 context of `canvas`. onLost(): set by the owner, called when the browser takes the context away. */
  constructor(canvas, gl) {
    Object.assign(this, { canvas, onLost: () => {}, inset: null });
    this.#gl = gl;
    this.#program = programOf(gl);
    gl.useProgram(this.#program);
    canvas.addEventListener("webglcontextlost", () => this.onLost());
  }

  /** Shows a texture; arguments as those of `heightLevels`. The light drifts across with the first one. */
  show(texture) {
    const { levels, low, high, slope } = heightLevels(texture);
    this.#upload(0, levels, this.#gl.RGBA16F, this.#gl.RGBA);
    const gain = slope > 0 ? (LEVEL / slope) * (slope / LEVEL) ** COMPRESSION : 1;
    this.#shape = { low, span: high - low, gain, period: [texture.period, texture.across ?? 1] };
    if (this.#began === null) this.#drift();
  }

  /** Shows the finger of a picture: {begin, length, heights} (m). width: m. */
  touchWith({ begin, length, heights }, width) {
    const line = { width: heights.length, height: 1, texels: Float32Array.from(heights) };
    this.#upload(1, [line], this.#gl.R32F, this.#gl.RED);
    this.#shape.footprint = [begin, length, width, begin + length / 2];
  }

  /** Moves the fingers. fingers: {position, y (m), z (m; null: unknown), size (of the footprint)}. */
  touch(fingers) {
    this.#fingers = fingers.slice(0, MOST_FINGERS);
    this.request();
  }

  /** Sets what is drawn: {width, height: CSS px, ratio, metresPerPixel, colours: {material, ground, glow, flesh}: rgb 0
   *  to 1, inset: {left, bottom, width, height (CSS px), metresPerPixel}, or null}. */
  set view(view) {
    this.drawn = view;
    this.#fit();
    this.#draw();
  }

  #fit() {
    const { width, height } = this.drawn;
    const [wide, high] = [width, height].map((length) => Math.round(length * this.#ratio));
    if (this.canvas.width !== wide) this.canvas.width = wide;
    if (this.canvas.height !== high) this.canvas.height = high;
  }

  /** Pixels of the canvas per CSS px. */
  get #ratio() {
    return this.drawn.ratio * this.#fineness;
  }

  /** Halves the resolution where drawings that follow each other are slow: the hand and its sound come first. */
  #pace() {
    const now = performance.now();
    const pace = now - this.#last;
    this.#last = now;
    if (this.#fineness < 1 || !this.drawn) return;
    this.#paces = [...this.#paces, pace].slice(-FEWEST);
    if (this.#paces.length < FEWEST || this.#paces.some((one) => one < SLOW)) return;
    this.#fineness = COARSE;
    this.#fit();
  }

  /** Draws with the next picture of the screen. */
  request() {
    if (this.#waiting) return;
    this.#waiting = true;
    requestAnimationFrame(() => {
      this.#waiting = false;
      this.#draw();
    });
  }

  #drift() {
    this.#began = this.#last = performance.now();
    let pictures = 0;
    const step = () => {
      const part = calm.matches ? 1 : Math.min(1, (performance.now() - this.#began) / DRIFT);
      const eased = part * part * (3 - 2 * part);
      this.#light = FROM.map((from, axis) => from + eased * (TO[axis] - from));
      this.#pace();
      this.#draw();
      if (part < 1 || ++pictures < MEASURED) requestAnimationFrame(step);
    };
    step();
  }

  #draw() {
    const { drawn: view } = this;
    if (!view?.width || !this.#shape) return;
    const { width, height, metresPerPixel, inset } = view;
    const ratio = this.#ratio;
    this.#set(view.colours);
    this.#quad([0, 0, width, height], metresPerPixel, ratio, this.#fingers);
    if (inset) this.#quad([inset.left, inset.bottom, inset.width, inset.height], inset.metresPerPixel, ratio, []);
    this.drawings++;
  }

  #set(colours) {
    const gl = this.#gl;
    const { low, span, gain, period, footprint } = this.#shape;
    gl.uniform1i(this.#place("heights"), 0);
    gl.uniform1i(this.#place("skin"), 1);
    gl.uniform1f(this.#place("low"), low);
    gl.uniform1f(this.#place("span"), span);
    gl.uniform1f(this.#place("gain"), gain);
    gl.uniform2fv(this.#place("period"), period);
    gl.uniform3fv(this.#place("light"), this.#light);
    if (footprint) gl.uniform4fv(this.#place("footprint"), footprint);
    for (const [name, rgb] of Object.entries(colours)) gl.uniform3fv(this.#place(name), rgb);
  }

  #quad(box, metresPerPixel, ratio, fingers) {
    const gl = this.#gl;
    const [left, bottom, width, height] = box.map((length) => Math.round(length * ratio));
    gl.viewport(left, bottom, width, height);
    gl.uniform2f(this.#place("origin"), left, bottom);
    gl.uniform2f(this.#place("size"), width, height);
    gl.uniform1f(this.#place("scale"), metresPerPixel / ratio);
    const shown = this.#shape.footprint ? fingers : [];
    gl.uniform1i(this.#place("count"), shown.length);
    gl.uniform1i(this.#place("touching"), Number(shown.every(({ z }) => z !== null)));
    const flat = shown.flatMap(({ position, y, z, size }) => [position, y, z ?? 0, size]);
    if (shown.length) gl.uniform4fv(this.#place("fingers"), flat);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  #upload(unit, levels, format, parts) {
    const gl = this.#gl;
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.deleteTexture(gl.getParameter(gl.TEXTURE_BINDING_2D));
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    for (const [level, { width, height, texels }] of levels.entries())
      gl.texImage2D(gl.TEXTURE_2D, level, format, width, height, 0, parts, gl.FLOAT, texels);
    const [small, large] = unit ? [gl.NEAREST, gl.NEAREST] : [gl.LINEAR_MIPMAP_LINEAR, gl.LINEAR];
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, small); // a float of 32 bits has no filter everywhere
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, large);
    const wrap = unit ? gl.CLAMP_TO_EDGE : gl.REPEAT;
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, wrap);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, wrap);
  }

  #place(name) {
    if (!this.#places.has(name)) this.#places.set(name, this.#gl.getUniformLocation(this.#program, name));
    return this.#places.get(name);
  }
}

/** Returns the program of the shaders. Throws an Error with the log of the compiler. */
function programOf(gl) {
  const program = gl.createProgram();
  for (const [kind, source] of [
    [gl.VERTEX_SHADER, VERTEX],
    [gl.FRAGMENT_SHADER, FRAGMENT],
  ]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader) ?? "lost");
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program) ?? "lost");
  return program;
}
