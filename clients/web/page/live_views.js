/* The views of the pad page: the texture on the pad and in section under it, waveform and spectrum of the sound, and the
contact from the side.

Model: texture and contact come from `POST /v1/picture` for the newest scene. Waveform and spectrum show the finger that
touched first, before the safety limiter. Harmonics are marked at multiples of speed / period.
Limits: the contact is drawn at the load of the scene, not at that of a pen. */

import { byId } from "../dom.js";
import { mountToolbars } from "../plots/toolbar.js";
import { call } from "../service.js";
import { ContactStrip } from "../relief/contact_strip.js";
import { colour } from "../textures/material_colours.js";
import { ContactSideView } from "../views/contact_side_view.js";
import { Spectrum } from "../views/spectrum.js";
import { TextureTopView } from "../views/texture_top_view.js";
import { Waveform } from "../views/waveform.js";
import { Answer } from "./answer.js";
import { Pad } from "./pad.js";
import { Ribbon } from "./ribbon.js";

const POINTS = 1024; // heights per profile: about one per pixel, a power of two for the relief; more only costs transfer
const AREA = 128; // heights per side of an area; more only cost transfer
const PHASES = 64; // per period; height and patches are interpolated between them
const SILENCE = 480; // frames
const STILL = 150; // ms without a move until a finger counts as resting: no frequency belongs to its speed
const ENDED = 200; // ms without sound after a lift until the views show silence; blocks come every 60 ms at most
const [INSET_WIDTH, INSET_HEIGHT, INSET_GAP] = [116, 76, 12]; // CSS px of the part at true size, as in pad.css
const MOST_SIZE = 1.6; // of a footprint, so that the picture of a pen's load stays on the pad
const HARMONICS = 12; // marked; more hide the spectrum

export class LiveViews {
  /** The detection threshold, answer of `GET /v1/threshold`; null before it. */
  threshold = null;
  #request = new AbortController(); // of the newest picture
  #thresholdName = null;
  #period = null; // m, of the texture on the pad
  #middle = 0; // m, x of the middle of the finger in the picture
  #load = 0; // N, of the picture
  #heardPeriod = null; // m, of the texture that is heard
  #still = 0; // timer until the finger rests
  #ended = 0; // timer until the sound has ended

