/* Linear and logarithmic axes with round ticks, and their drawing on a Panel. Lengths are CSS pixels. */

import { inWords, prefixOf } from "../scene/quantities.js";

/** Returns the largest 1, 2 or 5 times a power of ten that is not above `size`. */
export function roundBelow(size) {
  const power = 10 ** Math.floor(Math.log10(size) + 1e-12);
  return power * [5, 2, 1].find((step) => step * power <= size * (1 + 1e-9));
}

/** Returns a linear axis {place(value): px, low, high, ticks: [{value, label, main}], unit, log} with at most `most` ticks.
 *  */
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
    log: false,
    place: (value) => from + ((value - low) / (high - low)) * (to - from),
  };
}

/** Returns a logarithmic axis with ticks at 1 to 9 of each decade and labels at decades, at least `apart` px apart. */
export function logAxis(low, high, from, to, unit, apart = 18) {
  const decades = Math.log10(high / low);
  const every = Math.max(1, Math.ceil(apart / (Math.abs(to - from) / decades)));
  const ticks = [];
  for (let power = Math.floor(Math.log10(low) + 1e-9); power <= Math.log10(high) + 1e-9; power++) {
    for (let digit = 1; digit < 10; digit++) {
      const value = digit * 10 ** power;
      if (value < low * (1 - 1e-9) || value > high * (1 + 1e-9)) continue;
      const labelled = digit === 1 && power % every === 0;
      if (digit === 1 || decades <= 4)
        ticks.push({ value, label: labelled ? inWords(value, unit) : "", main: digit === 1 });
    }
  }
  return {
    low,
    high,
    ticks,
    unit,
    log: true,
    place: (value) => from + (Math.log(value / low) / Math.log(high / low)) * (to - from),
  };
}

/** Returns the smallest 1, 2 or 5 times a power of ten that is not below `size`. */
export function roundAbove(size) {
  const power = 10 ** Math.floor(Math.log10(size) + 1e-12);
  return power * [1, 2, 5, 10].find((step) => step * power >= size * (1 - 1e-9));
}

/** Draws grid, labels and titles of two axes in `box` {left, top, right, bottom}, CSS px.
 *  @returns {number} where the room right of the upper title begins, CSS px. */
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
  return 2 + context.measureText(upTitle).width + 8;
}

/** Draws the words of a legend, which end at `right`, and its line before them. at: y of the words, px. Returns where the
 *  next legend to the left ends. */
export function drawLegend(context, panel, { right, at, words, colour, dash = [] }) {
  context.fillStyle = panel.colour("ink");
  context.fillText(words, right, at);
  const end = right - context.measureText(words).width - 6;
  context.strokeStyle = panel.colour(colour);
  context.lineWidth = 2;
  context.setLineDash(dash);
  context.beginPath();
  context.moveTo(end - 18, 9);
  context.lineTo(end, 9);
  context.stroke();
  context.setLineDash([]);
  return end - 30;
}
