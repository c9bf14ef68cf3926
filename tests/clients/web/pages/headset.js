/* What the tests of the VR page reach it by: an emulated headset where IWER is there, fingertips put to places of the
table. */

window.tools = {
  device: null,
  pulses: [],

  /** Puts an emulated Quest 3 in the place of the browser's WebXR. */
  wear() {
    this.device = new IWER.XRDevice(IWER.metaQuest3);
    this.device.installRuntime({ forceInstall: true });
  },

  get session() {
    return ridgewave.room.renderer.xr.getSession();
  },

  /** Resolves once the page has drawn another frame. */
  async frames(count = 1) {
    for (let frame = 0; frame < count; frame += 1) {
      await new Promise((resolve) => (this.session ?? window).requestAnimationFrame(resolve));
    }
  },

  /** Resolves once something happened; fails after 20 s. */
  async until(happened) {
    const deadline = performance.now() + 60000;
    while (!happened()) {
      if (performance.now() > deadline) throw new Error(`it never happened: ${happened}`);
      await this.frames();
    }
  },

  /** Where a swatch is: its middle in the table's frame, m. */
  swatch(index) {
    return ridgewave.room.layout.places[index];
  },

  /** The fingertip of that id now: its middle in the table's frame, and its radius, m. */
  tip(id) {
    return ridgewave.tips.find((tip) => tip.id === id);
  },

  /** Moves the lowest point of a fingertip to a place of the table's frame, m; held: what of the device holds it. */
  async put(held, id, { x, y, z }) {
    const { centre, radius } = this.tip(id);
    const { table, three } = ridgewave.room;
    const [from, to] = [
      [centre.x, centre.y, centre.z],
      [x, y + radius, z],
    ].map((place) => table.localToWorld(new three.Vector3(...place)));
    const { position } = held;
    position.set(position.x + to.x - from.x, position.y + to.y - from.y, position.z + to.z - from.z);
    await this.frames(2);
  },

  /** Resolves once the last tenth of a second that left the player was exact zeros; meanwhile `stir` is called. */
  async silence(stir = () => {}) {
    const tap = ridgewave.player.tap();
    const deadline = performance.now() + 60000;
    let last = [];
    while (performance.now() < deadline) {
      await stir();
      await new Promise((resolve) => setTimeout(resolve, 150));
      last = await tap.take();
      if (last.length >= 9600 && last.subarray(-9600).every((sample) => sample === 0)) break;
    }
    tap.close();
    return last.length >= 9600 && last.subarray(-9600).every((sample) => sample === 0);
  },

  /** Notes each strength that a controller is told. */
  heed(handedness) {
    const source = [...this.session.inputSources].find((source) => source.handedness === handedness);
    const [actuator] = source.gamepad.hapticActuators;
    const pulse = actuator.pulse.bind(actuator);
    actuator.pulse = (strength, duration) => {
      this.pulses.push(strength);
      return pulse(strength, duration);
    };
  },

  /** Largest sample of the blocks that came so far, of all fingers that are open now. */
  listen() {
    const heard = { frames: 0, peak: 0 };
    for (const finger of ridgewave.fingers) {
      finger.addEventListener("block", ({ detail }) => {
        heard.frames += detail.samples.length;
        for (const sample of detail.samples) heard.peak = Math.max(heard.peak, Math.abs(sample));
      });
    }
    return heard;
  },
};

if (window.IWER) tools.wear();
