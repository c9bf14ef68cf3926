/* What is done with a scene as a whole: undo, redo, links, files, sections opened and closed. */

import { byId } from "../knobs/element.js";
import { BrokenLink, hashOf, sceneIn } from "../knobs/link.js";
import { callBinary } from "../service.js";
import { save, saveText } from "./save.js";

/** The tools of the scene of `state`; form: whose sections are opened. tell(sentence) tells what became of it. */
export class Tools {
  constructor({ state, form, tell }) {
    Object.assign(this, { state, form, tell });
    state.addEventListener("change", ({ detail }) => this.#note(detail));
    this.#on("undo", () => state.undo() && tell("Undone."));
    this.#on("redo", () => state.redo() && tell("Redone."));
    this.#on("share", () => this.#share());
    this.#on("save-wav", () => this.#render());
    this.#on("save-scene", () => saveText(`${JSON.stringify(state.scene, null, 2)}\n`, "scene.json"));
    this.#on("fold", () => this.#fold());
    byId("open-scene").addEventListener("change", () => this.#read());
    document.addEventListener("keydown", (event) => this.#key(event));
    addEventListener("hashchange", () => this.follow());
  }

  /** Take the scene of the address, where it has one; returns whether it has. */
  follow() {
    try {
      const scene = sceneIn(location.hash);
      if (scene) this.state.take(scene);
      return Boolean(scene);
    } catch (error) {
      if (!(error instanceof BrokenLink)) throw error;
      this.tell(error.message);
      return false;
    }
  }

  #on(id, action) {
    byId(id).addEventListener("click", () => Promise.resolve(action()).catch((error) => this.tell(error.message)));
  }

  #note({ scene, settled }) {
    byId("undo").disabled = !this.state.canUndo;
    byId("redo").disabled = !this.state.canRedo;
    if (settled) this.#address(scene);
  }

  /** The address is always the link to the scene: what is reloaded, or copied from there, is what is shown. */
  #address(scene) {
    let hash = "";
    try {
      if (Object.keys(scene).length) hash = hashOf(scene);
    } catch {
      /* too long for a link: "Copy link" says so */
    }
    try {
      history.replaceState(null, "", hash || location.pathname + location.search);
    } catch {
      /* some browsers allow a hundred in half a minute: the next change tries again */
    }
  }

  #key(event) {
    if (!(event.ctrlKey || event.metaKey) || event.key.toLowerCase() !== "z" || event.altKey) return;
    if (event.target.closest?.("input:not([type=range]):not([type=checkbox]), textarea")) return; // the text's own undo
    event.preventDefault();
    byId(event.shiftKey ? "redo" : "undo").click();
  }

  async #share() {
    history.replaceState(null, "", hashOf(this.state.scene));
    try {
      await navigator.clipboard.writeText(location.href);
      this.tell("The link is copied: whoever opens it has this scene.");
    } catch {
      this.tell("The address of this page is now the link: copy it from the address line.");
    }
  }

  async #render() {
    const button = byId("save-wav");
    button.disabled = true;
    this.tell("The sound is being rendered.");
    try {
      const answer = await callBinary("POST", "/v1/render?format=wav", this.state.scene);
      save(await answer.blob(), "touch.wav");
      this.tell(answer.headers.get("Ridgewave-Warning") ?? "The WAV is ready.");
    } finally {
      button.disabled = false;
    }
  }

  async #read() {
    const input = byId("open-scene");
    const [file] = input.files;
    input.value = "";
    let scene = null;
    try {
      scene = JSON.parse(await file.text());
    } catch {
      /* told below */
    }
    if (typeof scene !== "object" || scene === null || Array.isArray(scene))
      return this.tell("This file is no scene: choose a JSON file that holds one object.");
    this.state.take(scene.format === "ridgewave-recording" ? scene.scene : scene);
  }

  #fold() {
    const open = byId("fold").getAttribute("aria-expanded") !== "true";
    this.form.open = open;
    byId("fold").setAttribute("aria-expanded", String(open));
    byId("fold").textContent = open ? "Close all" : "Open all";
  }
}
