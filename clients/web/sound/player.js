/* The output of the page: mixes sources, with a master volume, on an output device.

    source (ring buffer, level) -> mix -> channels of the device -> volume -> raised -> destination

At level 1 the mix contains exactly the samples of the source. A raised sound is bent below LOUDEST, so that a sudden fast
stroke does not startle in headphones. Volume and levels change without clicks, within 50 ms.
A player is asleep while the browser does not permit sound, and after the system has paused it. It wakes at the next
gesture: the press of a mouse button or a key, or the lift (not the touch) of a finger.
Limits: samples wait while the player is asleep. Only some browsers can choose the output device (`canChooseOutput`).
Delays beyond the browser's `outputLatency` (Bluetooth, an amplifier) are unknown. */

import { Explained } from "../explained.js";
import { QueueDepth } from "./queue_depth.js";
import { glide, Source } from "./source.js";
import { Tap } from "./tap.js";

/** Events with which a browser may permit sound. A finger that drags never clicks, so its lift is among them. */
const WAKING = ["pointerdown", "mousedown", "pointerup", "touchend", "click", "keydown", "visibilitychange"];
const RAISE = 0.02; // s, time constant of a change of `raised`; shorter clicks
const LOUDEST = 0.3; // of the device: largest sample of a raised sound; three times what the first volume allows otherwise
const CURVE_POINTS = 4097; // of the curve that bends it
const FIRST_VOLUME = 0.1; // first volume: a vibration for an actuator is loud in headphones

const INSECURE = "Sound needs https or localhost. Open this page at such an address.";
const LACKING = "This browser lacks what the sound needs. Update it, or use another one.";
const FORBIDDEN = "The browser does not permit sound here. Permit it in the settings of the browser, then try again.";
const WRONG_RATE = "This browser cannot play that sample rate. Set 48 kHz, or download the WAV.";
const WHY = {
  NotAllowedError: FORBIDDEN,
  NotSupportedError: WRONG_RATE,
  RangeError: WRONG_RATE,
  TypeError: WRONG_RATE,
};

/** Returns why no sound is possible at all on this page, a sentence; "" if it is. Browsers have an AudioWorklet only where
 *  the page is secure. */
export function whySilent() {
  if (!window.isSecureContext) return INSECURE;
  return "AudioContext" in window && "AudioWorkletNode" in window ? "" : LACKING;
}

/** The output. Event "awake": `awake` may have changed. */
export class Player extends EventTarget {
  #sources = new Set();
  #wanted = FIRST_VOLUME;
  #channels = [0, 1];
  #routing = [];
  /** The QueueDepth of all sources. */
  depth;

  /** Returns a new player; throws Explained if the browser cannot play. sampleRate: Hz, that of the scene. latencyHint: that of AudioContext. */
  static async open({ sampleRate = 48000, latencyHint = "interactive" } = {}) {
    const why = whySilent();
    if (why) throw new Explained(why);
    setAudioSession("playback");
    const context = contextOf(sampleRate, latencyHint);
    try {
      context.resume().catch(() => {}); // if this gesture does not permit sound, a later one will
      await context.audioWorklet.addModule(new URL("./ring_buffer.js", import.meta.url)).catch(() => {
        throw new Explained("The sound did not load. Check that the service is running, then press Touch again.");
      });
    } catch (error) {
      await context.close();
      throw error;
    }
    return new Player(context);
  }

