/* The scale of a slider: value over place.

Model: a place t is from 0 to 1. Ranges above zero are logarithmic. Ranges from zero follow t^5, so that half of the
slider is below 3 % of the range; ranges through zero do so on both sides of the middle. Numbers without a unit are
linear.
Limits: three significant digits. Infinite ranges, and those of more than nine decades, have no slider. */

const POWER = 5; // larger gives small values more room
const DECADES = 9; // more are too coarse on 1000 steps

/**
 * Returns the scale of a range, null for none.
 * @param {{minimum: number, maximum: number, whole: boolean}} range in SI units
 * @param {boolean} bare numbers without a unit
 * @returns {{place(value: number): number, value(place: number): number} | null} places from 0 to 1
 */
export function sliderOf({ minimum, maximum, whole }, bare) {
  if (!Number.isFinite(minimum) || !Number.isFinite(maximum)) return null;
  const rounded = (value) => {
    const near = Number(value.toPrecision(3));
    return Math.min(maximum, Math.max(minimum, whole ? Math.round(near) : near));
  };
  const clamped = (place) => Math.min(1, Math.max(0, place));
  if (bare)
    return {
      place: (value) => clamped((value - minimum) / (maximum - minimum)),
      value: (place) => rounded(minimum + place * (maximum - minimum)),
    };
  if (minimum > 0) {
    const decades = Math.log10(maximum / minimum);
    if (decades > DECADES) return null;
    return {
      place: (value) => clamped(Math.log10(value / minimum) / decades),
      value: (place) => rounded(minimum * 10 ** (place * decades)),
    };
  }
  if (minimum === 0)
    return {
      place: (value) => clamped((value / maximum) ** (1 / POWER)),
      value: (place) => rounded(maximum * place ** POWER),
    };
  const reach = Math.max(-minimum, maximum);
  return {
    place: (value) => clamped(0.5 + 0.5 * Math.sign(value) * (Math.abs(value) / reach) ** (1 / POWER)),
    value: (place) => rounded(reach * Math.sign(place - 0.5) * Math.abs(2 * place - 1) ** POWER),
  };
}
