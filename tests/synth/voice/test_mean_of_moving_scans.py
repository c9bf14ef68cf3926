"""Displacement along a motion: z minus its mean, whichever way the finger goes, and whatever its load is."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import ridgewave as rw

pytestmark = pytest.mark.filterwarnings("ignore::ridgewave.RenderWarning")

STEPS = [0.0, 3e-6, 6e-6, 9e-6, 12e-6, -20e-6, -10e-6, -4e-6]  # m: its mirror image is another texture


def rendered(tolerance: float, quantities: tuple[str, ...], duration: float, **sections: Any) -> rw.Sound:
    channels = [{"quantity": name} for name in quantities]
    output = {"channels": channels, "sample_rate": 8000, "duration": duration}
    return rw.render({**sections, "output": output, "accuracy": {"tolerance": tolerance}})


def within_told(one: rw.Sound, other: rw.Sound) -> bool:
    assert one.plan is not None and other.plan is not None
    told = [one.plan.estimated_error[name] + other.plan.estimated_error[name] for name in one.quantities]
    extents = [channel["peak_to_peak"] for channel in other.plan.response["channels"]]
    return bool(np.all(np.max(np.abs(one.values - other.values), axis=0) <= np.array(told) * extents))


def test_a_recording_that_runs_backwards_is_the_backward_scan() -> None:
    """Skin that remembers has another mean in each direction."""
    sections = {
        "finger": {"contact_length": 4e-3},
        "texture": {"kind": "profile", "heights": STEPS, "spacing": 2.5e-4},
        "effects": {"viscous_skin": {"time_constant": 5e-3}},
    }
    points = [[0.01 * n, -0.0005 * n, 0.3] for n in range(11)]
    steady, recorded = (
        rendered(1e-2, ("displacement", "velocity"), 0.1, scan=scan, **sections)
        for scan in ({"speed": -0.05, "load": 0.3}, {"trajectory": points})
    )
    differing = np.max(np.abs(steady.values - recorded.values)[200:700], axis=0)
    assert np.all(differing <= 1e-3 * np.ptp(steady.values, axis=0))


def test_the_mean_of_a_finger_that_grows_has_a_kink_at_the_lift_load() -> None:
    points = [[t, 0.1 * t, min(1.0, t / 0.05) ** 2] for t in (0.01 * n for n in range(11))]
    rough, fine = (
        rendered(
            tolerance, ("displacement", "acceleration"), 0.1,
            effects={"contact_growth": {"exponent": 1}}, scan={"trajectory": points},
        )
        for tolerance in (1e-2, 5e-4)
    )  # fmt: skip
    assert np.all(np.max(np.abs(rough.values - fine.values), axis=0) <= 1e-3 * np.ptp(fine.values, axis=0))


def test_a_path_over_an_area_has_the_mean_of_the_line() -> None:
    heights = [0.0, 4e-6, 9e-6, 2e-6, -8e-6, -7e-6]
    loads = [0.1 + 0.08 * np.sin(70.0 * t) for t in np.linspace(0.0, 0.06, 15)]
    times = np.linspace(0.0, 0.06, 15)
    line = [[float(t), float(0.03 * t), float(w)] for t, w in zip(times, loads, strict=True)]
    path = [[t, -x, 0.0, 0.0, w] for t, x, w in line]
    finger = {"contact_length": 2e-3, "ridge_period": 0.4e-3}
    profile = {"kind": "profile", "heights": heights, "spacing": 1.7e-4, "phase": 0.3}
    area = {"kind": "heightmap", "rows": [heights] * 3, "spacing": 1.7e-4, "ends": "join", "phase": 0.3}
    along = rendered(1e-3, ("displacement",), 0.06, finger=finger, texture=profile, scan={"trajectory": line})
    over = rendered(1e-2, ("displacement",), 0.06, finger=finger, texture=area, scan={"trajectory": path})
    assert within_told(over, along)
