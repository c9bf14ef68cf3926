"""The heights of a texture over an area, as a part of the picture of a scene.

Model: as many heights along a period as across it, for display only.
Limits: at most MOST_AREA heights per side; finer surfaces are drawn coarser than they are.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from synth.scene.scene import Scene

MOST_AREA = 256  # heights per side; more would be a megabyte of JSON, and finer than a page draws
DIGITS = 4  # significant digits of a height: finer than a shade of the picture


def area_of(scene: Scene, count: int) -> dict[str, Any]:
    """Return the fields `across` and `area` of `texture` in a picture; none for a texture along a line.

    count: heights per side, 0 to MOST_AREA; 0 for none.
    across: period across, m.
    area: rows of heights, m, at y = i across / count; in a row at x = j period / count.
    """
    if not count:
        return {}
    from synth.surfaces import profile_of
    from synth.surfaces.height_field import HeightField

    field = profile_of(scene)
    if not isinstance(field, HeightField):
        return {}
    steps = np.arange(count) / count
    heights = field.area(steps * field.period, steps * field.across)
    return {"across": field.across, "area": [[float(f"{height:.{DIGITS}g}") for height in row] for row in heights]}
