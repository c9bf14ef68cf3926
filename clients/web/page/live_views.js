/* The views of the pad page: the texture on the pad, waveform and spectrum of the sound, and the contact from the side.

Model: texture and contact come from `POST /v1/picture` for the newest scene. Waveform and spectrum show the finger that
touched first, before the safety limiter. Harmonics are marked at multiples of speed / period.
Limits: the contact is drawn at the load of the scene, not at that of a pen. */

import { byId } from "../dom.js";
import { mountToolbars } from "../plots/toolbar.js";
import { call } from "../service.js";
import { ContactSideView } from "../views/contact_side_view.js";
import { Spectrum } from "../views/spectrum.js";
import { TextureTopView } from "../views/texture_top_view.js";
import { Waveform } from "../views/waveform.js";

const POINTS = 768; // heights per profile: about one per pixel; more only costs transfer
const AREA = 128; // heights per side of an area; more only cost transfer
const PHASES = 64; // per period; height and patches are interpolated between them
const SILENCE = 480; // frames
const STILL = 150; // ms without a move until a finger counts as resting: no frequency belongs to its speed
const ENDED = 200; // ms without sound after a lift until the views show silence; blocks come every 60 ms at most
const HARMONICS = 12; // marked; more hide the spectrum

export class LiveViews {
  /** The detection threshold, answer of `GET /v1/threshold`; null before it. */
  threshold = null;
  #request = new AbortController(); // of the newest picture
  #thresholdName = null;
  #period = null; // m, of the texture on the pad
  #heardPeriod = null; // m, of the texture that is heard
  #still = 0; // timer until the finger rests
  #ended = 0; // timer until the sound has ended

  constructor({ session, pad }) {
    Object.assign(this, { session, pad });
    this.surface = new TextureTopView(byId("surface"));
    byId("surface").removeAttribute("tabindex"); // the pad around it receives the keys
    byId("surface").addEventListener("zoom", ({ detail }) => {
      pad.metresPerPixel = detail.metresPerPixel;
    });
    this.waveform = new Waveform(byId("waveform"));
    this.spectrum = new Spectrum(byId("spectrum"));
    this.contact = new ContactSideView(byId("contact"));
    this.plots = mountToolbars(this);
    session.addEventListener("ready", ({ detail }) => this.#warm(detail.ready), { once: true });
    session.addEventListener("block", ({ detail }) => this.#hear(detail));
  }

  /** Shows `scene`; returns false if a later scene has replaced it meanwhile. */
  async show(scene) {
    this.#request.abort(); // the service ends the picture that nobody wants any more
    this.#request = new AbortController();
    const { signal } = this.#request;
    const body = { scene, points: POINTS, phases: PHASES, area: AREA };
    const picture = await call("POST", "/v1/picture", body, signal).catch((error) => {
      if (!signal.aborted) throw error;
    });
    if (signal.aborted) return false;
    this.#period = picture.texture.period;
    this.surface.show({ ...picture.texture, contactLength: picture.finger.length });
    this.surface.zoom(this.pad.metresPerPixel);
    this.contact.show(picture);
    await this.#loadThreshold(scene.accuracy?.threshold ?? "fingertip");
    return !signal.aborted;
  }

  /** Sets the scale of the pad, metres per CSS pixel. */
  scale(metresPerPixel) {
    this.surface.zoom(metresPerPixel);
  }

  /** Shows the fingers. touches: those of the Pad. */
  touch(touches) {
    const all = [...touches.values()].filter(({ position }) => position !== undefined);
    const across = (y) => 0.5 - y / (this.surface.metresPerPixel * this.surface.panel.height);
    this.surface.touch(all.map(({ position, y = 0 }) => ({ position, across: across(y) })));
    this.plots.touch(all.length > 0);
    clearTimeout(this.#still);
    if (all.length) this.#still = setTimeout(() => this.spectrum.mark([]), STILL);
    else this.spectrum.mark([]);
    if (!all.length || !this.#period) return;
    this.#heardPeriod ??= this.#period;
    const [{ position, speed }] = all;
    this.contact.at((((-position / this.#period) % 1) + 1) % 1); // the texture moves opposite to the finger
    if (this.session.soundStatus !== "pending") this.#heardPeriod = this.#period; // marks belong to the sound
    const fundamental = Math.abs(speed) / this.#heardPeriod;
    if (fundamental > 1) this.waveform.expect(fundamental);
    this.spectrum.mark(
      fundamental > 1 ? Array.from({ length: HARMONICS }, (_, index) => (index + 1) * fundamental) : [],
    );
  }

  async #loadThreshold(name) {
    if (name === this.#thresholdName) return;
    this.#thresholdName = name;
    this.threshold = await call("GET", `/v1/threshold?name=${name}&low=1&high=5000&points=100`);
    this.spectrum.threshold(this.threshold);
  }

  #hear({ frame, unlimited: samples, ready, finger }) {
    if (finger !== (this.session.fingers.find(({ touching }) => touching) ?? this.session.fingers[0])) return;
    const { channels, quantities, full_scale: scale, sample_rate: rate } = ready;
    const one = channels === 1 ? samples : samples.filter((_, index) => index % channels === 0);
    byId("waveform").closest(".views").classList.add("live");
    clearTimeout(this.#ended);
    this.#ended = setTimeout(() => this.#rest(), ENDED);
    this.plots.hear({ frame, frames: one.length, ready, finger });
    this.#draw(one, scale[0], quantities[0], rate);
    this.plots.follower?.(one, scale[0], quantities[0], rate);
  }

  /** Shows silence, once no finger sounds any more: the service sends no blocks of silence. */
  #rest() {
    const sounds = this.session.fingers.some(({ touching, connection }) => touching && connection.state === "live");
    if (sounds) this.#ended = setTimeout(() => this.#rest(), ENDED);
    else for (const view of [this.waveform, this.spectrum, this.plots]) view.rest();
  }

  /** Draws silence before the sound begins: the first drawing is slow and would interrupt the sound. */
  #warm({ quantities, full_scale: scale, sample_rate: rate }) {
    this.#draw(new Float32Array(SILENCE), scale[0], quantities[0], rate);
  }

  #draw(...heard) {
    this.waveform.push(...heard);
    this.spectrum.push(...heard);
  }
}
