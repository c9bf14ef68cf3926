/* WebXR sessions: whether one is available, and starting one.

Limits: `immersive-vr` only. The origin is on the floor if the headset knows it, otherwise at the first place of the
head. */

/** @returns {Promise<string>} why VR is not available and what to do, a sentence; empty if it is available */
export async function whyNoHeadset() {
  if (!window.isSecureContext) return "VR requires a secure page. Open this page over https or from localhost.";
  if (!navigator.xr) return "This browser has no WebXR. Open this page in the browser of a headset.";
  try {
    if (await navigator.xr.isSessionSupported("immersive-vr")) return "";
  } catch {
    return "WebXR is not permitted here. Open this page in its own window.";
  }
  return "No headset was found. Connect one, or open this page in the browser of a headset.";
}

/**
 * Starts a session for the renderer. Must be called in a user gesture.
 * @param {{xr: object}} renderer of three.js
 * @returns {Promise<{session: XRSession, floor: boolean}>} `floor`: whether y = 0 is the floor
 */
export async function enter(renderer) {
  const session = await navigator.xr.requestSession("immersive-vr", {
    optionalFeatures: ["local-floor", "hand-tracking"],
  });
  let floor = true;
  try {
    await session.requestReferenceSpace("local-floor");
  } catch {
    floor = false;
  }
  renderer.xr.setReferenceSpaceType(floor ? "local-floor" : "local");
  await renderer.xr.setSession(session);
  return { session, floor };
}
