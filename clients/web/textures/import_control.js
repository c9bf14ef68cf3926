/* The two ways to import a file: choose it beside the menu of textures, or drop it on the page. */

import { byId } from "../dom.js";
import { orTell } from "../page/notice.js";

/** Opens the import of a chosen or dropped file. onKept(name): called after the texture is kept. tell(sentence). */
export function wireImport({ onKept, tell }) {
  const input = byId("import");
  const open = async (files) => {
    if (files.length !== 1) return tell("Drop one file.");
    const loaded = await orTell(import("./import_dialog.js"));
    return loaded && new loaded.ImportDialog(files[0], onKept).open();
  };
  input.addEventListener("change", () => {
    open([...input.files]);
    input.value = ""; // the same file can be chosen again
  });
  const mark = (dropping) => document.body.toggleAttribute("data-dropping", dropping);
  const onFile = (action) => (event) => {
    if (!event.dataTransfer?.types.includes("Files")) return;
    event.preventDefault(); // the browser would open the file instead of the page
    if (!document.querySelector("dialog")) action(event.dataTransfer.files);
  };
  addEventListener(
    "dragover",
    onFile(() => mark(true)),
  );
  addEventListener("dragleave", ({ relatedTarget }) => {
    if (!relatedTarget) mark(false);
  });
  addEventListener(
    "drop",
    onFile((files) => {
      mark(false);
      open([...files]);
    }),
  );
}
