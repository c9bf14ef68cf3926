/* The strip under the pad: texture and finger in section, at the places and the scale of the pad.

Model: the section lies along x through the middle of the first finger. A CSS pixel is as long as one of the pad, and heights
are magnified so that they fill the strip. Patches in which both touch are those of the picture (contact_side_view.js).
Limits: over an area the section is that of y = 0. The skin between patches is not simulated. */

import { inWords } from "../scene/quantities.js";
import { Panel } from "../views/panel.js";

const [TOP, BOTTOM] = [14, 12]; // CSS px kept free
const RISE = 0.55; // part of the height that the texture may take

export class ContactStrip {
  #picture = null;
  #touch = null; // {position (m), phase, z (m), patches: [[begin, end]] (m), middle (m)}

  /** surface: the TextureTopView, whose scale the strip has. */
  constructor(canvas, surface) {
    this.surface = surface;
    this.panel = new Panel(canvas, "Section of the texture: not loaded yet.", () => this.#draw()).moving();
    /** The last drawing: {factor, lit: [[left, right]] (CSS px)}. */
    this.drawn = null;
  }

  /** Shows `picture`, an answer of `POST /v1/picture`. */
  show(picture) {
    this.#picture = picture;
    this.low = Math.min(...picture.texture.heights);
    this.high = Math.max(...picture.texture.heights);
    this.panel.request();
  }

  /** Moves the finger; null: none touches. */
  touch(touch) {
    this.#touch = touch;
    if (this.#picture) this.panel.request();
  }

  /** Draws again, at the scale of the pad. */
  scale() {
    this.panel.request();
  }

  #draw() {
    if (!this.#picture) return;
    const { panel, surface } = this;
    const across = 1 / surface.metresPerPixel; // CSS px per metre
    const span = Math.max(this.high - this.low, 1e-9);
    const up = (RISE * (panel.height - TOP - BOTTOM)) / span; // CSS px per metre
    const y = (height) => panel.height - BOTTOM - (height - this.low) * up;
    const count = Math.ceil(panel.width * Math.min(panel.ratio, 2));
    const xs = Float64Array.from({ length: count + 1 }, (_, index) => (index / count) * panel.width);
    const heights = xs.map((x) => surface.heightBetween((x - 0.5) / across, (x + 0.5) / across));
    this.#fill(xs, heights.map(y), panel.height, "texture", "texture-edge");
    const lit = this.#touch ? this.#drawFinger(across, y) : [];
    this.drawn = { factor: up / across, lit };
    this.#words(up / across);
  }

  #drawFinger(across, y) {
    const { finger } = this.#picture;
    const { position, z, patches, middle } = this.#touch;
    const from = (x) => (position + x - middle) * across; // place of x of the finger, CSS px
    const xs = Float64Array.from(finger.heights, (_, index) =>
      from(finger.begin + (index / (finger.heights.length - 1)) * finger.length),
    );
    const under = Float64Array.from(finger.heights, (height) => y(z - height));
    const texture = xs.map((x) => y(this.surface.heightBetween((x - 0.5) / across, (x + 0.5) / across)));
    const skin = under.map((height, index) => Math.min(height, texture[index]));
    this.#fill(xs, skin, 0, "finger", "finger-edge", true);
    const lit = patches.map(([begin, end]) => [from(begin), from(end)]);
    const { context } = this.panel;
    context.save();
    context.beginPath();
    for (const [left, right] of lit) context.rect(left, 0, Math.max(1, right - left), this.panel.height);
    context.clip();
    context.beginPath();
    for (const [index, x] of xs.entries()) context.lineTo(x, skin[index]);
    context.strokeStyle = this.panel.colour("glow");
    context.lineWidth = 4;
    context.stroke();
    context.restore();
    return lit;
  }

  /** Fills between a line and `edge`; round: with the outline of a fingertip. */
  #fill(xs, ys, edge, colour, line, round = false) {
    const { context } = this.panel;
    context.beginPath();
    for (const [index, x] of xs.entries()) context.lineTo(x, ys[index]);
    context.strokeStyle = this.panel.colour(line);
    context.lineWidth = 1.2;
    context.stroke();
    const [left, right] = [xs[0], xs.at(-1)];
    const bulge = round ? 0.1 * (right - left) : 0;
    context.quadraticCurveTo(right + bulge, ys.at(-1) - bulge, right + bulge, edge);
    context.lineTo(left - bulge, edge);
    context.quadraticCurveTo(left - bulge, ys[0] - bulge, left, ys[0]);
    context.fillStyle = this.panel.colour(colour);
    context.fill();
  }

  #words(factor) {
    const { context } = this.panel;
    const times = Number(factor.toPrecision(2));
    context.font = this.panel.font(11);
    context.textAlign = "right";
    context.textBaseline = "top";
    const words = `section · heights × ${times}`;
    const wide = context.measureText(words).width;
    context.fillStyle = this.panel.colour("plate"); // a finger may be under it
    context.fillRect(this.panel.width - wide - 14, 0, wide + 14, 18);
    context.fillStyle = this.panel.colour("muted");
    context.fillText(words, this.panel.width - 8, 4);
    const touched = this.#touch
      ? `${this.#touch.patches.length} contact patches at ${inWords(this.#picture.response.load, "N")}`
      : "no finger touches";
    this.panel.say(`Section of the texture under the pad: ${touched}. Heights are magnified ${times} times.`);
  }
}
