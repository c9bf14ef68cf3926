/* What the page shows: the surface on the pad, waveform and spectrum of what plays, and where finger and texture touch.

Model: pictures are of the complete scene; the newest answer counts. Waveform and spectrum follow the finger that
touches first. Harmonics are marked at multiples of speed / period.
Limits: the picture is at the scene's load; a pen that presses harder or softer than the dial is not drawn so. */

import { byId } from "../knobs/element.js";
import { call } from "../service.js";
import { ContactPicture } from "../sight/contact.js";
import { Spectrum } from "../sight/spectrum.js";
import { Surface } from "../sight/surface.js";
import { Waveform } from "../sight/waveform.js";

const POINTS = 1024; // of a surface: a pixel each on most screens; more is only sent
const PHASES = 128; // of a period: between them the height of the finger is interpolated
const SILENCE = 480; // frames
const HARMONICS = 12; // marked; more would hide the spectrum

export class Sight {
  /** What is just felt, as the service tells it; null before. */
  felt = null;
  #asked = 0;
  #threshold = null;
  #period = null;
  #heard = null; // period of the texture that plays, m

  constructor({ session, pad }) {
    Object.assign(this, { session, pad });
    this.surface = new Surface(byId("surface"));
    byId("surface").removeAttribute("tabindex"); // the pad around it takes the keys
    byId("surface").addEventListener("zoom", ({ detail }) => {
      pad.metresPerPixel = detail.metresPerPixel;
    });
    this.waveform = new Waveform(byId("waveform"));
    this.spectrum = new Spectrum(byId("spectrum"));
    this.contact = new ContactPicture(byId("contact"));
    session.addEventListener("ready", ({ detail }) => this.#warm(detail.ready), { once: true });
    session.addEventListener("block", ({ detail }) => this.#hear(detail));
  }

  /** Show the surfaces of `scene`; returns whether they are shown: false where a later scene has taken their place. */
  async look(scene) {
    this.#asked += 1;
    const asked = this.#asked;
    const overtaken = () => asked !== this.#asked;
    const picture = await call("POST", "/v1/picture", { scene, points: POINTS, phases: PHASES }).catch((error) => {
      if (!overtaken()) throw error;
    });
    if (overtaken()) return false;
    this.#period = picture.texture.period;
    this.surface.show({ ...picture.texture, contactLength: picture.finger.length });
    this.surface.zoom(this.pad.metresPerPixel);
    this.contact.show(picture);
    await this.#limits(scene.accuracy?.threshold ?? "fingertip");
    return !overtaken();
  }

  /** The pad's scale is another: metres a CSS pixel. */
  scale(metresPerPixel) {
    this.surface.zoom(metresPerPixel);
  }

  /** The fingers are elsewhere: `touches` as of the Pad. */
  touch(touches) {
    const all = [...touches.values()].filter(({ position }) => position !== undefined);
    this.surface.touch(all.map(({ position }) => position));
    if (!all.length || !this.#period) return;
    this.#heard ??= this.#period;
    const [{ position, speed }] = all;
    this.contact.at((((-position / this.#period) % 1) + 1) % 1); // the surface moves as the finger does not
    if (this.session.agreement !== "coming") this.#heard = this.#period; // ticks are those of what plays
    const fundamental = Math.abs(speed) / this.#heard;
    if (fundamental > 1) this.waveform.expect(fundamental);
    this.spectrum.mark(
      fundamental > 1 ? Array.from({ length: HARMONICS }, (_, index) => (index + 1) * fundamental) : [],
    );
  }

  async #limits(name) {
    if (name === this.#threshold) return;
    this.#threshold = name;
    this.felt = await call("GET", `/v1/threshold?name=${name}&low=1&high=5000&points=100`);
    this.spectrum.threshold(this.felt);
  }

  #hear({ samples, ready, finger }) {
    if (finger !== (this.session.fingers.find(({ touching }) => touching) ?? this.session.fingers[0])) return;
    const { channels, quantities, full_scale: scale, sample_rate: rate } = ready;
    const one = channels === 1 ? samples : samples.filter((_, index) => index % channels === 0);
    byId("waveform").closest(".views").classList.add("live");
    this.#draw(one, scale[0], quantities[0], rate);
  }

  /** Draws a silence, once, before anything sounds: a first drawing holds up the page, and the sound with it. */
  #warm({ quantities, full_scale: scale, sample_rate: rate }) {
    this.#draw(new Float32Array(SILENCE), scale[0], quantities[0], rate);
  }

  #draw(...heard) {
    this.waveform.push(...heard);
    this.spectrum.push(...heard);
  }
}
