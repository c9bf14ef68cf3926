/* A plot as a file: SVG, PNG or CSV, with its header (file_header.js).

Model: SVG and PNG have the size of the plot on the page and lines with hash and error below; SVG keeps the header as
`metadata`, PNG as the text "ridgewave". The metadata of SVG also has `axes`, with which a path is read back. CSV has
the header in lines that begin with "#", one line with the names of the columns, and the numbers of the part that is
shown. */

import { save } from "../page/download.js";
import { captionOf, headerOf } from "./file_header.js";
import { withText } from "./png_text.js";
import { drawPlot } from "./plot_drawing.js";
import { SvgContext } from "./svg_context.js";

const [CAPTION, LINE] = [20, 13]; // CSS px: of the first line below the plot, and of each further one
const PIXELS = 2; // of a PNG per CSS px
const FORMATS = { svg: svgOf, png: pngOf, csv: csvOf };

/** Downloads `plot` as a file of `format`: "svg", "png" or "csv". view: {width, height, colour(name), font(size)} of
 *  its panel, window: [low, high] of what is shown. */
export async function exportPlot(format, plot, view, window) {
  const header = await headerOf(plot);
  const blob = await FORMATS[format](plot, view, window, header);
  const hash = (header.scene_sha256 ?? header.A?.scene_sha256 ?? header.B?.scene_sha256 ?? "").slice(0, 8);
  save(blob, `${["ridgewave", plot.kind, hash].filter(Boolean).join("-")}.${format}`);
}

/** Returns the height of a caption, CSS px. */
const roomOf = (caption) => CAPTION + LINE * (caption.length - 1);

/** Draws the plot and its caption with `context`; returns its axes. */
function draw(context, plot, { width, height, colour, font }, window, caption) {
  const panel = { context, width, height, colour, font };
  context.fillStyle = colour("ground");
  context.fillRect(0, 0, width, height + roomOf(caption));
  const axes = drawPlot(panel, plot, window);
  context.fillStyle = colour("muted");
  context.font = font(10);
  context.textAlign = "left";
  context.textBaseline = "alphabetic";
  for (const [index, line] of caption.entries()) context.fillText(line, 2, height + CAPTION - 7 + LINE * index);
  return axes;
}

function svgOf(plot, view, window, header) {
  if (plot.svg) return new Blob([plot.svg(header).text], { type: "image/svg+xml" });
  const context = new SvgContext();
  const caption = captionOf(header);
  const { across, up } = draw(context, plot, view, window, caption);
  const told = ({ low, high, log, place }) => ({ low, high, log, from: place(low), to: place(high) });
  const axes = { across: told(across), up: told(up), lines: plot.lines.map(({ legend = "" }) => legend) };
  const text = context.document(view.width, view.height + roomOf(caption), { ...header, axes });
  return new Blob([text], { type: "image/svg+xml" });
}

async function pngOf(plot, view, window, header) {
  const caption = captionOf(header);
  const drawn = plot.svg?.(header) ?? { width: view.width, height: view.height + roomOf(caption) };
  const canvas = document.createElement("canvas");
  canvas.width = drawn.width * PIXELS;
  canvas.height = drawn.height * PIXELS;
  const context = canvas.getContext("2d");
  context.scale(PIXELS, PIXELS);
  if (plot.svg) context.drawImage(await pictureOf(drawn.text), 0, 0, drawn.width, drawn.height);
  else draw(context, plot, view, window, caption);
  const blob = await new Promise((resolve) => canvas.toBlob(resolve, "image/png"));
  return withText(blob, "ridgewave", JSON.stringify(header));
}

/** Returns an SVG as a picture. */
async function pictureOf(text) {
  const picture = new Image();
  picture.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(text)}`;
  await picture.decode();
  return picture;
}

/** Returns a plot as CSV. */
function csvOf(plot, _, window, header) {
  const lines = Object.entries(header).map(([name, value]) => `# ${name}: ${JSON.stringify(value)}`);
  lines.push(plot.columns.join(), ...plot.rows(...(window ?? [])).map((row) => row.map(cell).join()));
  return new Blob([`${lines.join("\n")}\n`], { type: "text/csv" });
}

/** Returns a cell: a text with commas in quotes, null as nothing. */
function cell(value) {
  const text = String(value ?? "");
  return /[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
}
