/* The form for the key of a service that requires one. The key is tried before the page is reloaded with it. */

import { byId } from "../dom.js";
import { explanationOf } from "../explained.js";
import { call, useKey } from "../service.js";

const UNUSUAL = /[^\x21-\x7e]/; // keys of the service have none of these; a browser cannot send most of them

/** Shows the form. A refused key stays in the field, with an error message. */
export function askForKey() {
  const [form, field, fault] = [byId("key"), byId("key-text"), byId("key-fault")];
  const refuse = (sentence) => {
    fault.textContent = sentence;
    field.setAttribute("aria-invalid", "true");
    field.select();
    field.focus();
  };
  if (!form.hidden) return; // it is shown already
  form.hidden = false;
  form.classList.toggle("over", !byId("main").hidden); // over the page, so that nothing moves under a finger
  const loading = byId("loading"); // gone if the page had loaded
  if (loading) loading.hidden = true;
  field.focus();
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    if (UNUSUAL.test(field.value.trim()))
      return refuse("No key has spaces, or characters other than visible ASCII. Copy it again, or type it.");
    useKey(field.value.trim());
    try {
      await call("GET", "/v1/textures");
    } catch (error) {
      useKey(null);
      const refused = error.problem?.status === 401;
      return refuse(refused ? "The service does not accept this key. Enter another one." : explanationOf(error));
    }
    location.reload();
  });
}
