/* A panel at the far edge of the table: the touched texture, its load and the gain, with buttons.

Model: the panel is a plane in coordinates of the table, which a canvas is drawn on. A ray presses the button that it
meets; a fingertip presses a button when its ball reaches the plane from the front, once until it has left again.
Limits: buttons act at once; none is held. */

const SIZE = { width: 0.36, height: 0.11 }; // m
const PIXELS = { width: 1440, height: 440 };
const BEHIND = 0.012; // m from the far edge of the table to the foot of the panel
const LEAN = -0.35; // rad, away from the person
const ROW = { top: 270, height: 140 }; // pixels, of the buttons
const AWAY = 0.01; // m from the plane at which a fingertip has left it
const BUTTONS = [
  { action: "softer", text: "Load −", left: 20, width: 260 },
  { action: "harder", text: "Load +", left: 300, width: 260 },
  { action: "quieter", text: "Gain −", left: 600, width: 260 },
  { action: "louder", text: "Gain +", left: 880, width: 260 },
  { action: "mute", text: "Mute", left: 1180, width: 240 },
];

export class ControlPanel {
  #texture;
  #pen;
  #shown = "";
  #inside = new Set(); // fingertips that have pressed and not left yet

  /** room: the Room. onPress(action): "softer", "harder", "quieter", "louder" or "mute". */
  constructor(room, onPress) {
    const { three, table, layout, colours } = room;
    Object.assign(this, { three, colours, onPress });
    const canvas = Object.assign(document.createElement("canvas"), PIXELS);
    this.#pen = canvas.getContext("2d");
    this.#texture = new three.CanvasTexture(canvas);
    this.#texture.colorSpace = three.SRGBColorSpace;
    this.#texture.anisotropy = 8;
    const plane = new three.PlaneGeometry(SIZE.width, SIZE.height);
    this.mesh = new three.Mesh(plane, new three.MeshBasicMaterial({ map: this.#texture }));
    this.mesh.position.set(0, SIZE.height / 2, -layout.depth / 2 - BEHIND);
    this.mesh.rotation.x = LEAN;
    table.add(this.mesh);
    this.show({ texture: "", load: 0, gain: 0, muted: false, stiffness: 0, hint: "" });
  }

  /** Shows {texture, load (N), gain (0 to 1), muted, stiffness (N/m), hint}; returns whether the picture has changed. */
  show(state) {
    const { texture, load, gain, muted, stiffness, hint } = state;
    const lines = [
      hint || texture || "Touch a swatch",
      `load ${load.toFixed(2)} N   (${(stiffness / 1e3).toPrecision(2)} N per mm)`,
      `gain ${muted ? "0, muted" : `${Math.round(100 * gain)} %`}`,
    ];
    const shown = JSON.stringify([lines, muted]);
    if (shown === this.#shown) return false;
    this.#shown = shown;
    this.#draw(lines, muted);
    this.#texture.needsUpdate = true;
    return true;
  }

  /** Presses the button at a ray {origin, direction} of the world; returns whether the panel is there. */
  pressAt(ray) {
    const caster = new this.three.Raycaster(ray.origin, ray.direction);
    const [hit] = caster.intersectObject(this.mesh);
    const action = hit && actionAt(hit.uv.x, hit.uv.y);
    if (action) this.onPress(action);
    return Boolean(hit);
  }

  /** Lets the fingertips press. tips: {id, centre, radius} in coordinates of the table (m). */
  touch(tips) {
    for (const { id, centre, radius } of tips) {
      const { Vector3 } = this.three;
      this.mesh.updateMatrix();
      const place = new Vector3(centre.x, centre.y, centre.z).applyMatrix4(this.mesh.matrix.clone().invert());
      const [u, v] = [place.x / SIZE.width + 0.5, place.y / SIZE.height + 0.5];
      const over = u >= 0 && u <= 1 && v >= 0 && v <= 1;
      const reaches = over && place.z < radius && place.z > -radius;
      const action = reaches && !this.#inside.has(id) && actionAt(u, v);
      if (reaches) this.#inside.add(id);
      else if (!over || place.z > radius + AWAY) this.#inside.delete(id);
      if (action) this.onPress(action);
    }
  }

  #draw(lines, muted) {
    const pen = this.#pen;
    const { ink, faint, air } = this.colours;
    const font = (size, bold) => `${bold ? "600 " : ""}${size}px system-ui, sans-serif`;
    pen.fillStyle = `#${air.toString(16).padStart(6, "0")}`;
    pen.fillRect(0, 0, PIXELS.width, PIXELS.height);
    pen.textAlign = "left";
    pen.textBaseline = "alphabetic";
    lines.forEach((line, index) => {
      const size = index ? 60 : 84;
      pen.font = font(size, !index);
      pen.font = font(size * Math.min(1, (PIXELS.width - 40) / pen.measureText(line).width), !index);
      pen.fillStyle = index ? faint : ink;
      pen.fillText(line, index === 2 ? 1000 : 20, index ? 210 : 105);
    });
    for (const { action, text, left, width } of BUTTONS) {
      const pressed = action === "mute" && muted;
      pen.beginPath();
      pen.roundRect(left, ROW.top, width, ROW.height, 24);
      pen.fillStyle = pen.strokeStyle = ink;
      pen.lineWidth = 5;
      if (pressed) pen.fill();
      pen.stroke();
      pen.font = font(60, true);
      pen.textAlign = "center";
      pen.fillStyle = pressed ? `#${air.toString(16).padStart(6, "0")}` : ink;
      pen.fillText(text, left + width / 2, ROW.top + 92);
    }
  }
}

/** Returns the action at a place of the panel, 0 to 1 to the right and upwards; undefined: none. */
export function actionAt(u, v) {
  const [x, y] = [u * PIXELS.width, (1 - v) * PIXELS.height];
  if (y < ROW.top || y > ROW.top + ROW.height) return undefined;
  return BUTTONS.find(({ left, width }) => x >= left && x <= left + width)?.action;
}
