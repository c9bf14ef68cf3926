/* The hash of a scene: SHA-256 of the complete scene in SI, in canonical JSON.

Model: canonical JSON has no spaces, sorted keys, and numbers as ECMAScript writes them.
Source: RFC 8785, "JSON Canonicalization Scheme".
Limits: browsers compute it on secure pages only: https or localhost. */

/** Returns the hash of a complete scene, as `POST /v1/explain` returns it: 64 hexadecimal digits; null on a page that is
 *  not secure. */
export async function hashOfScene(scene) {
  if (!globalThis.crypto?.subtle) return null;
  const digest = await crypto.subtle.digest("SHA-256", new TextEncoder().encode(canonical(scene)));
  return Array.from(new Uint8Array(digest), (byte) => byte.toString(16).padStart(2, "0")).join("");
}

/** Returns a JSON value as canonical JSON. */
export function canonical(value) {
  if (Array.isArray(value)) return `[${value.map(canonical).join()}]`;
  if (value === null || typeof value !== "object") return JSON.stringify(value);
  const pairs = Object.keys(value)
    .sort()
    .map((key) => `${JSON.stringify(key)}:${canonical(value[key])}`);
  return `{${pairs.join()}}`;
}
