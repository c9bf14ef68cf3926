/* A drawing context that writes SVG: the part of CanvasRenderingContext2D that plots use.

Limits: no transforms; a clip is a rectangle; arcs are whole circles. Text is measured in the browser's own fonts. */

const PLACES = 3; // decimal places of a coordinate, CSS px
const KEPT = ["fillStyle", "strokeStyle", "lineWidth", "font", "textAlign", "textBaseline", "lineJoin"];
const ANCHORS = { left: "start", center: "middle", right: "end" };
const SHIFTS = { middle: 0.35, top: 0.8, alphabetic: 0 }; // of the font size: from the baseline of canvas to that of SVG

export class SvgContext {
  fillStyle = "#000";
  strokeStyle = "#000";
  lineWidth = 1;
  font = "10px sans-serif";
  textAlign = "left";
  textBaseline = "alphabetic";
  lineJoin = "miter";
  imageSmoothingEnabled = true;
  #parts = [];
  #path = "";
  #dash = [];
  #clip = "";
  #saved = [];
  #clips = 0;
  #pen = document.createElement("canvas").getContext("2d");

  beginPath() {
    this.#path = "";
  }

  moveTo(x, y) {
    this.#path += `M${shown(x)} ${shown(y)}`;
  }

  lineTo(x, y) {
    this.#path += `${this.#path ? "L" : "M"}${shown(x)} ${shown(y)}`;
  }

  rect(x, y, width, height) {
    this.#path += `M${shown(x)} ${shown(y)}h${shown(width)}v${shown(height)}h${shown(-width)}z`;
  }

  arc(x, y, radius) {
    const wide = shown(2 * radius);
    this.#path += `M${shown(x - radius)} ${shown(y)}a${radius} ${radius} 0 1 0 ${wide} 0a${radius} ${radius} 0 1 0 -${wide} 0`;
  }

  stroke() {
    if (!this.#path) return;
    const dash = this.#dash.length ? ` stroke-dasharray="${this.#dash.join()}"` : "";
    const look = `fill="none" stroke="${this.strokeStyle}" stroke-width="${this.lineWidth}" stroke-linejoin="${this.lineJoin}"`;
    this.#add(`<path d="${this.#path}" ${look}${dash}${this.#clip}/>`);
  }

  fill() {
    this.#add(`<path d="${this.#path}" fill="${this.fillStyle}"${this.#clip}/>`);
  }

  fillRect(x, y, width, height) {
    const box = `x="${shown(x)}" y="${shown(y)}" width="${shown(width)}" height="${shown(height)}"`;
    this.#add(`<rect ${box} fill="${this.fillStyle}"${this.#clip}/>`);
  }

  fillText(text, x, y) {
    const size = Number(/([\d.]+)px/.exec(this.font)[1]);
    const place = `x="${shown(x)}" y="${shown(y + size * SHIFTS[this.textBaseline])}"`;
    const look = `fill="${this.fillStyle}" text-anchor="${ANCHORS[this.textAlign]}" style="font:${escaped(this.font)}"`;
    this.#add(`<text ${place} ${look}${this.#clip}>${escaped(text)}</text>`);
  }

  measureText(text) {
    this.#pen.font = this.font;
    return this.#pen.measureText(text);
  }

  drawImage(picture, x, y, width, height) {
    const box = `x="${shown(x)}" y="${shown(y)}" width="${shown(width)}" height="${shown(height)}"`;
    const look = 'preserveAspectRatio="none" style="image-rendering:pixelated"';
    this.#add(`<image ${box} ${look}${this.#clip} href="${picture.toDataURL()}"/>`);
  }

  setLineDash(dash) {
    this.#dash = dash;
  }

  clip() {
    this.#clips += 1;
    const name = `clip${this.#clips}`;
    this.#add(`<clipPath id="${name}"><path d="${this.#path}"/></clipPath>`);
    this.#clip = ` clip-path="url(#${name})"`;
  }

  save() {
    this.#saved.push([this.#clip, this.#dash, KEPT.map((name) => this[name])]);
  }

  restore() {
    const [clip, dash, values] = this.#saved.pop();
    [this.#clip, this.#dash] = [clip, dash];
    for (const [index, name] of KEPT.entries()) this[name] = values[index];
  }

  /** Returns the SVG of what was drawn. width, height: CSS px. header: JSON value, kept as metadata. */
  document(width, height, header) {
    const size = `width="${width}" height="${height}" viewBox="0 0 ${width} ${height}"`;
    const metadata = `<metadata>${escaped(JSON.stringify(header))}</metadata>`;
    return `<svg xmlns="http://www.w3.org/2000/svg" ${size}>${metadata}${this.#parts.join("\n")}</svg>\n`;
  }

  #add(part) {
    this.#parts.push(part);
  }
}

const shown = (value) => Number(value.toFixed(PLACES));

/** Returns `text` as the content of an element or of an attribute. */
export function escaped(text) {
  return text.replaceAll("&", "&amp;").replaceAll("<", "&lt;").replaceAll('"', "&quot;");
}
