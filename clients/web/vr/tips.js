/* Fingertips of a WebXR frame: of tracked hands the tip of the index finger, of controllers a short rod's end.

Model: a tip is a ball. XRHand tells where its joints are and how thick; a controller's rod points along its target ray.
Limits: one fingertip a hand. A source whose pose is not known in this frame has no tip; one whose position the headset
only guesses has one, at rest or not. */

/** From the origin of a controller's target ray to the middle of the ball at the end of its rod (m). */
export const ROD = 0.05;
/** Radius of that ball, and of a fingertip whose thickness the headset does not tell (m). */
export const TIP_RADIUS = 0.008;
const TIP_JOINT = "index-finger-tip";

/**
 * @param {XRSession} session
 * @param {XRFrame} frame
 * @param {XRReferenceSpace} space
 * @returns {{id: string, hand: string, centre: {x, y, z}, radius: number, rod: XRRigidTransform | null, joints: {x, y,
 *   z, radius}[]}[]} centres in the space, lengths in m; `rod` is the pose of a controller, `joints` those of a hand
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
  let tip = null;
  for (const [name, joint] of source.hand) {
    const pose = frame.getJointPose(joint, space);
    if (!pose) continue;
    const { x, y, z } = pose.transform.position;
    const ball = { x, y, z, radius: pose.radius || TIP_RADIUS };
    joints.push(ball);
    if (name === TIP_JOINT) tip = ball;
  }
  return tip && { centre: tip, radius: tip.radius, rod: null, joints };
}

function ofController(source, frame, space) {
  const pose = frame.getPose(source.targetRaySpace, space);
  if (!pose) return null;
  const { matrix, position } = pose.transform;
  const centre = {
    x: position.x - ROD * matrix[8],
    y: position.y - ROD * matrix[9],
    z: position.z - ROD * matrix[10],
  };
  return { centre, radius: TIP_RADIUS, rod: pose.transform, joints: [] };
}

/**
 * Where the table goes for a person: in front, below the eyes, facing them, once, so that nothing moves by itself.
 * @param {XRRigidTransform} head of the viewer
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

const AWAY = 0.42; // m from the eyes to the middle of the table: the far row is within an arm's reach
const BELOW_EYES = 0.5; // m: looked at with a bent neck, not a bowed back
const [LOWEST, HIGHEST] = [0.55, 1.15]; // m over the floor: seated to standing
