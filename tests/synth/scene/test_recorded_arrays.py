"""Rules about recorded points hold for arrays as they do for lists."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest

from synth.errors import SceneError
from synth.scene.scene import parse_scene


def named(points: Any) -> Any:
    """Return the points as records."""
    kinds = [(name, float) for name in ("t", "x", "y", "direction", "load")]
    return np.array([tuple(point) for point in points], dtype=kinds)


def tabled(points: Any) -> Any:
    """Return the points as a pandas table in another order."""
    return pd.DataFrame(points, columns=["t", "x", "y", "direction", "load"])[["load", "t", "y", "x", "direction"]]


@pytest.mark.parametrize("form", [lambda rows: rows, np.ndarray.tolist, list, named, tabled])
def test_a_recording_over_an_area_is_read_in_every_form_on_every_texture(form: Any) -> None:
    points = np.linspace([0.0, 0.0, 0.0, 0.0, 0.3], [0.2, 0.01, 0.01, 0.1, 0.4], 11)
    for texture in ("grating", "dots"):
        scan = parse_scene({"texture": {"kind": texture}, "scan": {"trajectory": form(points)}}).scan
        assert not scan.along_x and scan.trajectory == tuple(map(tuple, points.tolist()))
    with pytest.raises(SceneError, match=r"scan\.heading: .* not beside points over an area"):
        parse_scene({"texture": {"kind": "dots"}, "scan": {"trajectory": form(points), "heading": 0.1}})
