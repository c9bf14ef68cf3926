/* One place for what the page has to say: the newest sentence, read out politely, gone after a while. */

import { byId } from "../knobs/element.js";

const STAYS = 9000; // ms; shorter is missed, longer covers the next

let timer = 0;

/** Tell `sentence`. */
export function tell(sentence) {
  const place = byId("notice");
  place.textContent = sentence;
  place.hidden = false;
  clearTimeout(timer);
  timer = setTimeout(() => {
    place.hidden = true;
  }, STAYS);
}
