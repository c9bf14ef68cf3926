/* Reads the JSON Schema of a scene as fields with alternatives, units and ranges.

Model: a field has alternatives (anyOf, oneOf or itself): a number, words, settings (an object), a list, points (a list
of rows of numbers), text. Text with a unit is not an alternative; it is the notation of a number.
Limits: other parts of JSON Schema (patternProperties, not, if) are ignored; the service validates the scene. */

import { readQuantity, showQuantity, unitsOf } from "../scene/units.js";

const SI_UNITS = ["m", "m/s", "m/s^2", "N", "Pa", "Hz", "s", "kg", "N s/m", "N/m", "rad"];
const QUANTITY_UNITS = { approach: "m", displacement: "m", velocity: "m/s", acceleration: "m/s^2" };

/** Returns a label: "ridge_period" -> "Ridge period". */
export const labelOf = (name) =>
  (name.charAt(0).toUpperCase() + name.slice(1))
    .replaceAll("_", " ")
    .replace("Youngs", "Young's")
    .replace("Poisson", "Poisson's");

function resolved(schema, root) {
  if (!schema.$ref) return schema;
  const found = schema.$ref
    .slice(2)
    .split("/")
    .reduce((place, name) => place[name], root);
  return { ...resolved(found, root), ...schema, $ref: undefined };
}

function wordsOf(option) {
  if (option.enum) return option.enum;
  if ("const" in option) return [option.const];
  return option.type === "boolean" ? [true, false] : [];
}

/**
 * Reads a field.
 * @param {object} schema of the field
 * @param {object} root the whole schema, for its $refs
 * @param {(string|number)[]} path names and indices from the root of the scene
 * @returns {{path, name, label, hint, allowed, unit, fallback, nullable, needs, alternatives}} `unit`: SI unit, "" for
 *   none, null if it depends on the quantity in the same object; `fallback`: default of the schema; `needs`: other
 *   fields by path, and the values of each with which a scene can have this field; `alternatives`: each with a `kind`
 */
export function readField(schema, root, path = []) {
  const node = resolved(schema, root);
  const options = (node.anyOf ?? node.oneOf ?? [node]).map((option) => resolved(option, root));
  const name = String(path.at(-1) ?? "scene");
  const texts = options.filter((option) => option.type === "string" && option.pattern);
  const unit = unitOfField(node, texts);
  const words = options.flatMap(wordsOf).filter((word) => word !== null);
  const alternatives = [];
  for (const option of options) {
    if (["number", "integer"].includes(option.type))
      alternatives.push({ kind: "number", whole: option.type === "integer", ...rangeOf(option) });
    else if (option.type === "object")
      alternatives.push({ kind: "settings", schema: option, ...readSettings(option, root, path) });
    else if (option.type === "array") alternatives.push(readList(option, root));
    else if (option.type === "string" && !option.enum && !("const" in option) && !isNotation(option, options))
      alternatives.push({ kind: "text", pattern: option.pattern ?? "" });
  }
  if (words.length) alternatives.push({ kind: "words", words });
  return {
    path,
    name,
    label: node.title ?? labelOf(name),
    unit,
    alternatives,
    hint: tidy(node.description ?? options.find((option) => option.description)?.description ?? ""),
    allowed: node["x-allowed"] ?? "",
    fallback: node.default ?? null,
    nullable: options.some((option) => option.type === "null"),
    needs: Object.entries(node["x-needs"] ?? {}).map(([needed, values]) => ({ path: needed.split("."), values })),
  };
}

const tidy = (text) => text.replace(/\s+/g, " ").replaceAll("`", "");

const rangeOf = (option) => ({ minimum: option.minimum ?? -Infinity, maximum: option.maximum ?? Infinity });

/** Whether the text of `option` is that of a number. */
const isNotation = (option, options) => option.pattern && options.some(({ type }) => type === "number");

function unitOfField(node, texts) {
  if (node["x-unit"]) return node["x-unit"];
  const fitting = SI_UNITS.filter((unit) =>
    texts.some(
      (text) => new RegExp(text.pattern).test(`1 ${unit}`) && new RegExp(text.pattern).test(`1 ${unitsOf(unit)[1]}`),
    ),
  );
  return fitting.length > 1 ? null : (fitting[0] ?? "");
}

function readSettings(option, root, path) {
  const fields = Object.entries(option.properties ?? {}).map(([name, schema]) =>
    readField(schema, root, [...path, name]),
  );
  const tag = fields.find(
    (field) =>
      field.alternatives.some(({ kind, words }) => kind === "words" && words.length === 1) &&
      (option.required ?? []).includes(field.name),
  );
  return { fields, title: option.title ?? null, tag: tag ? [tag.name, tag.alternatives[0].words[0]] : null };
}

