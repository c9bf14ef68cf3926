/* The table with its swatches, light and fingertips, in three.js.

Model: everything on the table is in its coordinates (table_layout.js). The table is tilted towards the person. Low
light along the strokes shows the ridges. A pressing fingertip is drawn on the surface, not inside it, with a ring that
grows with the load.
Limits: no shadows except a dot under each fingertip; some 20 draw calls. */

import { labelMesh } from "./labels.js";
import { areaRelief } from "./area_relief.js";
import { relief } from "./relief.js";
import { COLUMNS, LENGTH, MARGIN, RAISED, WIDTH, layTable, magnification } from "./table_layout.js";
import { FingertipMesh, TOUCHED } from "./fingertip_mesh.js";

const FIELD_OF_VIEW = 40; // degrees, vertical, on a desktop
const LEAST_WIDTH = 1000; // pixels; with fewer, fine ridges alias
const ON_DESKTOP = { x: 0, y: 0.75, z: 0, yaw: 0 }; // m, rad
const TILT = 0.2; // rad towards the person
const BOARD = 0.018; // m thick
const LOOKS = {
  light: { air: 0xe6ebef, floor: 0xd8dfe5, board: 0xf4f2ee, ink: "#1d2733", faint: "#4f5d6b", sky: 0xffffff, sun: 1.9 },
  dark: { air: 0x171c22, floor: 0x1e252d, board: 0x3a444f, ink: "#eef2f5", faint: "#b3bec9", sky: 0xb9c6d6, sun: 1.5 },
};
const FINE = 0xe0b98a; // colour of the finest swatch,
const HINT = 0xe8590c; // colour of the swatch that is nearest to a fingertip beside it
const COARSE = 0x86a9bd; // and of the coarsest; interpolated by rank

export class Room {
  /**
   * @param {object} three the module three.js
   * @param {HTMLCanvasElement} canvas
   * @param {{title: string, period: number, wave: number, rough: boolean, height: number, heights: number[], area?:
   *   number[][], across?: number}[]} swatches lengths in m; heights of one period, and rows of them over an area
   * @param {"light" | "dark"} look
   * @param {boolean} tall whether the picture is taller than wide, as on a phone: fewer columns, larger labels
   */
  constructor(three, canvas, swatches, look, tall = false) {
    this.three = three;
    this.renderer = new three.WebGLRenderer({ canvas, antialias: true });
    this.renderer.xr.enabled = true;
    this.camera = new three.PerspectiveCamera(FIELD_OF_VIEW, 1, 0.02, 20);
    const own = swatches.filter((swatch) => swatch.own).length;
    this.tall = tall;
    this.layout = layTable(swatches.length, own, tall ? COLUMNS.tall : COLUMNS.wide);
    this.tips = new Map();
    const colours = LOOKS[look];
    this.scene = new three.Scene();
    this.scene.background = new three.Color(colours.air);
    this.scene.fog = new three.Fog(colours.air, 2.5, 7);
    const sun = new three.DirectionalLight(0xffffff, colours.sun);
    sun.position.set(-1.6, 1.1, 0.5);
    this.scene.add(new three.HemisphereLight(colours.sky, colours.floor, 1.4), sun);
    this.floor = new three.Mesh(new three.CircleGeometry(7, 48), new three.MeshBasicMaterial({ color: colours.floor }));
    this.floor.rotation.x = -Math.PI / 2;
    this.table = new three.Group();
    this.scene.add(this.floor, this.table);
    this.stand(ON_DESKTOP);
    this.#board(colours);
    this.swatches = swatches.map((swatch, index) => this.#swatch(swatch, index, swatches.length));
    this.table.add(labelMesh(three, swatches, this.layout.places, colours, tall));
    this.colours = colours;
  }

  /** Returns the ray {origin, direction} (Vector3, world) at a place of the canvas, -1 to 1 to the right and upwards. */
  rayAt(x, y) {
    const caster = new this.three.Raycaster();
    caster.setFromCamera(new this.three.Vector2(x, y), this.camera);
    return caster.ray;
  }

  /** Places the table. @param {{x: number, y: number, z: number, yaw: number}} place middle (m) and turn (rad) */
  stand({ x, y, z, yaw }) {
    this.table.position.set(x, y, z);
    this.table.rotation.set(TILT, yaw, 0, "YXZ");
    this.table.updateMatrixWorld(true);
  }

  #board({ board }) {
    const { three, layout } = this;
    const geometry = new three.BoxGeometry(layout.width, BOARD, layout.depth);
    const mesh = new three.Mesh(geometry, new three.MeshStandardMaterial({ color: board, roughness: 0.85 }));
    mesh.position.y = -RAISED - BOARD / 2;
    this.table.add(mesh);
  }

