/* The sound card as the page uses it: sources that play blocks of samples, mixed, one master volume, one output.

    source (ring, level) -> mix -> channels of the device -> volume -> destination

At level 1 the mix holds the very samples that were given. Volume and levels move without clicks, within some 50 ms.
A player that was opened before the browser lets the page sound, or was paused, is asleep: it wakes in the first gesture
that may wake it. A mouse may with its press, a finger with its lift (never with its touch), a key with its press.
Limits: what is given to a player that is asleep waits. The output device can be chosen where
the browser can (`canChooseOutput`). What lies behind the browser's `outputLatency` (a Bluetooth link, an amplifier)
is not known to it. */

import { Depth } from "./depth.js";
import { glide, Source } from "./source.js";
import { Tap } from "./tap.js";

/** In which a browser may let a page sound. A finger that drags never clicks: its lift is what counts. */
const WAKING = ["pointerdown", "mousedown", "pointerup", "touchend", "click", "keydown", "visibilitychange"];
const QUIET = 0.1; // volume at first: vibration made for an actuator is loud in headphones

/** The output. Event "awake": it sounds now, or no longer. */
export class Player extends EventTarget {
  #sources = new Set();
  #wanted = QUIET;
  #channels = [0, 1];
  #routing = [];
  /** How much is kept queued, for all sources: what the machine and the network bear. */
  depth;

  /** Returns a player, awake where the browser allows it. sampleRate: Hz, that of the scene. latencyHint: as of AudioContext. */
  static async open({ sampleRate = 48000, latencyHint = "interactive" } = {}) {
    const context = contextOf(sampleRate, latencyHint);
    try {
      context.resume().catch(() => {}); // in the gesture itself; where it is none that wakes, another one will
      await context.audioWorklet.addModule(new URL("./ring.js", import.meta.url));
    } catch (error) {
      await context.close();
      throw error;
    }
    return new Player(context);
  }

  constructor(context) {
    super();
    this.context = context;
    this.depth = new Depth(context.sampleRate);
    const discrete = { channelCount: 2, channelCountMode: "explicit", channelInterpretation: "discrete" };
    this.mix = new GainNode(context, discrete);
    this.master = new GainNode(context, { gain: QUIET, channelInterpretation: "discrete" });
    context.destination.channelInterpretation = "discrete";
    this.master.connect(context.destination);
    this.#route();
    context.addEventListener("statechange", () => {
      this.#wake();
      this.dispatchEvent(new CustomEvent("awake"));
    });
    for (const kind of WAKING) window.addEventListener(kind, this.#wake, true);
  }

  /** Whether the browser lets it sound. */
  get awake() {
    return this.context.state === "running";
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
    if (!this.canChooseOutput) throw new Error("This browser plays on the system's output: choose it in the system.");
    await this.context.setSinkId(id);
    this.#route();
  }

  /** How many channels the output device has. */
  get outputChannels() {
    return this.context.destination.maxChannelCount;
  }

  /** Plays channel i of the sound on channel channels[i] of the device, from 0. One channel sounds on the first two. */
  useChannels(channels) {
    const most = this.outputChannels - 1;
    const wrong = channels.find((channel) => !(Number.isInteger(channel) && channel >= 0 && channel <= most));
    if (wrong !== undefined) throw new RangeError(`The output has channels 0 to ${most}: choose among them.`);
    this.#channels = [...channels];
    this.#route();
  }

  /** Returns a Tap of what leaves the mix, or, at "volume", the master volume. */
  tap(place = "mix") {
    return new Tap(this.context, place === "mix" ? this.mix : this.master);
  }

  /** Ends all sound, for good. */
  async close() {
    for (const kind of WAKING) window.removeEventListener(kind, this.#wake, true);
    for (const source of this.#sources) source.close();
    await this.context.close();
  }

  /** Goes on where the browser or the system has paused the sound: a call came, say, or a laptop slept. */
  #wake = () => {
    if (["running", "closed"].includes(this.context.state)) return;
    this.context.resume().catch(() => {}); // not allowed yet: the next click or key asks again
  };

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
    for (const [index, channel] of this.#channels.entries()) {
      splitter.connect(merger, index, Math.min(channel, count - 1));
    }
    this.mix.connect(splitter);
    merger.connect(this.master);
    this.#routing = [splitter, merger];
  }
}

function contextOf(sampleRate, latencyHint) {
  try {
    return new AudioContext({ sampleRate, latencyHint });
  } catch (error) {
    if (error.name !== "NotSupportedError") throw error;
    throw new Error("This browser cannot play that sample rate: write 48 kHz, or download the WAV.");
  }
}
