/* One stream of samples on its way to the mix: the page's side of the ring (ring.js), and a level.

Limits: what the ring reports is some 5 ms old. */

const GLIDE = 0.01; // s, time constant of volume and level: a step would click
const MOST_RUNS = 1000; // remembered one by one, the newest

export class Source {
  /** Frames given and not yet played, by the last report. */
  queued = 0;
  /** Frames played, of those that were given. */
  played = 0;
  /** How often it ran dry while it should have played, and for how many frames altogether. */
  underruns = 0;
  missing = 0;
  /** Where it sounded without a break: [context frame, frames], the newest last. */
  runs = [];
  /** Frames given, ever. */
  given = 0;
  /** Frames to be queued before sound begins after silence. */
  ahead = 0;
  /** Called with the frames played since the last call, and the report: {queued, least, ...} of ring.js. */
  onhungry = null;
  #ring;
  #gain;
  #wanted = 1;

  /** channels: of its samples. mix: the node that it plays into. */
  constructor(context, channels, mix) {
    this.context = context;
    this.channels = channels;
    this.#ring = new AudioWorkletNode(context, "ridgewave-ring", {
      numberOfInputs: 0,
      outputChannelCount: [channels],
      processorOptions: { channels },
    });
    this.#gain = new GainNode(context, {
      channelCount: channels,
      channelCountMode: "explicit",
      channelInterpretation: "discrete",
    });
    this.#ring.connect(this.#gain);
    if (channels === 1) {
      const both = new ChannelMergerNode(context, { numberOfInputs: 2 });
      this.#gain.connect(both, 0, 0).connect(mix);
      this.#gain.connect(both, 0, 1);
      this.last = both;
    } else {
      this.last = this.#gain;
      this.last.connect(mix);
    }
    this.#ring.port.onmessage = ({ data }) => this.#report(data);
  }

  /** Plays `samples` (Float32Array, channels interleaved, 1.0 = full scale) behind all that was given before. */
  play(samples) {
    const own = samples.slice();
    this.given += own.length / this.channels;
    this.queued = this.given - this.played;
    this.#ring.port.postMessage({ samples: own, ahead: this.ahead }, [own.buffer]);
  }

  /** Tells that nothing follows for now: silence behind what is queued is no underrun. */
  rest() {
    this.#ring.port.postMessage({ rest: true });
  }

  /** Gain of this source, 0 to 1. */
  get level() {
    return this.#wanted;
  }

  set level(value) {
    this.#wanted = glide(this.#gain.gain, value, this.context);
  }

  /** Ends it; what is queued is not played. */
  close() {
    this.onhungry = null;
    this.#ring.port.postMessage({ close: true });
    for (const node of [this.#ring, this.#gain, this.last]) node.disconnect();
  }

  #report(report) {
    const { played, underruns, missing, from, run } = report;
    const frames = played - this.played;
    Object.assign(this, { played, underruns, missing, queued: this.given - played });
    if (this.runs.at(-1)?.[0] === from) this.runs.at(-1)[1] = run;
    else if (this.runs.push([from, run]) > MOST_RUNS) this.runs.shift();
    if (this.onhungry) this.onhungry(frames, report);
  }
}

/** Moves `parameter` to `value`, held to 0 to 1, without a click; returns what it moves to. */
export function glide(parameter, value, context) {
  const wanted = Math.min(1, Math.max(0, Number(value) || 0));
  parameter.setTargetAtTime(wanted, context.currentTime, GLIDE);
  return wanted;
}
