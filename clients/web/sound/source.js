/* One stream of samples: the page's side of the ring buffer, and a level.

Limits: the reports of the ring buffer are up to 5 ms old. */

const GLIDE = 0.01; // s, time constant of volume and level; a step would click
const MOST_RUNS = 1000; // newest runs that are kept

export class Source {
  /** Frames queued and not played yet, by the last report. */
  queued = 0;
  /** Frames played. */
  played = 0;
  /** Number of underruns, and their frames. */
  underruns = 0;
  missing = 0;
  /** Uninterrupted runs: [context frame, frames], the newest last. */
  runs = [];
  /** Frames passed to `play`. */
  given = 0;
  /** Frames that must be queued before sound begins after silence. */
  ahead = 0;
  /** Called at each report with the frames played since the last one, and the report (ring_buffer.js). */
  onreport = null;
  #ring;
  #gain;
  #wanted = 1;

  /** channels: of the samples. mix: node that receives them. */
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

  /** Queues `samples`: Float32Array, channels interleaved, 1.0 = full scale. */
  play(samples) {
    const own = samples.slice();
    this.given += own.length / this.channels;
    this.queued = this.given - this.played;
    this.#ring.port.postMessage({ samples: own, ahead: this.ahead }, [own.buffer]);
  }

  /** Says that no samples follow for now: silence after the queue is not an underrun. */
  rest() {
    this.#ring.port.postMessage({ rest: true });
  }

  /** Gain, 0 to 1. */
  get level() {
    return this.#wanted;
  }

  set level(value) {
    this.#wanted = glide(this.#gain.gain, value, this.context);
  }

  /** Closes the source. Queued samples are not played. */
  close() {
    this.onreport = null;
    this.#ring.port.postMessage({ close: true });
    for (const node of [this.#ring, this.#gain, this.last]) node.disconnect();
  }

  #report(report) {
    const { played, underruns, missing, from, run } = report;
    const frames = played - this.played;
    Object.assign(this, { played, underruns, missing, queued: this.given - played });
    if (this.runs.at(-1)?.[0] === from) this.runs.at(-1)[1] = run;
    else if (this.runs.push([from, run]) > MOST_RUNS) this.runs.shift();
    if (this.onreport) this.onreport(frames, report);
  }
}

/** Moves `parameter` to `value`, limited to 0 to 1, without a click; returns the new value. */
export function glide(parameter, value, context) {
  const wanted = Math.min(1, Math.max(0, Number(value) || 0));
  parameter.setTargetAtTime(wanted, context.currentTime, GLIDE);
  return wanted;
}
