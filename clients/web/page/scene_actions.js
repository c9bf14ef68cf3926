/* Buttons for the whole scene: undo, redo, links, files, opening and closing of all sections. */

import { byId, whileDisabled } from "../dom.js";
import { explanationOf } from "../explained.js";
import { BrokenLink, hashOf, sceneIn } from "../scene/link.js";
import { same } from "../scene/merge.js";
import { PAD_SCENE } from "../scene/start_scene.js";
import { callBinary } from "../service.js";
import { save, saveText } from "./download.js";

export class SceneActions {
  /** state: the SceneState. form: the Form. textures: the TextureList. session: the TouchSession. tell(sentence). */
  constructor({ state, form, textures, session, tell }) {
    Object.assign(this, { state, form, textures, session, tell });
    state.addEventListener("change", ({ detail }) => this.#note(detail));
    this.#on("undo", () => state.undo() && tell("Undone."));
    this.#on("redo", () => state.redo() && tell("Redone."));
    this.#on("share", () => this.#share());
    this.#on("save-wav", () => whileDisabled(byId("save-wav"), () => this.#render()));
    this.#on("save-scene", () => saveText(`${JSON.stringify(state.scene, null, 2)}\n`, "scene.json"));
    this.#on("fold", () => this.#fold());
    byId("open-scene").addEventListener("change", () => this.#read());
    document.addEventListener("keydown", (event) => this.#key(event));
    addEventListener("hashchange", () => this.#follow());
  }

  /** Returns the scene in the address of the page; null if there is none that can be read. */
  linked() {
    try {
      const scene = sceneIn(location.hash);
      return scene && this.textures.withAddress(scene);
    } catch (error) {
      if (!(error instanceof BrokenLink)) throw error;
      this.tell(explanationOf(error));
      return null;
    }
  }

  #follow() {
    const scene = this.linked();
    if (scene) this.state.take(scene, true, true);
  }

  #on(id, action) {
    byId(id).addEventListener("click", () =>
      Promise.resolve(action()).catch((error) => this.tell(explanationOf(error))),
    );
  }

  #note({ scene, settled }) {
    const [undo, redo] = [byId("undo"), byId("redo")];
    const focused = document.activeElement;
    undo.disabled = !this.state.canUndo;
    redo.disabled = !this.state.canRedo;
    if (focused === undo && undo.disabled) redo.focus(); // a disabled button loses the focus
    if (focused === redo && redo.disabled) undo.focus();
    if (settled) this.#address(scene);
  }

  /** Keeps the address of the page a link to the scene, so that a reload shows the same scene. The start scene has none.
   *  */
  #address(scene) {
    let hash = "";
    try {
      if (!same(scene, PAD_SCENE)) hash = hashOf(scene);
    } catch {
      /* too long for a link; "Copy link" reports it */
    }
    try {
      history.replaceState(null, "", hash || location.pathname + location.search);
    } catch {
      /* some browsers allow 100 calls per 30 s; the next change tries again */
    }
  }

  #key(event) {
    if (!(event.ctrlKey || event.metaKey) || event.key.toLowerCase() !== "z" || event.altKey) return;
    if (event.target.closest?.("input[type=text], input[type=password], input[type=search], textarea")) return; // undo of the text
    event.preventDefault();
    byId(event.shiftKey ? "redo" : "undo").click();
  }

  async #share() {
    history.replaceState(null, "", hashOf(this.state.scene));
    try {
      await navigator.clipboard.writeText(location.href);
      this.tell("The link is copied. It opens this scene.");
    } catch {
      this.tell("The link could not be copied. Copy it from the address bar.");
    }
  }

  async #render() {
    this.tell("Rendering the WAV.");
    const answer = await callBinary("POST", "/v1/render?format=wav", this.state.scene);
    save(await answer.blob(), "touch.wav");
    this.tell(["The WAV is ready.", this.#levelOf(answer), answer.headers.get("Ridgewave-Warning") ?? ""].join(" "));
  }

  /** Returns how loud a file is beside what was heard, as a sentence; "" if nothing was. */
  #levelOf({ headers }) {
    const heard = this.session.fingers[0]?.connection.ready?.full_scale[0];
    const written = Number(headers.get("Ridgewave-Full-Scale")?.split(",")[0]);
    if (!heard || !written) return "";
    const gain = Number((20 * Math.log10(heard / written)).toFixed(1));
    if (!gain) return "It is as loud as what you heard.";
    return `It is ${Math.abs(gain)} dB ${gain > 0 ? "louder" : "quieter"} than what you heard.`;
  }

  async #read() {
    const input = byId("open-scene");
    const [file] = input.files;
    input.value = "";
    let scene = null;
    try {
      scene = JSON.parse(await file.text());
    } catch {
      /* reported below */
    }
    if (typeof scene !== "object" || scene === null || Array.isArray(scene))
      return this.tell("This file does not contain a scene. Choose a JSON file with a scene or a recording.");
    const read = scene.format === "ridgewave-recording" ? scene.scene : scene;
    this.state.take(this.textures.withAddress(read), true, true);
  }

  #fold() {
    const open = byId("fold").getAttribute("aria-expanded") !== "true";
    this.form.open = open;
    byId("fold").setAttribute("aria-expanded", String(open));
    byId("fold").textContent = open ? "Close all" : "Open all";
  }
}
