/* Files handed to the person at the page. */

import { make } from "../knobs/element.js";

/** Hand over `blob` as a download called `name`. */
export function save(blob, name) {
  const url = URL.createObjectURL(blob);
  make("a", { href: url, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 10_000); // the browser has begun to read it by then
}

/** Hand over `text`, JSON, as a download called `name`. */
export const saveText = (text, name) => save(new Blob([text], { type: "application/json" }), name);
