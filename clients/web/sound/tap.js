/* What leaves the mix, recorded bit for bit, for whoever checks the sound.

Limits: it keeps in memory what was not taken, and the first two channels only. */

export class Tap {
  /** Channels of the samples, interleaved. */
  channels = 2;
  /** Context frame of the first sample that was taken last. */
  first = -1;

  /** node: what it listens to. */
  constructor(context, node) {
    this.node = new AudioWorkletNode(context, "ridgewave-tap", {
      channelCount: 2,
      channelCountMode: "explicit",
      channelInterpretation: "discrete",
      outputChannelCount: [2],
      processorOptions: { channels: 2 },
    });
    this.muted = new GainNode(context, { gain: 0 }); // what leads nowhere is not run
    node.connect(this.node).connect(this.muted).connect(context.destination);
  }

  /** Returns a Float32Array of all that was played since the last time. */
  take() {
    return new Promise((resolve) => {
      this.node.port.onmessage = ({ data }) => {
        this.first = data.first;
        resolve(data.samples);
      };
      this.node.port.postMessage({ take: true });
    });
  }

  /** Ends it. */
  close() {
    this.node.port.postMessage({ close: true });
    this.node.disconnect();
    this.muted.disconnect();
  }
}
