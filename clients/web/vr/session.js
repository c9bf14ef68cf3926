/* Whether a headset can be entered, why not, and the WebXR session itself.

Limits: `immersive-vr` only. Poses are of the floor where the headset knows it, else of where the head began. */

/** @returns {Promise<string>} why VR is not available, a sentence that says what to do; empty where it is */
export async function whyNoHeadset() {
  if (!window.isSecureContext) return "VR needs a secure page: open this one by https or from localhost.";
  if (!navigator.xr) return "This browser has no WebXR: open this page in the browser of a headset.";
  try {
    if (await navigator.xr.isSessionSupported("immersive-vr")) return "";
  } catch {
    return "This page may not use WebXR: open it in a window of its own.";
  }
  return "No headset answers: connect one, or open this page in the browser of a headset.";
}

/**
 * Starts a session and hands it to the renderer; call it in a user gesture.
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
