/* Scenes as links: "#scene=" and the JSON of the scene as base64url without padding.

Limits: browsers and messengers shorten long links, so longer scenes (with a trajectory, for example) are refused. */

import { Explained } from "../explained.js";

const NAME = "#scene=";
const LONGEST = 32000; // characters of a link that messengers and browsers keep

/** A link without a readable scene, or a scene too long for a link. */
export class BrokenLink extends Explained {}

/** Returns the hash of a link to `scene`. Throws BrokenLink if it is too long. */
export function hashOf(scene) {
  const bytes = new TextEncoder().encode(JSON.stringify(scene));
  const hash =
    NAME +
    btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(""))
      .replace(/\+/g, "-")
      .replace(/\//g, "_")
      .replace(/=+$/, "");
  if (hash.length > LONGEST) throw new BrokenLink("This scene is too long for a link. Download it and send the file.");
  return hash;
}

/** Returns the scene in `hash`; null if it has none. Throws BrokenLink if it cannot be read. */
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
    throw new BrokenLink("The scene in this link cannot be read. Ask for the link again.");
  }
  return scene;
}
