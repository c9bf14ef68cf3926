/* Messages of the page: the newest one, shown for a while and announced to screen readers. It lies over the page, in a new
element each time, so that nothing moves. */

import { byId, make } from "../dom.js";

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
