/* The drawing of a fingertip: a ball, its shadow and ring on the surface, the rod of a controller, the joints of a
hand.

Model: a hand is drawn as balls at its joints, with rods between neighbouring joints of a finger.
Limits: a pressing hand is drawn at its place below the surface; only the ball of its fingertip stays on the surface. */

import { MOST_LOAD } from "./contact_model.js";

const FINGERS = [1, 5, 10, 15, 20]; // first joint of each finger in XRHand; joint 0 is the wrist
const JOINTS = 25;
const BONE = 0.85; // thickness of a rod relative to that of its thinner joint

/** Colour of touched swatches and of rings. */
export const TOUCHED = 0x1f6f8b;

export class FingertipMesh {
  constructor(three, scene, table) {
    this.three = three;
    const flat = { transparent: true, depthWrite: false };
    const skin = new three.MeshStandardMaterial({ color: 0xd98e6f, roughness: 0.7 });
    this.ball = new three.Mesh(new three.SphereGeometry(1, 24, 16), skin);
    this.dot = new three.Mesh(
      new three.CircleGeometry(1, 24),
      new three.MeshBasicMaterial({ color: 0, opacity: 0.3, ...flat }),
    );
    this.ring = new three.Mesh(
      new three.RingGeometry(0.82, 1, 40),
      new three.MeshBasicMaterial({ color: TOUCHED, ...flat }),
    );
    this.rod = new three.Mesh(new three.CylinderGeometry(0.003, 0.006, 1, 12), skin);
    this.joints = new three.InstancedMesh(new three.SphereGeometry(1, 10, 8), skin, JOINTS);
    this.bones = new three.InstancedMesh(new three.CylinderGeometry(1, 1, 1, 10, 1, true), skin, JOINTS - 1);
    this.joints.frustumCulled = this.bones.frustumCulled = false;
    this.dot.rotation.x = this.ring.rotation.x = -Math.PI / 2;
    table.add(this.ball, this.dot, this.ring, this.rod);
    scene.add(this.joints, this.bones);
  }

  /** @param {object | null} tip as for `Room.showTip` @param {number} load (N) */
  show(tip, load) {
    const seen = Boolean(tip);
    this.ball.visible = this.dot.visible = seen;
    this.ring.visible = seen && load > 0;
    this.rod.visible = seen && Boolean(tip.rod);
    this.joints.visible = this.bones.visible = seen && Boolean(tip.joints?.length);
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
    const { Matrix4, Quaternion, Vector3 } = this.three;
    const [matrix, turn, up] = [new Matrix4(), new Quaternion(), new Vector3(0, 1, 0)];
    const whole = joints.length === JOINTS;
    joints.forEach(({ x, y, z, radius }, index) => {
      this.joints.setMatrixAt(index, matrix.makeScale(radius, radius, radius).setPosition(x, y, z));
      if (!whole || index === 0) return;
      const before = joints[FINGERS.includes(index) ? 0 : index - 1];
      const along = new Vector3(x - before.x, y - before.y, z - before.z);
      const middle = new Vector3(x, y, z).addScaledVector(along, -0.5);
      const thick = BONE * Math.min(radius, before.radius);
      const size = new Vector3(thick, along.length(), thick);
      this.bones.setMatrixAt(index - 1, matrix.compose(middle, turn.setFromUnitVectors(up, along.normalize()), size));
    });
    this.joints.count = joints.length;
    this.bones.count = whole ? JOINTS - 1 : 0;
    this.joints.instanceMatrix.needsUpdate = this.bones.instanceMatrix.needsUpdate = true;
  }
}