  constructor(context) {
    super();
    this.context = context;
    this.depth = new QueueDepth(context.sampleRate);
    const discrete = { channelCount: 2, channelCountMode: "explicit", channelInterpretation: "discrete" };
    this.mix = new GainNode(context, discrete);
    this.master = new GainNode(context, { gain: FIRST_VOLUME, channelInterpretation: "discrete" });
    context.destination.channelInterpretation = "discrete";
    this.raising = new GainNode(context, { channelInterpretation: "discrete" });
    this.plain = new GainNode(context, { channelInterpretation: "discrete" });
    this.bent = new GainNode(context, { gain: 0, channelInterpretation: "discrete" });
    const bending = new WaveShaperNode(context, { curve: bentBelow(LOUDEST), channelInterpretation: "discrete" });
    this.output = new GainNode(context, { channelInterpretation: "discrete" });
    this.master.connect(this.raising).connect(this.plain).connect(this.output).connect(context.destination);
    this.raising.connect(bending).connect(this.bent).connect(this.output);
    this.#route();
    context.addEventListener("statechange", () => {
      this.#wake();
      this.dispatchEvent(new CustomEvent("awake"));
    });
    for (const kind of WAKING) window.addEventListener(kind, this.#wake, true);
  }

  /** Whether the browser permits sound. */
  get awake() {
    return this.context.state === "running";
  }

  /** Hz. */
  get sampleRate() {
    return this.context.sampleRate;
  }

  /** Returns a new Source with that number of channels. */
  source(channels) {
    const source = new Source(this.context, channels, this.mix);
    const close = source.close.bind(source);
    source.close = () => this.#sources.delete(source) && close();
    this.#sources.add(source);
    return source;
  }

  /** Master volume, 0 to 1; initially 0.1. */
  get volume() {
    return this.#wanted;
  }

  set volume(value) {
    this.#wanted = glide(this.master.gain, value, this.context);
  }

  /** Gain on top of the volume, 1 or more; initially 1. Above 1, samples stay below LOUDEST. */
  set raised(gain) {
    const bent = gain > 1 ? 1 : 0;
    for (const [node, value] of [
      [this.raising, gain],
      [this.plain, 1 - bent],
      [this.bent, bent],
    ])
      node.gain.setTargetAtTime(value, this.context.currentTime, RAISE);
  }

  /** Time from the audio thread to the loudspeaker, s, as far as the browser knows. */
  get outputLatency() {
    return this.context.outputLatency || this.context.baseLatency || 0;
  }

  /** Time until a sample that is queued now is heard, s: output latency plus the longest queue. */
  get latency() {
    const queued = Math.max(0, ...[...this.#sources].map((source) => source.queued));
    return this.outputLatency + queued / this.sampleRate;
  }

  /** Whether the browser can choose the output device. */
  get canChooseOutput() {
    return "setSinkId" in this.context;
  }

  /** Returns the known output devices as {id, label}. Labels may be empty. */
  async outputs() {
    if (!this.canChooseOutput || !navigator.mediaDevices) return [];
    const devices = await navigator.mediaDevices.enumerateDevices();
    return devices.filter(({ kind }) => kind === "audiooutput").map(({ deviceId, label }) => ({ id: deviceId, label }));
  }

  /** Plays on the device of that id, "" for the default. Throws if the browser cannot. */
  async useOutput(id) {
    if (!this.canChooseOutput)
      throw new Explained("This browser cannot choose an output. Choose it in the system settings.");
    await this.context.setSinkId(id);
    this.#route();
  }

  /** Number of channels of the output device. */
  get outputChannels() {
    return this.context.destination.maxChannelCount;
  }

  /** Plays channel i of the sound on channel channels[i] of the device, counted from 0. A single channel plays on the
   *  first two. */
  useChannels(channels) {
    const most = this.outputChannels - 1;
    const wrong = channels.find((channel) => !(Number.isInteger(channel) && channel >= 0 && channel <= most));
    if (wrong !== undefined) throw new RangeError(`The output has channels 0 to ${most}: choose from these.`);
    this.#channels = [...channels];
    this.#route();
  }

  /** Returns a Tap behind the "mix", behind the master "volume", or at the "output". */
  tap(place = "mix") {
    return new Tap(this.context, { mix: this.mix, volume: this.master, output: this.output }[place]);
  }

  /** Closes the player and its sources. */
  async close() {
    for (const kind of WAKING) window.removeEventListener(kind, this.#wake, true);
    for (const source of this.#sources) source.close();
    await this.context.close();
    setAudioSession("auto");
  }

  /** Resumes sound that the browser or the system has paused (a call, a laptop that slept). */
  #wake = () => {
    if (["running", "closed"].includes(this.context.state)) return;
    this.context.resume().catch(() => {}); // not permitted yet: the next gesture tries again
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

/** Sets the kind of sound of the page where the browser has kinds (Safari). "playback" sounds although the mute switch of
 *  an iPhone is on; "auto" leaves other apps their sound. */
function setAudioSession(type) {
  if (navigator.audioSession) navigator.audioSession.type = type;
}

function contextOf(sampleRate, latencyHint) {
  try {
    return new AudioContext({ sampleRate, latencyHint });
  } catch (error) {
    if (error.name in WHY) throw new Explained(WHY[error.name]);
    throw error;
  }
}

/** Returns the curve of a WaveShaperNode that is straight for small samples and bends below `most`. */
function bentBelow(most) {
  return Float32Array.from({ length: CURVE_POINTS }, (_, index) => {
    const sample = (2 * index) / (CURVE_POINTS - 1) - 1;
    return most * Math.tanh(sample / most);
  });
}
