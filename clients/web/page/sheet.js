/* What the page shows beside the pad: on a narrow screen one of Feel, Plot and Scene, on a wide one the drawer of the scene.

Model: the attribute `data-sheet` of the body names it, `data-open` opens the sheet of an upright phone; layout.css does the
rest. On a wide screen Feel and Plot are always there, and "scene" opens the drawer. The fields that are set come first when
the drawer opens. */

import { byId } from "../dom.js";

export class Sheet {
  /** form: the Form. */
  constructor(form) {
    this.form = form;
    this.tabs = [...document.querySelectorAll("[data-tab]")];
    for (const tab of this.tabs) tab.addEventListener("click", () => this.#press(tab.dataset.tab));
    byId("drawer").addEventListener("click", () => this.show(this.shown === "scene" ? "feel" : "scene"));
    byId("close-drawer").addEventListener("click", () => {
      this.show("feel");
      byId("drawer").focus();
    });
    byId("scene").addEventListener("keydown", ({ key }) => key === "Escape" && byId("close-drawer").click());
    byId("scene-search").addEventListener("input", ({ target }) => form.search(target.value));
    this.show("feel");
  }

  /** Shows a tab with the sheet open; pressed again, a tab closes the sheet. */
  #press(name) {
    document.body.toggleAttribute("data-open", name !== this.shown || !("open" in document.body.dataset));
    this.show(name);
  }

  /** "feel", "plot" or "scene". */
  get shown() {
    return document.body.dataset.sheet;
  }

  show(name) {
    if (name === "scene" && this.shown !== "scene") this.form.setFirst();
    document.body.dataset.sheet = name;
    for (const tab of this.tabs) tab.setAttribute("aria-pressed", String(tab.dataset.tab === name));
    byId("drawer").setAttribute("aria-expanded", String(name === "scene"));
  }
}
