/* How strong a vibration is, for motors that take a strength and no waveform: samples in, one number each 10 ms out.

    strength = sqrt(2) * rms / full scale

so that a sinusoid that reaches full scale is 1; below the threshold it is 0, since a motor that hums where a finger
feels nothing tells a lie.
Limits: the pitch is lost. The threshold is one amplitude for all frequencies. */

const SPAN = 0.01; // s

export class Envelope {
  #frames;
  #channels;
  #threshold;
  #sum = 0;
  #count = 0;

  /** rate: Hz. channels: of the samples, interleaved; the first is heeded. threshold: the amplitude that is just
   *  felt, and fullScale: the one that is 1.0, both in the quantity's SI unit. */
  constructor({ rate, channels = 1, threshold = 0, fullScale = 1 }) {
    this.#frames = Math.max(1, Math.round(SPAN * rate));
    this.#channels = channels;
    this.#threshold = threshold / fullScale;
  }

  /** Takes samples in units of full scale; returns the strengths, 0 to 1, of the spans that they complete. */
  push(samples) {
    const strengths = [];
    for (let place = 0; place < samples.length; place += this.#channels) {
      this.#sum += samples[place] * samples[place];
      this.#count += 1;
      if (this.#count === this.#frames) strengths.push(this.#take());
    }
    return strengths;
  }

  #take() {
    const amplitude = Math.sqrt((2 * this.#sum) / this.#count);
    this.#sum = this.#count = 0;
    return amplitude < this.#threshold ? 0 : Math.min(1, amplitude);
  }
}
