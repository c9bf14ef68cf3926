/* Messages of the page: the newest one, shown for a while and announced to screen readers. It lies over the page, in a new
element each time, so that nothing moves. */

import { byId, make } from "../dom.js";

const NOT_LOADED = "Part of the page did not load. Check that the service is running, then try again.";
const SHOWN = 9000; // ms; shorter is missed, longer is out of date

let timer = 0;

/** Shows `sentence`. */
export function tell(sentence) {
  const place = byId("notice");
  place.replaceChildren(make("span", { text: sentence }));
  place.hidden = false;
  clearTimeout(timer);
  timer = setTimeout(() => {
    place.hidden = true;
  }, SHOWN);
}

/** Returns the module that `loading` loads, or null after telling the user that it did not load. */
export function orTell(loading) {
  return loading.catch(() => {
    tell(NOT_LOADED);
    return null;
  });
}
