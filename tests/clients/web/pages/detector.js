/* Watches the mix for the first sample that is not zero after it was armed, in the audio thread.

Messages: {arm: true} in; {date} out: Date.now() of the quantum in which it is handed on, in ms, to 1 ms. */

class Detector extends AudioWorkletProcessor {
  constructor() {
    super();
    this.armed = false;
    this.port.onmessage = () => (this.armed = true);
  }

  process([input]) {
    if (this.armed && input[0]?.some((sample) => sample !== 0)) {
      this.armed = false;
      this.port.postMessage({ date: Date.now() });
    }
    return true;
  }
}

registerProcessor("detector", Detector);
