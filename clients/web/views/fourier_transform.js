/* Fast Fourier transform of real samples, with a flat-top window.

Model: the window HFT90D of Heinzel, Rüdiger and Schilling (2002). A sinusoid of amplitude A has the height A to 0.04 %,
wherever it lies between two bins. In return a line is 5 bins wide to each side.
Source: G. Heinzel et al., "Spectrum and spectral density estimation by the DFT", 2002, appendix D.
Limits: the size is a power of two, at least 4. Lines closer than 5 bins overlap, and the lowest 5 bins contain the
mean. */

const WINDOW = [1, -1.942604, 1.340318, -0.440811, 0.043097];

/** Width of a line, bins to each side. */
export const LINE_WIDTH = 5;

export class FourierTransform {
  #cosines;
  #sines;
  #order;
  #window;
  #real;
  #imaginary;

  constructor(size) {
    if (size < 4 || size & (size - 1))
      throw new RangeError("The size of a transform must be a power of two, at least 4.");
    this.size = size;
    const half = size / 2;
    this.#cosines = Float64Array.from({ length: half }, (_, index) => Math.cos((2 * Math.PI * index) / size));
    this.#sines = Float64Array.from({ length: half }, (_, index) => -Math.sin((2 * Math.PI * index) / size));
    this.#order = new Uint32Array(half);
    for (let index = 1; index < half; index++) {
      this.#order[index] = (this.#order[index >> 1] >> 1) | (index & 1 ? half >> 1 : 0);
    }
    this.#window = Float64Array.from({ length: size }, (_, index) =>
      WINDOW.reduce((sum, part, order) => sum + part * Math.cos((2 * Math.PI * order * index) / size), 0),
    );
    this.#real = new Float64Array(half);
    this.#imaginary = new Float64Array(half);
  }

  /** Returns {real, imaginary}, size / 2 + 1 values each: sum over n of samples[n] exp(-2 pi i k n / size). */
  complex(samples, window = null) {
    const half = this.size / 2;
    const [re, im] = [this.#real, this.#imaginary];
    for (let index = 0; index < half; index++) {
      const from = 2 * this.#order[index];
      re[index] = window ? samples[from] * window[from] : samples[from];
      im[index] = window ? samples[from + 1] * window[from + 1] : samples[from + 1];
    }
    this.#butterflies(re, im);
    const real = new Float64Array(half + 1);
    const imaginary = new Float64Array(half + 1);
    real[0] = re[0] + im[0];
    real[half] = re[0] - im[0];
    for (let k = 1; k < half; k++) {
      // even samples are the real, odd samples the imaginary part of one transform of half the size
      const evenReal = (re[k] + re[half - k]) / 2;
      const evenImaginary = (im[k] - im[half - k]) / 2;
      const oddReal = (im[k] + im[half - k]) / 2;
      const oddImaginary = (re[half - k] - re[k]) / 2;
      const [c, s] = [this.#cosines[k], this.#sines[k]];
      real[k] = evenReal + c * oddReal - s * oddImaginary;
      imaginary[k] = evenImaginary + c * oddImaginary + s * oddReal;
    }
    return { real, imaginary };
  }

  /** Returns the amplitudes (unit of the samples) of sinusoids at the bins k rate / size, k = 0 to size / 2. */
  amplitudes(samples) {
    const { real, imaginary } = this.complex(samples, this.#window);
    const amplitudes = new Float64Array(real.length);
    for (let k = 0; k < real.length; k++) {
      amplitudes[k] = (2 / this.size) * Math.hypot(real[k], imaginary[k]);
    }
    amplitudes[0] /= 2;
    amplitudes[amplitudes.length - 1] /= 2;
    return amplitudes;
  }

  #butterflies(re, im) {
    const length = re.length;
    const [cosines, sines] = [this.#cosines, this.#sines];
    for (let width = 1; width < length; width *= 2) {
      const stride = length / width; // in the tables, which have `size` steps per turn
      for (let begin = 0; begin < length; begin += 2 * width) {
        for (let index = 0; index < width; index++) {
          const [a, b] = [begin + index, begin + index + width];
          const c = cosines[index * stride];
          const s = sines[index * stride];
          const partReal = re[b] * c - im[b] * s;
          const partImaginary = re[b] * s + im[b] * c;
          re[b] = re[a] - partReal;
          im[b] = im[a] - partImaginary;
          re[a] += partReal;
          im[a] += partImaginary;
        }
      }
    }
  }
}

/** Returns {amplitude (unit of the samples), frequency (Hz)} of the largest line above `least` Hz. */
export function largestLine(amplitudes, rate, least = 0) {
  const size = 2 * (amplitudes.length - 1);
  let best = Math.max(LINE_WIDTH, Math.ceil((least * size) / rate));
  for (let k = best; k < amplitudes.length; k++) if (amplitudes[k] > amplitudes[best]) best = k;
  let [weight, sum] = [0, 0];
  for (let k = best - LINE_WIDTH + 1; k < best + LINE_WIDTH; k++) {
    const power = (amplitudes[k] ?? 0) ** 2; // the window is symmetric: the centre of its power is the line
    weight += power;
    sum += k * power;
  }
  return { amplitude: amplitudes[best] ?? 0, frequency: weight ? ((sum / weight) * rate) / size : 0 };
}
