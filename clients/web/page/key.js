/* The key of a service that asks for one: written once a tab, and tried before the page is loaded again with it. */

import { byId } from "../knobs/element.js";
import { call, useKey } from "../service.js";

/** Show the form for the key. A key that is refused stays in its field, with a sentence. */
export function askForKey() {
  const [form, field, fault] = [byId("key"), byId("key-text"), byId("key-fault")];
  const refuse = (sentence) => {
    fault.textContent = sentence;
    field.setAttribute("aria-invalid", "true");
    field.select();
    field.focus();
  };
  form.hidden = false;
  byId("loading").hidden = true;
  field.focus();
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    useKey(field.value);
    try {
      await call("GET", "/v1/textures");
    } catch ({ problem, message }) {
      useKey(null);
      return refuse(problem?.status === 401 ? "The service does not accept this key: write another one." : message);
    }
    location.reload();
  });
}
