/* The report of an import as text: what was measured, in words and units (docs/import.md, "The report"). */

import { make } from "../dom.js";
import { showQuantity } from "../scene/units.js";

const DIGITS = 4;

const length = (metres) => showQuantity(metres, "m", DIGITS).replace(" um", " µm");
const along = (values, text) => values.map(text).join(" × ");

/** Returns the number of points, size and Rq of `report` as a sentence. */
export const summaryOf = ({ points, size, rq }) =>
  `${along(points, String)} points over ${along(size, length)}, Rq ${length(rq)}.`;

/** Returns the lines of `report`: [name, text]. */
function linesOf(report) {
  const { points, spacing, size, unit, unit_stated_by_file: stated, missing, level } = report;
  const [x, y] = report.rms_slope.map((slope) => String(Number(slope.toPrecision(3))));
  const area = points.length > 1;
  return [
    ["File", `${report.file} (${[report.format, report.layout, report.channel].filter(Boolean).join(", ")})`],
    ...readingOf(report.reading),
    ["Size", `${along(size, length)}, ${along(points, String)} points`],
    ["Distance between points", along(spacing, length)],
    ["Unit of the heights", unit ? `${unit}, ${stated ? "stated by the file" : "given"}` : `none: ${heightOf(report)}`],
    [area ? "Sq, Sa" : "Rq, Ra", `${length(report.rq)}, ${length(report.ra)}`],
    ["From valley to peak", length(report.peak_to_valley)],
    ["rms slope", area ? `${x} along x, ${y} along y` : x],
    ["Removed", level === "none" ? "nothing" : level],
    ["Missing points", missing.points ? `${missing.points}: ${missing.rule}` : "none"],
    ...report.notes.map((note) => ["Note", `${note}.`]),
  ];
}

/** Returns where the height of a surface without a unit is from. A set has `green` where its normals were used. */
const heightOf = ({ maps }) => (maps?.green ? "the normals give the height" : "a height was given");

/** Returns the lines about how a text was read; none for other files, and for reports of older versions. */
function readingOf(reading) {
  if (!reading) return [];
  const { encoding, separator, decimal_sign: decimal, columns } = reading;
  const parts = [encoding, separator && `separated by ${separator}`, `decimal sign ${decimal}`];
  const named = columns.map(
    ({ name, read_as: role, unit }, number) => `${name || `column ${number + 1}`}: ${role}${unit ? ` in ${unit}` : ""}`,
  );
  const text = ["Text", parts.filter(Boolean).join(", ")];
  return named.length ? [text, ["Columns", named.join("; ")]] : [text];
}

/** Returns `report` as a list of names and values. */
export const reportList = (report) =>
  make(
    "dl.report",
    {},
    ...linesOf(report).flatMap(([name, text]) => [make("dt", { text: name }), make("dd", { text })]),
  );
