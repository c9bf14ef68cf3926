/* Where a value stands on a slider, and which value a place on it is.

Model: t from 0 to 1. Ranges above zero are logarithmic; ranges from zero follow t^5, so that half of the way lies below
3 % of the range (bare numbers: t); ranges through zero follow the same with the sign, from the middle.
Limits: three significant digits; a range without end, or of more than nine decades, has no slider. */

const POWER = 5; // larger: small values get more of the way
const DECADES = 9; // more on 1000 steps would be finer than a person can set

/**
 * The slider of a range.
 * @param {{minimum: number, maximum: number, whole: boolean}} range in SI
 * @param {boolean} bare the numbers have no unit
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
