/* The import of a measured surface: a dialog with the options of docs/import.md, and what the service measures.

Model: each change of an option sends the file with `?dry_run=true`, and the answer is shown: the report and a picture,
or a fault beside each option. A set of maps is sent when its width is given. Nothing is kept before "Keep", which also
checks the name. Only the answer to the newest request is shown.
Limits: the file is sent again at each change. */

import { byId, make } from "../dom.js";
import { explanationOf } from "../explained.js";
import { call } from "../service.js";
import { reportList, summaryOf } from "./import_report.js";

const LENGTHS = [["m"], ["cm"], ["mm"], ["um", "µm"], ["nm"], ["inch"]];
const UNITS = [
  ["", "as in the file"],
  ...LENGTHS,
  ["mm, um", "x in mm, heights in µm"],
  ["um, nm", "x in µm, heights in nm"],
  ["mm, nm", "x in mm, heights in nm"],
];
const LEVELS = [
  ["none", "nothing"],
  ["tilt", "tilt (a plane)"],
  ["curvature", "curvature (a surface of second order)"],
];
const RULES = [
  ["refuse", "refuse the file"],
  ["fill", "fill from their neighbours"],
  ["crop", "keep the largest part without them"],
];
/** Name in the API, label, hint, and the choices of a menu. */
const OPTIONS = [
  ["unit", "Unit of the numbers", "Of the heights. In columns of x, y and height, of all three.", UNITS],
  ["pixel", "Distance between points", "Such as 5 µm, or 5 µm, 10 µm for x and y. Empty: as in the file."],
  ["height", "Height of a grey image", "From its darkest to its brightest possible grey, such as 120 µm."],
  ["level", "Form to remove", "If the surface was not level under the instrument.", LEVELS],
  ["missing", "Missing points", "What is done with points that have no height.", RULES],
  ["resample", "Resample a profile to", "Linearly, if its steps of x are not equal: such as 5 µm. Empty: not."],
];
/** Those of a ZIP file with a set of maps of a material. */
const OF_SETS = [
  ["width", "Width of the sample", "What the maps show from left to right, as their library tells: such as 2 m."],
  ["part", "Part", "Side of the square in its middle that is kept, such as 60 mm. Empty: all of it."],
  OPTIONS.find(([name]) => name === "height"),
  [
    "slope",
    "Slope below the pixel",
    "rms slope of synthetic waves, in the range that the report tells; 0: none. Empty: of the roughness map.",
  ],
  ["hurst", "Hurst exponent below the pixel", "In place of the slope: from 0, rough, to 1, smooth, such as 0.8."],
  ["shortest", "Shortest wave below the pixel", "Such as 100 µm. Empty: 60 µm, or longer for a large surface."],
];
const NAME = ["name", "Name", "1 to 64 small letters, digits and -. It stands for the texture in scenes."];
const isSet = (file) => /\.zip$/i.test(file.name);

export class ImportDialog {
  #file;
  #fields = new Map();
  #newest = 0; // number of the newest request
  #status = make("p", { role: "status" });
  #result = make("div.import-result");
  #keep = make("button.primary", { type: "submit", text: "Keep", disabled: true });

