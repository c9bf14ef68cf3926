/* Elements made from script, since the page is served without inline markup of scripts and styles. */

/**
 * Make an element.
 * @param {string} tag with classes behind points: "p.hint"
 * @param {object} attributes by name; `text` is its text, functions are listeners, false and null are left out
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
  element.append(...children);
  return element;
}

/** The element with `id`. */
export const byId = (id) => document.getElementById(id);
