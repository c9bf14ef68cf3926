/* Fingertips in a WebXR frame: the index finger of a tracked hand, or the end of a short rod on a controller.

Model: a fingertip is a ball. XRHand has the places and radii of joints; the rod points along the target ray. A finger
points along its joint, or along the rod.
Limits: one fingertip per hand. A source without a pose in this frame has none; an estimated position counts as a pose.
*/

/** From the origin of a controller's target ray to the centre of the ball at the end of the rod (m). */
const ROD = 0.05;
/** Radius of that ball, and of a fingertip without a known radius (m). */
const TIP_RADIUS = 0.008;
const TIP_JOINT = "index-finger-tip";

/**
 * @param {XRSession} session
 * @param {XRFrame} frame
 * @param {XRReferenceSpace} space
 * @returns {{id: string, hand: string, centre: {x, y, z}, ahead: {x, y, z}, radius: number, rod: XRRigidTransform |
 *   null, joints: {x, y, z, radius}[]}[]} centres in coordinates of the space, m; `ahead`: a point 1 m ahead of the
 *   finger; `rod`: pose of a controller; `joints`: those of a hand
 */
export function readTips(session, frame, space) {
  const tips = [];
  for (const source of session.inputSources) {
    if (source.targetRayMode !== "tracked-pointer") continue;
    const tip = source.hand ? ofHand(source, frame, space) : ofController(source, frame, space);
    if (tip)
      tips.push({ id: `${source.handedness} ${source.hand ? "hand" : "controller"}`, hand: source.handedness, ...tip });
  }
  return tips;
}

function ofHand(source, frame, space) {
  const joints = [];
  let [tip, ahead] = [null, null];
  for (const [name, joint] of source.hand) {
    const pose = frame.getJointPose(joint, space);
    if (!pose) continue;
    const { x, y, z } = pose.transform.position;
    const ball = { x, y, z, radius: pose.radius || TIP_RADIUS };
    joints.push(ball);
    if (name === TIP_JOINT) [tip, ahead] = [ball, forward(pose.transform, ball, 1)];
  }
  return tip && { centre: tip, ahead, radius: tip.radius, rod: null, joints };
}

function ofController(source, frame, space) {
  const pose = frame.getPose(source.targetRaySpace, space);
  if (!pose) return null;
  const centre = forward(pose.transform, pose.transform.position, ROD);
  return {
    centre,
    ahead: forward(pose.transform, centre, 1),
    radius: TIP_RADIUS,
    rod: pose.transform,
    joints: [],
  };
}

/** Returns the point at a distance (m) from a point, along the direction -z of a pose. */
const forward = ({ matrix }, { x, y, z }, distance) => ({
  x: x - distance * matrix[8],
  y: y - distance * matrix[9],
  z: z - distance * matrix[10],
});

/**
 * Returns the direction of a finger on the table, from x, counter-clockwise seen from above (rad).
 * @param {{x: number, z: number}} centre of the fingertip, in coordinates of the table (m)
 * @param {{x: number, z: number}} ahead a point 1 m ahead of it
 * @returns {number | undefined} undefined if the finger is nearly upright
 */
export function directionOf(centre, ahead) {
  const [x, y] = [ahead.x - centre.x, centre.z - ahead.z];
  return Math.hypot(x, y) > UPRIGHT ? Math.atan2(y, x) : undefined;
}

const UPRIGHT = 0.2; // part of a finger's length that lies along the table; with less, its direction is noise

/**
 * Returns the place of the table: in front of the person, below the eyes.
 * @param {XRRigidTransform} head pose of the viewer
 * @param {boolean} floor whether y = 0 is the floor
 * @returns {{x: number, y: number, z: number, yaw: number}} middle of the table (m), turn about the vertical (rad)
 */
export function placeBefore(head, floor) {
  const [forwardX, forwardZ] = [-head.matrix[8], -head.matrix[10]];
  const norm = Math.hypot(forwardX, forwardZ) || 1;
  const [x, z] = norm > 1e-3 ? [forwardX / norm, forwardZ / norm] : [0, -1];
  const below = head.position.y - BELOW_EYES;
  const y = floor ? Math.min(HIGHEST, Math.max(LOWEST, below)) : below;
  return { x: head.position.x + AWAY * x, y, z: head.position.z + AWAY * z, yaw: Math.atan2(-x, -z) };
}

const AWAY = 0.42; // m from the eyes to the middle of the table, so that the far row is within reach
const BELOW_EYES = 0.5; // m from the eyes down to the table
const [LOWEST, HIGHEST] = [0.55, 1.15]; // m over the floor, for people who sit or stand
