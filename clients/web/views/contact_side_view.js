/* The contact from the side: finger and texture, with the contact patches highlighted.

Model: that of `POST /v1/picture`. The texture is moved by p = phase times period. The underside of the undeformed
finger is at z - finger. Where both overlap, the skin follows the texture: these patches are highlighted, and a dashed
line shows the undeformed skin. Heights are magnified more than lengths, by the factor in the picture.
Limits: the skin between patches is not simulated and is drawn undeformed. z is interpolated between the phases of the
picture, unless they are closer than half a CSS pixel. */

import { inWords } from "../scene/quantities.js";
import { roundBelow } from "./axes.js";
import { Panel } from "./panel.js";

const FACTORS = [8, 6, 5, 4, 3, 2, 1.5, 1];
const BODY = 16; // CSS px of finger above its valleys and of texture below its valleys
const MOST_ZOOM = 16;

/** The keys + and - zoom about the middle of the contact. */
export class ContactSideView {
  #picture = null;
  #phase = 0;
  #zoom = 1;

  constructor(canvas) {
    this.panel = new Panel(canvas, "Contact: not loaded yet.", () => this.#draw()).moving();
    /** The last drawing: {phase, z (m), patches: [[begin, end]] (m), lit: [[left, right]] (CSS px), factor}. */
    this.drawn = null;
    canvas.tabIndex = 0;
    canvas.setAttribute("aria-keyshortcuts", "+ -");
    canvas.addEventListener("keydown", (event) => this.#key(event));
  }

  /** Shows `picture`, an answer of `POST /v1/picture` with phases. */
  show(picture) {
    this.#picture = picture;
    const [texture, finger] = [extent(picture.texture.heights), extent(picture.finger.heights)];
    const z = extent(picture.response.heights);
    this.low = Math.min(texture.low, z.low - finger.high);
    this.high = Math.max(texture.high, z.high - finger.low);
    this.panel.request();
  }

  /** Moves the texture to a phase: position / period. */
  at(phase) {
    const moved = Math.abs(phase - this.#phase) * (this.#picture?.texture.period ?? 0);
    if (this.drawn && moved * this.drawn.across < 0.25) return;
    this.#phase = phase;
    if (this.#picture) this.panel.request();
  }

  /** Returns {phase, z (m), patches: [[begin, end]] (m)} at a phase. */
  touching(phase, pixelsPerMetre = Infinity) {
    const { texture, response, touching } = this.#picture;
    const count = response.heights.length;
    const inside = phase - Math.floor(phase);
    const nearest = Math.round(inside * count) % count;
    const apart = (texture.period / count) * pixelsPerMetre;
    const off = Math.abs(inside * count - Math.round(inside * count));
    if (touching && (off < 1e-6 || apart <= 0.5)) {
      const edges = touching[nearest];
      const patches = Array.from({ length: edges.length / 2 }, (_, index) => [edges[2 * index], edges[2 * index + 1]]);
      return { phase: nearest / count, z: response.heights[nearest], patches };
    }
    const z = along(response.heights, inside * count);
    return { phase: inside, z, patches: this.#patches(inside, z) };
  }

  #patches(phase, z) {
    const { finger } = this.#picture;
    const count = finger.heights.length;
    const step = finger.length / (count - 1);
    const patches = [];
    let open = null;
    let before = 0;
    for (let index = 0; index < count; index++) {
      const x = finger.begin + index * step;
      const overlap = this.#texture(x, phase) + finger.heights[index] - z;
      const edge = index ? x - step * (overlap / (overlap - before)) : x;
      if (overlap > 0 && open === null) open = edge;
      if (overlap <= 0 && open !== null) {
        patches.push([open, edge]);
        open = null;
      }
      before = overlap;
    }
    if (open !== null) patches.push([open, finger.begin + finger.length]);
    return patches;
  }

  #texture(x, phase) {
    const { heights, period } = this.#picture.texture;
    return along(heights, (x / period - phase) * heights.length);
  }

  #finger(x) {
    const { heights, begin, length } = this.#picture.finger;
    const place = Math.min(heights.length - 1, Math.max(0, ((x - begin) / length) * (heights.length - 1)));
    const index = Math.min(Math.floor(place), heights.length - 2);
    return heights[index] + (place - index) * (heights[index + 1] - heights[index]);
  }

  #draw() {
    if (!this.#picture) return;
    const { width, height, ratio, context } = this.panel;
    const { begin, length } = this.#picture.finger;
    const box = { left: 12, right: width - 12, top: 30, bottom: height - 44 };
    const shown = length / this.#zoom;
    const from = begin + (length - shown) / 2;
    const across = (box.right - box.left) / shown; // CSS px per metre
    const factor = factorBelow((box.bottom - box.top - 2 * BODY) / Math.max(this.high - this.low, 1e-9) / across);
    const up = across * factor;
    const middle = (box.top + box.bottom) / 2;
    const place = {
      x: (x) => box.left + (x - from) * across,
      y: (z) => middle - (z - (this.low + this.high) / 2) * up,
    };
    const { phase, z, patches } = this.touching(this.#phase, across);
    const count = Math.ceil((box.right - box.left) * Math.min(ratio, 2));
    const xs = Float64Array.from({ length: count + 1 }, (_, index) => from + (shown * index) / count);
    const texture = xs.map((x) => this.#texture(x, phase));
    const finger = xs.map((x) => z - this.#finger(x));
    context.save();
    context.beginPath();
    context.roundRect(box.left, box.top, box.right - box.left, box.bottom - box.top, 6);
    context.clip();
    const skin = finger.map((height, index) => Math.max(height, texture[index]));
    this.#fill(xs, texture, place, box.bottom, "texture", "texture-edge");
    this.#fill(xs, skin, place, box.top, "finger", "finger-edge");
    const lit = this.#light(xs, texture, finger, patches, place);
    context.restore();
    this.drawn = { phase, z, patches, lit, factor, across, up };
    this.#strip(lit, box);
    this.#words(box, patches);
  }

  #fill(xs, heights, place, edge, colour, line) {
    const { context } = this.panel;
    context.beginPath();
    for (const [index, height] of heights.entries()) context.lineTo(place.x(xs[index]), place.y(height));
    context.strokeStyle = this.panel.colour(line);
    context.lineWidth = 1.2;
    context.stroke();
    context.lineTo(place.x(xs.at(-1)), edge);
    context.lineTo(place.x(xs[0]), edge);
    context.fillStyle = this.panel.colour(colour);
    context.fill();
  }

  #light(xs, texture, finger, patches, place) {
    const { context } = this.panel;
    const lit = patches.map(([begin, end]) => [place.x(begin), place.x(end)]);
    context.save();
    context.beginPath();
    for (const [left, right] of lit) context.rect(left, 0, right - left, this.panel.height);
    context.clip();
    context.beginPath();
    for (const [index, height] of texture.entries()) context.lineTo(place.x(xs[index]), place.y(height));
    context.strokeStyle = this.panel.colour("glow");
    context.lineWidth = 4;
    context.stroke();
    context.beginPath();
    for (const [index, height] of finger.entries()) context.lineTo(place.x(xs[index]), place.y(height));
    context.lineWidth = 1;
    context.setLineDash([2, 2]);
    context.stroke();
    context.restore();
    return lit;
  }

  #strip(lit, box) {
    const { context } = this.panel;
    context.fillStyle = this.panel.colour("line-faint");
    context.fillRect(box.left, box.bottom + 6, box.right - box.left, 6);
    context.fillStyle = this.panel.colour("glow");
    for (const [left, right] of lit) {
      const [first, last] = [Math.max(left, box.left), Math.min(right, box.right)];
      if (last > first) context.fillRect(first, box.bottom + 6, Math.max(last - first, 1 / this.panel.ratio), 6);
    }
  }

  #words(box, patches) {
    const { context, height } = this.panel;
    const { response, finger } = this.#picture;
    const share = patches.reduce((sum, [begin, end]) => sum + end - begin, 0) / finger.length;
    const touched =
      `${patches.length} contact ${patches.length === 1 ? "patch" : "patches"}, ` +
      `${inWords(100 * share, "%", 2)} of ${inWords(finger.length, "m")}`;
    const { factor, across, up } = this.drawn;
    context.textBaseline = "alphabetic";
    context.textAlign = "left";
    context.font = this.panel.font(12, 600);
    context.fillStyle = this.panel.colour("ink");
    context.fillText(`Contact at ${inWords(response.load, "N")}`, 2, 13);
    context.font = this.panel.font(11);
    context.fillStyle = this.panel.colour("muted");
    context.fillText(touched, box.left, height - 12);
    context.textAlign = "right";
    const length = roundBelow(80 / across);
    const tall = roundBelow(30 / up);
    const words = `heights × ${factor}`;
    context.fillText(`${inWords(tall, "m")}`, box.right - 10, 13);
    context.fillText(words, box.right - 10 - context.measureText(inWords(tall, "m")).width - 14, 13);
    context.fillStyle = this.panel.colour("ink");
    context.fillRect(box.right - 4, 2, 2, tall * up);
    context.fillRect(box.right - length * across, height - 14, length * across, 2);
    context.fillStyle = this.panel.colour("muted");
    context.fillText(inWords(length, "m"), box.right - length * across - 6, height - 10);
    this.panel.say(
      `Contact from the side at ${inWords(response.load, "N")}: ${touched}. ` +
        `Heights are magnified ${factor} times more than lengths.`,
    );
  }

  #key(event) {
    const by = { "+": 2, "=": 2, "-": 0.5 }[event.key];
    if (!by || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    this.#zoom = Math.min(MOST_ZOOM, Math.max(1, this.#zoom * by));
    this.panel.request();
  }
}

/** Returns the value at an index with a fraction of periodic `values`, interpolated linearly. */
function along(values, place) {
  const count = values.length;
  const index = Math.floor(place);
  const [first, next] = [values[((index % count) + count) % count], values[(((index + 1) % count) + count) % count]];
  return first + (place - index) * (next - first);
}

function extent(values) {
  let [low, high] = [Infinity, -Infinity];
  for (const value of values) {
    low = Math.min(low, value);
    high = Math.max(high, value);
  }
  return { low, high };
}

function factorBelow(factor) {
  const power = 10 ** Math.floor(Math.log10(factor));
  return Number((power * (FACTORS.find((one) => one * power <= factor * (1 + 1e-9)) ?? 1)).toPrecision(2));
}