  #swatch({ heights, area, period, across, wave, height }, index, count) {
    const { three } = this;
    const size = { ...magnification({ wave, height }), length: LENGTH, width: WIDTH, raised: RAISED };
    const drawn = area ? areaRelief({ area, period, across, ...size }) : relief({ heights, period, ...size });
    const { positions, normals, colours, indices } = drawn;
    const geometry = new three.BufferGeometry();
    geometry.setAttribute("position", new three.BufferAttribute(positions, 3));
    geometry.setAttribute("normal", new three.BufferAttribute(normals, 3));
    geometry.setAttribute("color", new three.BufferAttribute(colours, 3));
    geometry.setIndex(new three.BufferAttribute(indices, 1));
    const color = new three.Color(FINE).lerp(new three.Color(COARSE), count > 1 ? index / (count - 1) : 0);
    const mesh = new three.Mesh(
      geometry,
      new three.MeshStandardMaterial({ color, vertexColors: true, roughness: 0.6 }),
    );
    const { x, z } = this.layout.places[index];
    mesh.position.set(x, 0, z);
    this.table.add(mesh);
    return mesh;
  }

  /** Adds an object beside the table: Meshes in coordinates of the table, whose tops are in its plane. touchable: those that
   *  are swatches, with their places {x, z, length, width} (m). right: the right edge of the object (m). */
  addObject(meshes, touchable, right) {
    for (const mesh of meshes) this.table.add(mesh);
    for (const { mesh, place } of touchable) {
      this.swatches.push(mesh);
      this.layout.places.push(place);
    }
    this.layout.width = Math.max(this.layout.width, 2 * (right + MARGIN));
  }

  /** @param {{x, y, z}} point in the world (m) @returns {{x, y, z}} in coordinates of the table (m) */
  onTable({ x, y, z }) {
    return this.table.worldToLocal(new this.three.Vector3(x, y, z));
  }

  /**
   * @param {number} x from the middle of the canvas, -1 to 1 to the right
   * @param {number} y -1 to 1 upwards
   * @returns {{x: number, z: number} | null} the point of the table that is visible there (m)
   */
  under(x, y) {
    const ray = this.rayAt(x, y);
    const from = this.table.worldToLocal(ray.origin.clone());
    const to = this.table.worldToLocal(ray.at(1, new this.three.Vector3()));
    if (from.y * (from.y - to.y) <= 0) return null;
    const share = from.y / (from.y - to.y);
    return { x: from.x + share * (to.x - from.x), z: from.z + share * (to.z - from.z) };
  }

  /**
   * Shows a fingertip; hides it if `tip` is null.
   * @param {string} id
   * @param {{centre: {x, y, z}, radius: number, rod?: XRRigidTransform | null, joints?: {x, y, z, radius}[]} | null}
   *   tip centre in coordinates of the table, rod and joints in the world (m)
   * @param {number} load (N)
   */
  showTip(id, tip, load = 0) {
    if (!this.tips.has(id)) {
      if (!tip) return;
      this.tips.set(id, new FingertipMesh(this.three, this.scene, this.table));
    }
    this.tips.get(id).show(tip, load);
  }

  /** @param {Set<number>} touched swatches to light up @param {Set<number>} beside swatches to which a fingertip beside
   *  them is led */
  light(touched, beside = new Set()) {
    this.swatches.forEach(({ material }, index) => {
      const lit = touched.has(index) ? TOUCHED : 0;
      material.emissive.setHex(!lit && beside.has(index) ? HINT : lit);
      material.emissiveIntensity = 0.35;
    });
  }

  /** Draws a picture on the canvas or the headset. */
  draw() {
    this.renderer.render(this.scene, this.camera);
  }

  /** Restores camera, table and floor after a headset session. */
  useDesktop() {
    Object.assign(this.camera, { fov: FIELD_OF_VIEW, zoom: 1 });
    this.camera.up.set(0, 1, 0);
    this.camera.updateProjectionMatrix();
    this.stand(ON_DESKTOP);
    this.floor.visible = true;
  }

  /** Sets the size of the picture. @param {number} width @param {number} height CSS px @param {number} ratio device px
   *  per CSS px */
  fit(width, height, ratio) {
    this.renderer.setPixelRatio(Math.min(3, Math.max(Math.min(2, ratio), LEAST_WIDTH / Math.max(1, width))));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / Math.max(1, height);
    this.camera.updateProjectionMatrix();
  }
}