  /** onKept(name): called when the texture is kept and the dialog is closed. */
  constructor(file, onKept) {
    this.#file = file;
    this.onKept = onKept;
    this.element = make(
      "dialog.card.import",
      { "aria-labelledby": "import-title", close: () => this.#closed() },
      make("h2", { id: "import-title", text: `Import ${file.name}` }),
      make(
        "form",
        {
          novalidate: true,
          change: ({ target }) => target.name === "name" || this.#measure(),
          submit: (event) => this.#submit(event),
        },
        make("div.fields", {}, ...(isSet(file) ? OF_SETS : OPTIONS).map((option) => this.#option(...option))),
        make("div.import-found", {}, this.#status, this.#result),
        make(
          "div.import-foot.control-row",
          {},
          this.#option(...NAME),
          this.#keep,
          make("button", { type: "button", text: "Cancel", click: () => this.element.close() }),
        ),
      ),
    );
  }

  /** Shows the dialog and measures the file. */
  async open() {
    document.body.append(this.element);
    this.element.showModal();
    await this.#measure();
    const asked = this.#needsWidth() && this.#fields.get("width").control;
    (asked || this.element.querySelector("[aria-invalid=true]"))?.focus();
  }

  #option(name, label, hint, choices) {
    const id = `import-${name}`;
    const fault = make("p.fault", { id: `${id}-fault`, role: "alert", hidden: true });
    const described = { id, name, "aria-describedby": `${id}-hint ${id}-fault` };
    const control = choices
      ? make("select", described, ...choices.map(([value, text = value]) => make("option", { value, text })))
      : make("input", { ...described, type: "text", autocomplete: "off", spellcheck: "false" });
    this.#fields.set(name, { control, fault });
    return make(
      "div.field",
      {},
      make("label", { for: id, text: label }),
      control,
      make("p.hint", { id: `${id}-hint`, text: hint }),
      fault,
    );
  }

  /** Returns the body of a request, with the options whose names are in `names`. */
  #form(names) {
    const form = new FormData();
    for (const name of names) form.append(name, this.#fields.get(name).control.value.trim());
    form.append("file", this.#file);
    return form;
  }

  #needsWidth() {
    return isSet(this.#file) && !this.#fields.get("width").control.value.trim();
  }

  async #measure() {
    const number = ++this.#newest;
    this.#keep.disabled = true;
    if (this.#needsWidth()) {
      this.#refuse(null);
      this.#result.replaceChildren();
      this.#status.textContent = "Write the width of the sample first: no map states its size.";
      return;
    }
    this.#status.textContent = "Reading the file.";
    let found;
    try {
      found = await call(
        "POST",
        "/v1/textures?dry_run=true",
        this.#form([...this.#fields.keys()].filter((name) => name !== "name")),
      );
    } catch (problem) {
      if (number === this.#newest) this.#refuse(problem);
      return;
    }
    if (number !== this.#newest) return;
    this.#refuse(null);
    this.#show(found);
    this.#keep.disabled = false;
  }

  async #submit(event) {
    event.preventDefault();
    if (this.#keep.disabled) return;
    const number = ++this.#newest;
    this.#keep.disabled = true;
    try {
      const { name } = await call("POST", "/v1/textures", this.#form(this.#fields.keys()));
      if (number !== this.#newest) return;
      this.element.close();
      await this.onKept(name);
    } catch (problem) {
      if (number !== this.#newest) return;
      this.#refuse(problem);
      this.#keep.disabled = false;
      (this.element.querySelector("[aria-invalid=true]") ?? this.#keep).focus(); // a disabled button loses the focus
    }
  }

  #show({ name, report, picture }) {
    const { control } = this.#fields.get("name");
    if (!control.value) control.value = name;
    this.#status.textContent = `${summaryOf(report)} Nothing is kept yet.`;
    this.#result.replaceChildren(make("img", { src: picture, alt: "The surface, lit from the upper left" }));
    this.#result.append(reportList(report));
  }

  /** Shows each fault of a ServiceProblem beside its option, and the others as the status; null: no fault. */
  #refuse(error) {
    const problem = error?.problem ?? {};
    const taken = problem.type?.endsWith("name-taken");
    const faults = taken ? [{ pointer: "/name", sentence: problem.detail }] : (problem.errors ?? []);
    for (const { fault, control } of this.#fields.values()) {
      fault.textContent = "";
      fault.hidden = true;
      control.setAttribute("aria-invalid", "false");
    }
    const others = [];
    for (const one of faults) {
      const field = this.#fields.get(one.pointer.slice(1));
      const sentence = one.sentence ?? sentenceOf(one);
      if (!field) others.push(sentence);
      else {
        field.fault.textContent = sentence;
        field.fault.hidden = false;
        field.control.setAttribute("aria-invalid", "true");
      }
    }
    if (!error) return;
    if (!faults.length) others.push(explanationOf(error));
    this.#status.textContent = others.join(" ") || "Some values are missing or wrong.";
    this.#result.replaceChildren();
  }

  #closed() {
    this.#newest++;
    this.element.remove();
    byId("import").focus();
  }
}

/** Returns a fault of a problem document as a sentence. */
const sentenceOf = ({ value, allowed, hint }) =>
  value === "nothing" ? `Needed: ${allowed}. ${hint}` : `Found: ${value}. Allowed: ${allowed}. ${hint}`;