  constructor({ session, pad }) {
    Object.assign(this, { session, pad });
    this.surface = new TextureTopView(byId("surface"), { relief: true });
    byId("surface").removeAttribute("tabindex"); // the pad around it receives the keys
    byId("surface").addEventListener("zoom", ({ detail }) => {
      pad.metresPerPixel = detail.metresPerPixel;
    });
    this.waveform = new Waveform(byId("waveform"));
    this.spectrum = new Spectrum(byId("spectrum"));
    this.contact = new ContactSideView(byId("contact"));
    this.plots = mountToolbars(this);
    this.strip = new ContactStrip(byId("strip"), this.surface);
    this.ribbon = new Ribbon(byId("ribbon"));
    this.answer = new Answer(this.spectrum);
    this.plots.onFelt = (spectrum) => this.answer.tellOf(spectrum);
    new ResizeObserver(() => this.scale(pad.metresPerPixel)).observe(pad.element);
    session.addEventListener("ready", ({ detail }) => this.#warm(detail.ready), { once: true });
    session.addEventListener("block", ({ detail }) => this.#hear(detail));
  }

  /** Shows `scene`; returns false if a later scene has replaced it meanwhile. */
  async show(scene) {
    this.#request.abort(); // the service ends the picture that nobody wants any more
    this.#request = new AbortController();
    const { signal } = this.#request;
    const body = { scene, points: POINTS, phases: PHASES, area: AREA };
    const threshold = this.#loadThreshold(scene.accuracy?.threshold ?? "fingertip");
    threshold.catch(() => {}); // thrown below, after the picture
    const picture = await call("POST", "/v1/picture", body, signal).catch((error) => {
      if (!signal.aborted) throw error;
    });
    if (signal.aborted) return false;
    this.#period = picture.texture.period;
    this.#middle = picture.finger.begin + picture.finger.length / 2;
    this.#load = picture.response.load;
    colour(this.pad.element, String(scene.texture?.kind ?? ""));
    this.surface.panel.restyle();
    this.surface.show({ ...picture.texture, contactLength: picture.finger.length, finger: picture.finger });
    this.scale(this.pad.metresPerPixel);
    this.contact.show(picture);
    this.strip.show(picture);
    await threshold;
    return !signal.aborted;
  }

  /** Sets the scale of the pad, metres per CSS pixel. */
  scale(metresPerPixel) {
    const magnified = Boolean(this.surface.relief) && metresPerPixel < 0.99 * Pad.trueSize;
    const box = { bottom: this.pad.element.clientHeight - INSET_HEIGHT - INSET_GAP };
    Object.assign(box, { left: this.pad.element.clientWidth - INSET_WIDTH - INSET_GAP });
    Object.assign(box, { width: INSET_WIDTH, height: INSET_HEIGHT, metresPerPixel: Pad.trueSize });
    this.surface.inset = magnified ? box : null;
    byId("true-size").hidden = !magnified;
    this.surface.zoom(metresPerPixel);
    this.strip.scale();
  }

  /** Shows the fingers. touches: those of the Pad. */
  touch(touches) {
    const all = [...touches.values()].filter(({ position }) => position !== undefined);
    this.#place(all);
    this.plots.touch(all.length > 0);
    this.answer.hold(this.plots.lifted);
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

  /** Shows the finger of the ghost, {position, y (m), load (N; null: that of the scene)}; null: none. */
  ghost(touch) {
    this.#place(touch ? [touch] : []);
  }

  /** Shows the vibration of a stroke that nobody hears. samples: of one channel, 1.0 = `scale`, an SI value. rate: Hz. */
  silent(samples, { scale, quantity, rate }) {
    byId("waveform").closest(".views").classList.add("shown");
    this.ribbon.push(samples, rate);
    this.#draw(samples, scale, quantity, rate);
  }

  /** Shows fingers on the pad and in section. */
  #place(touches) {
    const across = (y) => 0.5 - y / (this.surface.metresPerPixel * this.surface.panel.height);
    const contacts = touches.map(({ position }) => (this.#period ? this.#contactAt(position) : null));
    this.surface.touch(
      touches.map(({ position, y = 0, load }, index) => ({
        ...{ position, across: across(y), z: contacts[index]?.z ?? null },
        size: this.#sizeAt(load),
      })),
    );
    this.strip.touch(contacts[0] ?? null);
  }

  /** Returns {position, z, patches, middle} of a finger whose middle is at `position` (m). */
  #contactAt(position) {
    const { z, patches } = this.contact.touching((this.#middle - position) / this.#period);
    return { position, z, patches, middle: this.#middle };
  }

  /** Returns the size of the footprint over that at the load of the scene: a paraboloid on a foundation grows with the
   *  fourth root of the load. */
  #sizeAt(load) {
    if (!(load > 0 && this.#load > 0)) return 1;
    return Math.min(MOST_SIZE, Math.max(1 / MOST_SIZE, (load / this.#load) ** 0.25));
  }

  async #loadThreshold(name) {
    if (name === this.#thresholdName) return;
    this.#thresholdName = name;
    try {
      this.threshold = await call("GET", `/v1/threshold?name=${name}&low=1&high=5000&points=100`);
    } catch (error) {
      this.#thresholdName = null; // the next picture asks again
      throw error;
    }
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
    this.ribbon.push(one, rate);
    this.#draw(one, scale[0], quantities[0], rate);
    this.plots.follower?.(one, scale[0], quantities[0], rate);
  }

  /** Shows silence, once no finger sounds any more: the service sends no blocks of silence. */
  #rest() {
    const sounds = this.session.fingers.some(({ touching, connection }) => touching && connection.state === "live");
    if (sounds) this.#ended = setTimeout(() => this.#rest(), ENDED);
    else for (const view of [this.waveform, this.spectrum, this.ribbon, this.plots]) view.rest();
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
