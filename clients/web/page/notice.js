/* Messages of the page: the newest one, shown for a while and announced to screen readers. */

import { byId } from "../dom.js";

const SHOWN = 9000; // ms; shorter is missed, longer is out of date

let timer = 0;

/** Shows `sentence`. */
export function tell(sentence) {
  const place = byId("notice");
  place.textContent = sentence;
  place.hidden = false;
  clearTimeout(timer);
  timer = setTimeout(() => {
    place.hidden = true;
  }, SHOWN);
}
