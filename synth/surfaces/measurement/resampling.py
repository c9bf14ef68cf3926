"""Resampling: a profile whose steps of x are not equal, interpolated to equal steps.

Stage   SURFACES, from files.
Model   Straight lines between neighbouring points, read at equal steps from the first point on. Missing points are left
        out first ("fill"), or only the longest piece without them is kept ("crop").
Limits  Detail that is finer than the new step is lost without a filter. Between distant points the profile is a
        straight line, which was not measured. The last point is kept only if a step ends there.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from synth.errors import Fault, InvalidRequest
from synth.scene.quantity import Dimension, show_quantity
from synth.surfaces.readers.surface_file import Heights, Missing, check_shape

WIDE = 5.0  # times the new step: a distance between neighbouring points that a note mentions


def resampled(
    positions: Heights, heights: Heights, missing: Missing, rule: str, step: float
) -> tuple[Heights, dict[str, Any], str]:
    """Return heights at equal steps, the number of missing points with the rule, and a note of what was done.

    positions: x of each point (m), increasing.
    rule: for missing points.
    step: m.
    Raises InvalidRequest if points are missing and the rule is "refuse", and for a step longer than the profile.
    """
    count = int(np.count_nonzero(missing))
    done = {"points": count, "rule": rule}
    if count == heights.size:
        raise InvalidRequest([Fault("/file", "only missing points", "a profile with heights", "Is this the column?")])
    if count and rule == "refuse":
        share = f"{count} missing points ({100.0 * count / heights.size:.3g} %)"
        hint = "Write missing = fill to leave them out, or crop for the longest part without them."
        raise InvalidRequest([Fault("/missing", share, "no missing points", hint)])
    kept: Any = ~missing
    if rule == "crop" and count:
        from synth.surfaces.measurement.missing_points import largest_whole_part

        kept = largest_whole_part(missing)[0]
    positions, heights = positions[kept], heights[kept]
    length = float(positions[-1] - positions[0])
    if length < step:
        shown = _shown(length)
        raise InvalidRequest([Fault("/resample", _shown(step), f"at most {shown}, the length of x", "Write less.")])
    points = int(length / step * (1.0 + 1e-12)) + 1
    check_shape((points,))
    steps = np.diff(positions)
    note = (
        f"Resampled linearly to steps of {_shown(step)}. The file has {len(positions)} points in steps from "
        f"{_shown(float(np.min(steps)))} to {_shown(float(np.max(steps)))}"
    )
    if np.max(steps) > WIDE * step:
        note += ". Across the longest of them the profile is a straight line, which was not measured"
    return np.interp(positions[0] + step * np.arange(points), positions, heights), done, note


def _shown(length: float) -> str:
    return show_quantity(float(f"{length:.4g}"), Dimension.LENGTH)
