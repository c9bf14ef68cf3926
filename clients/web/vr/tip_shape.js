/**
 * What is seen of one fingertip: a ball, its dot and ring on the surface, the rod of a controller, the joints of a hand.
 *
 * Limits: a hand that presses is drawn where it is, below the surface; its fingertip's ball rests on the surface.
 */

import { MOST_LOAD } from "./touch.js";

/** Colour of what a touch lights. */
export const TOUCHED = 0x1f6f8b;

export class TipShape {
  constructor(three, scene, table) {
    this.three = three;
    const flat = { transparent: true, depthWrite: false };
    const skin = new three.MeshStandardMaterial({ color: 0xd98e6f, roughness: 0.7 });
    this.ball = new three.Mesh(new three.SphereGeometry(1, 24, 16), skin);
    this.dot = new three.Mesh(new three.CircleGeometry(1, 24), new three.MeshBasicMaterial({ color: 0, opacity: 0.3, ...flat }));
    this.ring = new three.Mesh(new three.RingGeometry(0.82, 1, 40), new three.MeshBasicMaterial({ color: TOUCHED, ...flat }));
    this.rod = new three.Mesh(new three.CylinderGeometry(0.003, 0.006, 1, 12), skin);
    this.joints = new three.InstancedMesh(new three.SphereGeometry(1, 10, 8), skin, 25);
    this.joints.frustumCulled = false;
    this.dot.rotation.x = this.ring.rotation.x = -Math.PI / 2;
    table.add(this.ball, this.dot, this.ring, this.rod);
    scene.add(this.joints);
  }

  /** @param {object | null} tip of `Room.showTip` @param {number} load (N) */
  show(tip, load) {
    const seen = Boolean(tip);
    this.ball.visible = this.dot.visible = seen;
    this.ring.visible = seen && load > 0;
    this.rod.visible = seen && Boolean(tip.rod);
    this.joints.visible = seen && Boolean(tip.joints?.length);
    if (!seen) return;
    const { centre, radius, rod, joints = [] } = tip;
    const height = Math.max(0, centre.y - radius);
    this.ball.position.set(centre.x, load > 0 ? radius : centre.y, centre.z);
    this.ball.scale.setScalar(radius);
    this.dot.position.set(centre.x, 6e-4, centre.z);
    this.dot.visible = height < 0.12 && centre.y > 0;
    this.dot.material.opacity = Math.max(0, 0.35 - 3 * height);
    this.dot.scale.setScalar(radius * (1 + 6 * height));
    this.ring.position.set(centre.x, 9e-4, centre.z);
    this.ring.scale.setScalar(radius * (1.2 + (1.6 * load) / MOST_LOAD));
    if (rod) this.#rod(rod);
    if (joints.length) this.#joints(joints);
  }

  #rod({ position }) {
    const { Vector3, Quaternion } = this.three;
    const from = this.rod.parent.worldToLocal(new Vector3(position.x, position.y, position.z));
    const along = this.ball.position.clone().sub(from);
    this.rod.position.copy(from).addScaledVector(along, 0.5);
    this.rod.scale.set(1, along.length(), 1);
    this.rod.quaternion.copy(new Quaternion().setFromUnitVectors(new Vector3(0, 1, 0), along.normalize()));
  }

  #joints(joints) {
    const matrix = new this.three.Matrix4();
    joints.forEach(({ x, y, z, radius }, index) => {
      this.joints.setMatrixAt(index, matrix.makeScale(radius, radius, radius).setPosition(x, y, z));
    });
    this.joints.count = joints.length;
    this.joints.instanceMatrix.needsUpdate = true;
  }
}
