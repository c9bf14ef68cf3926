/* Records the output of a node bit for bit, for tests.

Limits: two channels; samples are kept in memory until they are taken. */

export class Tap {
  /** Channels of the samples, interleaved. */
  channels = 2;
  /** Context frame of the first sample of the last `take`. */
  first = -1;

  /** node: the node to record. */
  constructor(context, node) {
    this.node = new AudioWorkletNode(context, "ridgewave-tap", {
      channelCount: 2,
      channelCountMode: "explicit",
      channelInterpretation: "discrete",
      outputChannelCount: [2],
      processorOptions: { channels: 2 },
    });
    this.muted = new GainNode(context, { gain: 0 }); // browsers do not run nodes without an output
    node.connect(this.node).connect(this.muted).connect(context.destination);
  }

  /** Returns the samples since the last call: Float32Array, interleaved. */
  take() {
    return new Promise((resolve) => {
      this.node.port.onmessage = ({ data }) => {
        this.first = data.first;
        resolve(data.samples);
      };
      this.node.port.postMessage({ take: true });
    });
  }

  /** Ends the recording. */
  close() {
    this.node.port.postMessage({ close: true });
    this.node.disconnect();
    this.muted.disconnect();
  }
}
