"""A file on a table of the energy keeps the tolerance in every quantity, though the table's own is that of z."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import ridgewave as rw
from tests.few import thorough

COMB = {"contact_length": "3 mm", "ridge_period": "0.43 mm", "ridge_amplitude": "35 um"}
STROKE = {"stroke": {"speed": 0.1, "length": 0.006, "turn_time": 0.03, "load": 0.3}}
EFFECTS: list[Any] = [{"adhesion": {}, "inertia": {}}, thorough({"inertia": {}})]


@pytest.mark.filterwarnings("ignore::ridgewave.RenderWarning")
@pytest.mark.parametrize("effects", EFFECTS, ids=str)
def test_a_stroke_keeps_the_tolerance_and_what_it_tells(effects: dict[str, Any]) -> None:
    document = {"finger": COMB, "scan": STROKE, "effects": effects, "output": {"duration": 0.2, "sample_rate": 16000}}
    exact = rw.render(document, accuracy={"tolerance": 3e-5}).values
    for tolerance in (3e-3, 1e-3):
        sound = rw.render(document, accuracy={"tolerance": tolerance})
        assert sound.plan is not None
        told = sound.plan.estimated_error["acceleration"]
        missed = np.max(np.abs(sound.values - exact)) / sound.plan.response["channels"][0]["peak_to_peak"]
        assert missed <= told <= tolerance, f"{missed:.2g} of the peak-to-peak, told {told:.2g}"