function readList(option, root) {
  const items = resolved(option.items ?? {}, root);
  const size = { minimum: option.minItems ?? 0, maximum: option.maxItems ?? Infinity };
  if (!items.prefixItems) return { kind: "list", items, ...size };
  return {
    kind: "points",
    columns: items.prefixItems.map((column, index) => readField(column, root, [index])),
    ...size,
  };
}

/** Returns the SI unit of `field`. siblings: values of the same object; the unit of a full scale is that of its
 *  quantity. */
export const unitBeside = (field, siblings) => field.unit ?? QUANTITY_UNITS[siblings?.quantity ?? "acceleration"];

/** Returns the alternative of `field` to which `value` belongs, or null. */
export function alternativeOf(field, value) {
  const fits = (alternative) => {
    if (alternative.kind === "words") return alternative.words.includes(value);
    if (alternative.kind === "settings") {
      const [name, word] = alternative.tag ?? [];
      return typeof value === "object" && value !== null && !Array.isArray(value) && (!name || value[name] === word);
    }
    if (alternative.kind === "list" || alternative.kind === "points") return Array.isArray(value);
    return alternative.kind === "number" ? ["number", "string"].includes(typeof value) : typeof value === "string";
  };
  const words = field.alternatives.find((alternative) => alternative.kind === "words" && fits(alternative));
  return words ?? field.alternatives.find(fits) ?? null;
}

/** Returns what to enter into `field`, a number in `si`, as a sentence. */
export function whatToWrite(field, si) {
  const range = field.allowed.split(/, "/)[0].replace(/, a whole number/, "");
  const example = si ? `, such as ${exampleOf(field, si)}` : "";
  const number = field.alternatives.some(({ whole }) => whole) ? "a whole number" : "a value";
  return range && field.unit !== null ? `Enter ${number} from ${range}${example}.` : `Enter ${number}${example}.`;
}

const exampleOf = (field, si) =>
  showQuantity(
    typeof field.fallback === "number"
      ? field.fallback || 1
      : field.alternatives.find(({ kind }) => kind === "number").minimum || 1,
    si,
    3,
  );

/**
 * Checks `text`, a number for `field`.
 * @param {string} si the SI unit
 * @param {string} unit unit of a number without one
 * @returns {{value: string|number, si: number} | {fault: string}} value for the scene and SI value, or what to enter
 */
export function checkNumber(field, text, si, unit) {
  const { minimum, maximum, whole } = field.alternatives.find(({ kind }) => kind === "number");
  const read = readQuantity(text, si, unit);
  const slack = 1e-12 * Math.abs(read?.value ?? 0);
  const inside = read && read.value >= minimum - slack && read.value <= maximum + slack;
  if (!inside || (whole && Math.abs(read.value - Math.round(read.value)) > 1e-9))
    return { fault: whatToWrite(field, si) };
  return { value: si ? read.text : read.value, si: read.value };
}

/**
 * Checks points: a line for each, numbers separated by commas, semicolons or tabs.
 * @returns {{value: Array} | {fault: string}}
 */
export function checkPoints(points, text) {
  const rows = [];
  for (const [index, line] of text.split("\n").entries()) {
    if (!line.trim()) continue;
    const cells = line.split(/[,;\t]/);
    const read = cells.map(
      (cell, column) =>
        points.columns[column] &&
        checkNumber(points.columns[column], cell, points.columns[column].unit, points.columns[column].unit),
    );
    if (cells.length !== points.columns.length || read.some((cell) => cell.fault)) {
      const units = points.columns.map(({ unit }) => unit);
      const example = units.map((unit) => `0.1 ${unit}`).join(", ");
      return { fault: `Line ${index + 1}: enter ${units.join(", ")} within their ranges, such as ${example}.` };
    }
    rows.push(read.map(({ si, value }) => (typeof value === "string" ? value : si)));
  }
  if (rows.length < points.minimum || rows.length > points.maximum)
    return { fault: `Enter ${points.minimum} to ${points.maximum} lines instead of ${rows.length}.` };
  return { value: rows };
}

/** Returns a valid first value of `field`; a list has as few items as it may. root: the whole schema. */
export function startingValue(field, root) {
  const [first] = [...field.alternatives].sort((one, other) => rank(one) - rank(other));
  if (first.kind === "words") return first.words.includes(field.fallback) ? field.fallback : first.words[0];
  if (first.kind === "settings") return first.tag ? Object.fromEntries([first.tag]) : {};
  if (first.kind === "number")
    return typeof field.fallback === "number" ? field.fallback : Math.max(first.minimum, Math.min(1, first.maximum));
  if (first.kind !== "list") return first.kind === "text" ? "" : [];
  return Array.from({ length: first.minimum }, () => startingValue(readField(first.items, root), root));
}

const rank = ({ kind }) => ["words", "settings", "number", "list", "points", "text"].indexOf(kind);
