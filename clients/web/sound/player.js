/* The sound card as the page uses it: sources that play blocks of samples, mixed, one master volume, one output.

    source (ring, level) -> mix -> channels of the device -> volume -> destination

At level 1 the mix holds the very samples that were given. Volume and levels move without clicks, within some 50 ms.
Limits: to be opened in a click or a key press, else the browser keeps it silent. The output device can be chosen where
the browser can (`canChooseOutput`). What lies behind the browser's `outputLatency` (a Bluetooth link, an amplifier) is not
known to it. */

import { Depth } from "./depth.js";

const QUIET = 0.1; // volume at first: vibration made for an actuator is loud in headphones
const GLIDE = 0.01; // s, time constant of volume and level
const MOST_RUNS = 1000; // remembered one by one, the newest

/** One stream of samples on its way to the mix. */
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
  /** Called with the frames played since the last call, and the report: {queued, least, ...} of ring.js. */
  onhungry = null;
  #ring;
  #gain;

  constructor(context, channels, mix) {
    this.context = context;
    this.channels = channels;
    this.#ring = new AudioWorkletNode(context, "ridgewave-ring", {
      numberOfInputs: 0, outputChannelCount: [channels], processorOptions: { channels },
    });
    this.#gain = new GainNode(context, { channelCount: channels, channelCountMode: "explicit", channelInterpretation: "discrete" });
    this.#ring.connect(this.#gain);
    if (channels === 1) {
      const both = new ChannelMergerNode(context, { numberOfInputs: 2 });
      this.#gain.connect(both, 0, 0).connect(mix);
      this.#gain.connect(both, 0, 1);
      this.last = both;
    } else {
      this.last = this.#gain.connect(mix) && this.#gain;
    }
    this.#ring.port.onmessage = ({ data }) => this.#report(data);
  }

  /** Plays `samples` (Float32Array, channels interleaved, 1.0 = full scale) behind all that was given before. */
  play(samples) {
    const own = samples.slice();
    this.given += own.length / this.channels;
    this.queued = this.given - this.played;
    this.#ring.port.postMessage({ samples: own }, [own.buffer]);
  }

  /** Tells that nothing follows for now: silence behind what is queued is no underrun. */
  rest() {
    this.#ring.port.postMessage({ rest: true });
  }

  /** Gain of this source, 0 to 1. */
  get level() {
    return this.wanted ?? 1;
  }

  set level(value) {
    this.wanted = glide(this.#gain.gain, value, this.context);
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

/** The output: `await Player.open()` in a click. */
export class Player {
  #sources = new Set();
  #wanted = QUIET;
  #channels = [0, 1];
  #routing = [];
  /** How much is kept queued, for all sources: what the machine and the network bear. */
  depth;

  /** Returns a player that runs. sampleRate: Hz, that of the scene. latencyHint: as of AudioContext. */
  static async open({ sampleRate = 48000, latencyHint = "interactive" } = {}) {
    const context = new AudioContext({ sampleRate, latencyHint });
    try {
      await context.audioWorklet.addModule(new URL("./ring.js", import.meta.url));
      await context.resume();
    } catch (error) {
      await context.close();
      throw error;
    }
    return new Player(context);
  }

  constructor(context) {
    this.context = context;
    this.depth = new Depth(context.sampleRate);
    const discrete = { channelCount: 2, channelCountMode: "explicit", channelInterpretation: "discrete" };
    this.mix = new GainNode(context, discrete);
    this.master = new GainNode(context, { gain: QUIET, channelInterpretation: "discrete" });
    context.destination.channelInterpretation = "discrete";
    this.master.connect(context.destination);
    this.#route();
  }

  /** Hz. */
  get sampleRate() {
    return this.context.sampleRate;
  }

  /** Returns a new Source of so many channels. */
  source(channels) {
    const source = new Source(this.context, channels, this.mix);
    const close = source.close.bind(source);
    source.close = () => this.#sources.delete(source) && close();
    this.#sources.add(source);
    return source;
  }

  /** Master volume, 0 to 1; 0.1 at first. */
  get volume() {
    return this.#wanted;
  }

  set volume(value) {
    this.#wanted = glide(this.master.gain, value, this.context);
  }

  /** s from the audio thread to the loudspeaker, as far as the browser knows. */
  get outputLatency() {
    return this.context.outputLatency || this.context.baseLatency || 0;
  }

  /** s: how long what is given now takes to be heard: output latency plus the longest queue. */
  get latency() {
    const queued = Math.max(0, ...[...this.#sources].map((source) => source.queued));
    return this.outputLatency + queued / this.sampleRate;
  }

  /** Whether the browser lets a page choose the output device. */
  get canChooseOutput() {
    return "setSinkId" in this.context;
  }

  /** Returns the output devices as {id, label}; none where the browser does not tell. Labels may be empty. */
  async outputs() {
    if (!this.canChooseOutput || !navigator.mediaDevices) return [];
    const devices = await navigator.mediaDevices.enumerateDevices();
    return devices.filter(({ kind }) => kind === "audiooutput").map(({ deviceId, label }) => ({ id: deviceId, label }));
  }

  /** Plays on the device of that id, "" for the usual one; throws where the browser cannot. */
  async useOutput(id) {
    if (!this.canChooseOutput) throw new Error("This browser plays on the system's output only: choose it in the system.");
    await this.context.setSinkId(id);
    this.#route();
  }

  /** How many channels the output device has. */
  get outputChannels() {
    return this.context.destination.maxChannelCount;
  }

  /** Plays channel i of the sound on channel channels[i] of the device, from 0; one channel sounds on both of the first. */
  useChannels(channels) {
    const wrong = channels.find((channel) => !Number.isInteger(channel) || channel < 0 || channel >= this.outputChannels);
    if (wrong !== undefined) {
      throw new RangeError(`The output has channels 0 to ${this.outputChannels - 1}: choose among them, not ${wrong}.`);
    }
    this.#channels = [...channels];
    this.#route();
  }

  /** Returns a recorder of what leaves the mix, or the volume: `await take()` gives a Float32Array, `channels` interleaved,
   *  of all that was played since the last, and `first` is then the context frame that it begins with. */
  tap(place = "mix") {
    const node = place === "mix" ? this.mix : this.master;
    return new Tap(this.context, node);
  }

  /** Ends all sound, for good. */
  async close() {
    for (const source of this.#sources) source.close();
    await this.context.close();
  }

  #route() {
    const [before] = this.#routing;
    if (before) this.mix.disconnect(before);
    for (const node of this.#routing) node.disconnect();
    const { destination } = this.context;
    const count = Math.min(destination.maxChannelCount, Math.max(2, ...this.#channels.map((channel) => channel + 1)));
    destination.channelCount = count;
    this.mix.channelCount = Math.max(2, this.#channels.length);
    const splitter = new ChannelSplitterNode(this.context, { numberOfOutputs: this.mix.channelCount });
    const merger = new ChannelMergerNode(this.context, { numberOfInputs: count });
    this.#channels.forEach((channel, index) => splitter.connect(merger, index, Math.min(channel, count - 1)));
    this.mix.connect(splitter);
    merger.connect(this.master);
    this.#routing = [splitter, merger];
  }
}

class Tap {
  channels = 2;
  first = -1;

  constructor(context, node) {
    this.node = new AudioWorkletNode(context, "ridgewave-tap", {
      channelCount: 2, channelCountMode: "explicit", channelInterpretation: "discrete",
      outputChannelCount: [2], processorOptions: { channels: 2 },
    });
    this.muted = new GainNode(context, { gain: 0 }); // what leads nowhere is not run
    node.connect(this.node).connect(this.muted).connect(context.destination);
  }

  take() {
    return new Promise((resolve) => {
      this.node.port.onmessage = ({ data }) => {
        this.first = data.first;
        resolve(data.samples);
      };
      this.node.port.postMessage({ take: true });
    });
  }

  close() {
    this.node.port.postMessage({ close: true });
    this.node.disconnect();
    this.muted.disconnect();
  }
}

/** Moves `parameter` to `value`, held to 0 to 1, without a click; returns what it moves to. */
function glide(parameter, value, context) {
  const wanted = Math.min(1, Math.max(0, Number(value) || 0));
  parameter.setTargetAtTime(wanted, context.currentTime, GLIDE);
  return wanted;
}
