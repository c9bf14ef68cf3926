"""The told error of a force that a simulation provides, beside inertia and adhesion, against finer ones."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import ridgewave as rw
from tests.few import thorough

SCANS: dict[str, dict[str, Any]] = {
    "constant": {"speed": 0.1, "load": 0.3},
    "stroke": {"stroke": {"speed": 0.1, "length": 0.006, "turn_time": 0.03, "load": 0.3}},
    "recording": {"trajectory": [[0.0, 0.0, 0.3], [0.03, 0.002, 0.3], [0.06, 0.003, 0.3], [0.1, 0.008, 0.3]]},
    "load": {"trajectory": [[0.0, 0.0, 0.3], [0.03, 0.002, 0.5], [0.06, 0.003, 0.1], [0.1, 0.008, 0.3]]},
}


@pytest.mark.filterwarnings("ignore::ridgewave.RenderWarning")
@pytest.mark.parametrize(
    ("scan", "effect"),
    [
        ("constant", "adhesion"),
        ("recording", "adhesion"),
        ("load", "inertia"),
        *(thorough(*case) for case in (("stroke", "inertia"), ("stroke", "adhesion"), ("constant", "inertia"))),
    ],
)
def test_the_told_error_of_a_simulated_force_is_not_exceeded(scan: str, effect: str) -> None:
    """A slow finger has finer waves in the band, and a table half as fine has its own integral of the energy."""
    document = {
        "finger": {"kind": "probe", "tip_radius": "0.7 mm"},
        "scan": SCANS[scan],
        "effects": {effect: {}, "tangential": {"friction_coefficient": 0}},
        "output": {"duration": 0.1, "sample_rate": 16000},
    }
    found, finer = (rw.render(document, accuracy={"tolerance": one}) for one in (1e-3, 1e-6))
    assert found.plan is not None
    extents = np.array([one["peak_to_peak"] for one in found.plan.response["channels"]])
    told = np.array([found.plan.estimated_error[one] for one in found.quantities])
    missed = np.max(np.abs(found.values - finer.values), axis=0) / extents
    assert np.all(missed <= told), f"{missed} of the peak-to-peak, told {told}"
    assert told[0] < 2e-3, "the acceleration has no false warning"
