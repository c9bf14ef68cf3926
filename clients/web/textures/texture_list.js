/* The textures of the service: the catalogue, and what was imported with the key of the page.

Model: an entry is one of `GET /v1/textures`; `stored` marks an imported one. A scene of the page holds the address of an
imported surface, not its name, so that it means the same after the texture has another name.
Events: "change": the imported textures have changed. */

import { call } from "../service.js";

const pathOf = (name) => `/v1/textures/${encodeURIComponent(name)}`;

/** Returns the address of a `texture` of a scene, null if it has none. */
const addressOf = (texture) => texture?.surface ?? null;

/** Returns `entries` without the lines, drawn out across the scan, of surfaces that are there as areas. */
export function offered(entries) {
  const names = new Set(entries.map(({ name }) => name));
  return entries.filter(({ name }) => !names.has(`${name}-area`));
}

export class TextureList extends EventTarget {
  #entries;

  /** entries: of `GET /v1/textures`. */
  constructor(entries) {
    super();
    this.#entries = entries;
  }

  get entries() {
    return this.#entries;
  }

  /** The entries to choose from. */
  get offered() {
    return offered(this.#entries);
  }

  /** Returns the entries that `texture`, a section of a scene, can come from. */
  of(texture) {
    return this.#entries.filter(
      ({ name, address }) => name === texture?.kind || (address !== undefined && address === addressOf(texture)),
    );
  }

  /** Returns `scene` with the address of its surface in place of the name of an imported texture. */
  withAddress(scene) {
    const named = this.#entries.find(({ name, stored }) => stored && name === scene.texture?.kind);
    if (!named) return scene;
    return { ...scene, texture: { ...scene.texture, ...named.scene.texture } };
  }

  async reload() {
    this.#entries = (await call("GET", "/v1/textures")).textures;
    this.dispatchEvent(new CustomEvent("change"));
  }

  async rename(name, newName) {
    await call("PATCH", pathOf(name), { name: newName });
    await this.reload();
  }

  async remove(name) {
    await call("DELETE", pathOf(name));
    await this.reload();
  }
}
