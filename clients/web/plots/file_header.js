/* What a file of a plot says about itself: the scene with its hash, the error of the plan, and what is shown. */

import { hashOfScene } from "../scene/scene_hash.js";
import { call } from "../service.js";

/** Returns the header of a plot of a snapshot (toolbar.js), of several for a comparison: an object of JSON values.
 *  transform: of a spectrum, whose last frame is last_frame.
 *  scene_sha256: see scene_hash.js; null where the service does not answer or the page is not secure.
 *  estimated_error: of each quantity, relative to its peak-to-peak. response_table: the hash of the table that the
 *  stream read, or null. */
export async function headerOf(plot) {
  const { kind, snapshots, snapshot } = plot;
  if (plot.header) return plot.header();
  const header = { program: "ridgewave", plot: kind };
  if (plot.transform) header.transform = { window: "HFT90D", frames: plot.transform }; // fourier_transform.js
  if (!snapshots) return { ...header, ...(await originOf(snapshot)) };
  for (const [slot, one] of Object.entries(snapshots)) header[slot] = await originOf(one);
  return header;
}

/** Returns where the samples of a snapshot come from. */
async function originOf({ scene: asked, plan, quantity, rate, firstFrame, samples, known }) {
  const complete = await call("POST", "/v1/explain", asked).then(
    ({ scene }) => scene,
    () => null,
  );
  return {
    ...{ quantity, sample_rate: rate, first_frame: firstFrame, last_frame: firstFrame + samples.length - known - 1 },
    scene_sha256: complete && (await hashOfScene(complete)),
    response_table: plan?.response?.table?.hash ?? null,
    estimated_error: plan?.estimated_error ?? null,
    scene: complete ?? asked,
  };
}

/** Returns the header as lines under a picture: one, or one of each slot. */
export function captionOf(header) {
  const parts = header.A || header.B ? ["A", "B"].filter((slot) => header[slot]) : [""];
  return parts.map((slot) => {
    const { scene_sha256: hash, estimated_error: errors, quantity } = slot ? header[slot] : header;
    const error = errors?.[quantity];
    const told = error === undefined ? "" : ` · error ${error.toExponential(1)} of peak-to-peak`;
    return `${slot ? `${slot}: ` : ""}scene ${hash?.slice(0, 16) ?? "without a hash"}${told}`;
  });
}
