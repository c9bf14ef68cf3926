/* Elements: making them, finding them, and buttons whose work takes a while. */

/**
 * Returns a new element.
 * @param {string} tag with classes after dots: "p.hint"
 * @param {object} attributes `text`: its text. A function: a listener. false and null: no attribute.
 * @param children elements and texts; null and "" are omitted
 */
export function make(tag, attributes = {}, ...children) {
  const [name, ...classes] = tag.split(".");
  const element = document.createElement(name);
  if (classes.length) element.className = classes.join(" ");
  for (const [key, value] of Object.entries(attributes)) {
    if (key === "text") element.textContent = value;
    else if (typeof value === "function") element.addEventListener(key, value);
    else if (value !== false && value !== null) element.setAttribute(key, value === true ? "" : value);
  }
  element.append(...children.filter((child) => child !== null && child !== ""));
  return element;
}

/** Disables `button` while `work` runs, and returns to it the focus that it lost with that; returns the result of `work`. */
export async function whileDisabled(button, work) {
  const focused = document.activeElement === button;
  button.disabled = true;
  try {
    return await work();
  } finally {
    button.disabled = false;
    if (focused && document.activeElement === document.body) button.focus();
  }
}

/** Returns the element with `id`. */
export const byId = (id) => document.getElementById(id);
