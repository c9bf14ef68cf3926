/* The key of a service that asks for one: written once a tab. */

import { byId } from "../knobs/element.js";
import { useKey } from "../service.js";

/** Show the form for the key; the page is loaded again with it. */
export function askForKey() {
  const form = byId("key");
  form.hidden = false;
  byId("loading").hidden = true;
  byId("key-text").focus();
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    useKey(byId("key-text").value);
    location.reload();
  });
}
