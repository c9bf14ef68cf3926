/* The measured values of an imported texture, and the controls that rename and delete it. */

import { make } from "../dom.js";
import { explanationOf } from "../explained.js";
import { reportList } from "./import_report.js";

export class OwnTexture {
  #name;
  #fault = make("p.fault", { id: "own-name-fault", role: "alert", hidden: true });

  /** textures: the TextureList. onDeleted(): called after the texture was deleted. tell(sentence). */
  constructor(entry, { textures, onDeleted, tell }) {
    Object.assign(this, { entry, textures, onDeleted, tell });
    const about = "own-name-fault";
    this.#name = make("input", { id: "own-name", type: "text", autocomplete: "off", "aria-describedby": about });
    this.#name.value = entry.name;
    this.element = make(
      "div.own-texture",
      {},
      reportList(entry.report),
      make(
        "form.control-row",
        { novalidate: true, submit: (event) => this.#rename(event) },
        make("label", { for: "own-name", text: "Name" }),
        this.#name,
        make("button", { text: "Rename" }),
        make("button", { type: "button", text: "Delete", id: "own-delete", click: () => this.#delete() }),
        this.#fault,
      ),
    );
  }

  async #rename(event) {
    event.preventDefault();
    const [before, after] = [this.entry.name, this.#name.value.trim()];
    try {
      await this.textures.rename(before, after);
      this.tell(`${before} is now called ${after}.`);
    } catch (error) {
      const [fault] = error.problem?.errors ?? [];
      this.#refuse(fault ? `Allowed: ${fault.allowed}. ${fault.hint}` : explanationOf(error));
    }
  }

  async #delete() {
    const { name } = this.entry;
    if (!confirm(`Delete ${name}? The service keeps no copy.`)) return;
    try {
      await this.textures.remove(name);
      this.onDeleted();
      this.tell(`${name} is deleted.`);
    } catch (error) {
      this.#refuse(explanationOf(error));
    }
  }

  #refuse(sentence) {
    this.#fault.textContent = sentence;
    this.#fault.hidden = !sentence;
    this.#name.setAttribute("aria-invalid", String(Boolean(sentence)));
  }
}
