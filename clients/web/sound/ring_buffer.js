/* The processors of the audio thread: a ring buffer that plays samples, and a tap that records them for tests.

Model: the ring buffer plays all samples unchanged and in order. While it is empty it plays zeros. After the message
`rest` these zeros are silence; otherwise they are an underrun, and are counted. After silence, sound begins when
`ahead` frames are queued or when `rest` says that no more follow. Nothing is dropped: the credit limits the queue.
Messages in: {samples: Float32Array, interleaved, ahead}, {rest: true} or {close: true}.
Messages out: {played, queued, least, underruns, missing, from, run}, every REPORT frames of sound and at each change
between sound and zeros. All are in frames: `least` is the shortest queue since the last report, `missing` the zeros of
all underruns, `from` the context frame at which the present or last uninterrupted run of samples began, `run` its
length.
Limits: a run begins with a quantum of 128 frames; it may end within one. */

const REPORT = 256; // frames between reports, 5 ms at 48 kHz; more delays credit, fewer cost messages

class RingBuffer extends AudioWorkletProcessor {
  constructor({ processorOptions }) {
    super();
    this.channels = processorOptions.channels;
    this.waiting = []; // interleaved arrays
    this.offset = 0; // frames of the first array that were played
    this.queued = this.played = this.underruns = this.missing = this.unreported = 0;
    this.least = Infinity;
    this.from = this.run = this.ahead = 0;
    this.sounding = false; // the last frame was a sample
    this.ending = true; // `rest`: no samples follow the queue
    this.resting = true; // zeros are silence, not an underrun
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

  /** Counts `frames` zeros at the end of this quantum or in place of skipped quanta. lacking: whether samples were
   *  expected. */
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

/** Passes its input on and records it. {take: true} in; {first, samples: interleaved} since the last one out. */
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
    this.frames = currentFrame - this.first; // quanta that the browser skipped are zeros
    this.reserve(frames);
    for (let channel = 0; channel < this.channels; channel += 1) {
      if (!input[channel]) continue; // no input: the zeros of `reserve` remain
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

registerProcessor("ridgewave-ring", RingBuffer);
registerProcessor("ridgewave-tap", Tap);
