/* What runs in the audio thread: a queue of samples that plays each of them once, and a tap for whoever checks it.

The ring plays what came, bit for bit and in order. Where it has nothing it plays zeros and counts them: between `rest`
and the next samples that is silence as asked for, else it is an underrun. After silence it begins once `ahead` frames
are queued, so that a slow start is not a broken one, or once nothing more follows. Nothing is dropped: the bound of the
queue is the credit that was granted for it.
Messages in: {samples: Float32Array interleaved, ahead} or {rest: true} or {close: true}. Messages out: {played, queued,
least, underruns, missing, from, run}, every REPORT frames while it plays and at each change between sound and zeros.
All are in frames: `least` is the shortest that the queue was since the last report, `missing` all zeros of underruns,
`from` the context frame at which the present run of samples began, or the last, and `run` its length.
Limits: a run begins with a quantum of 128 frames; it may end within one. */

const REPORT = 256; // frames between reports: 5 ms at 48 kHz; more is a longer wait for credit, fewer is more messages

class Ring extends AudioWorkletProcessor {
  constructor({ processorOptions }) {
    super();
    this.channels = processorOptions.channels;
    this.waiting = []; // interleaved arrays
    this.offset = 0; // into the first of them
    this.queued = this.played = this.underruns = this.missing = this.unreported = 0;
    this.least = Infinity;
    this.from = this.run = this.ahead = 0;
    this.sounding = false; // the last frame was a sample
    this.ending = true; // nothing is to follow what is queued
    this.resting = true; // zeros are as asked for
    this.open = true;
    this.port.onmessage = ({ data }) => this.take(data);
  }

  take({ samples, ahead, rest, close }) {
    if (samples?.length) {
      this.waiting.push(samples);
      this.queued += samples.length / this.channels;
      this.ahead = ahead;
      this.ending = false;
    }
    if (rest) {
      this.ending = true;
      this.resting ||= !this.sounding;
    }
    if (close) this.open = false;
  }

  process(_, [output]) {
    const frames = output[0].length;
    const waits = !this.sounding && !this.ending && this.queued < this.ahead;
    const filled = waits ? 0 : Math.min(frames, this.queued);
    const due = this.from + this.run;
    if (this.sounding && currentFrame !== due) this.runOut(currentFrame - due, this.queued > 0 || !this.ending);
    const begins = filled > 0 && !this.sounding;
    if (begins) Object.assign(this, { sounding: true, resting: false, from: currentFrame, run: 0 });
    this.fill(output, filled);
    if (filled < frames) this.runOut(frames - filled);
    else if (begins || this.unreported >= REPORT) this.report();
    return this.open;
  }

  /** Copies `frames` frames from the queue to the start of `output`. */
  fill(output, frames) {
    const { channels } = this;
    for (let done = 0; done < frames; ) {
      const samples = this.waiting[0];
      const count = Math.min(frames - done, samples.length / channels - this.offset);
      for (let channel = 0; channel < channels; channel += 1) {
        const into = output[channel];
        let from = this.offset * channels + channel;
        for (let frame = done; frame < done + count; frame += 1, from += channels) into[frame] = samples[from];
      }
      done += count;
      this.offset += count;
      if (this.offset * channels === samples.length) {
        this.waiting.shift();
        this.offset = 0;
      }
    }
    this.queued -= frames;
    this.played += frames;
    this.run += frames;
    this.unreported += frames;
    this.least = Math.min(this.least, this.queued);
  }

  /** Notes that `frames` zeros stand at the end of this quantum, or where the browser left quanta out; lacking: they
   *  should have been samples. */
  runOut(frames, lacking = !this.ending) {
    if (lacking && !this.resting) {
      if (this.sounding) this.underruns += 1;
      this.missing += frames;
    }
    if (!this.sounding) return;
    this.resting = this.ending;
    this.sounding = false;
    this.report();
  }

  report() {
    const { played, queued, least, underruns, missing, from, run } = this;
    this.port.postMessage({ played, queued, least, underruns, missing, from, run });
    this.least = Infinity;
    this.unreported = 0;
  }
}

/** Passes its input on, and keeps it: {take: true} in, {first, samples: interleaved} out, since the last. */
class Tap extends AudioWorkletProcessor {
  constructor({ processorOptions }) {
    super();
    this.channels = processorOptions.channels;
    this.room = new Float32Array(this.channels << 16);
    this.frames = 0;
    this.first = -1;
    this.open = true;
    this.port.onmessage = ({ data }) => {
      if (data.close) this.open = false;
      else this.give();
    };
  }

  process([input], [output]) {
    const frames = output[0].length;
    if (this.first < 0) this.first = currentFrame;
    this.frames = currentFrame - this.first; // quanta that the browser left out are zeros
    this.reserve(frames);
    for (let channel = 0; channel < this.channels; channel += 1) {
      if (!input[channel]) continue; // nothing is connected: the zeros of `reserve` stay
      output[channel].set(input[channel]);
      for (let frame = 0; frame < frames; frame += 1) {
        this.room[(this.frames + frame) * this.channels + channel] = input[channel][frame];
      }
    }
    this.frames += frames;
    return this.open;
  }

  reserve(frames) {
    if ((this.frames + frames) * this.channels <= this.room.length) return;
    const larger = new Float32Array(2 * this.room.length);
    larger.set(this.room);
    this.room = larger;
  }

  give() {
    const samples = this.room.slice(0, this.frames * this.channels);
    this.port.postMessage({ first: this.first, samples }, [samples.buffer]);
    this.room.fill(0, 0, samples.length);
    this.first += this.frames;
    this.frames = 0;
  }
}

registerProcessor("ridgewave-ring", Ring);
registerProcessor("ridgewave-tap", Tap);
