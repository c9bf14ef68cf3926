/* A scene as a link, and back: "#scene=" and the scene's JSON as base64url without padding.

Limits: the hash never leaves the browser; browsers keep at least 64,000 characters of it, so a longer trajectory is
refused: such a scene is handed on as a file. */

const NAME = "#scene=";
const LONGEST = 32000; // characters of a link that messengers and browsers pass on whole

/** The link's text is no scene; the message is a sentence for people. */
export class BrokenLink extends Error {}

/** The hash that stands for `scene`. Throws BrokenLink where it would be too long to be passed on. */
export function hashOf(scene) {
  const bytes = new TextEncoder().encode(JSON.stringify(scene));
  const hash =
    NAME +
    btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(""))
      .replace(/\+/g, "-")
      .replace(/\//g, "_")
      .replace(/=+$/, "");
  if (hash.length > LONGEST) throw new BrokenLink("This scene is too long for a link: download it and send the file.");
  return hash;
}

/** The scene in `hash`; null where it holds none. Throws BrokenLink where what it holds cannot be read. */
export function sceneIn(hash) {
  if (!hash.startsWith(NAME)) return null;
  let scene;
  try {
    const text = atob(hash.slice(NAME.length).replace(/-/g, "+").replace(/_/g, "/"));
    scene = JSON.parse(
      new TextDecoder("utf-8", { fatal: true }).decode(Uint8Array.from(text, (letter) => letter.charCodeAt(0))),
    );
  } catch {
    scene = null;
  }
  if (typeof scene !== "object" || scene === null || Array.isArray(scene)) {
    throw new BrokenLink("The scene in this link cannot be read: ask for the link again; the default scene is shown.");
  }
  return scene;
}
