"""A recording that lifts and lands within itself is solved as often as its quickest landing requires."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from synth.plan.frame_solver import FrameSolver
from synth.plan.preparation import Preparation, prepare
from synth.response.table_error import QUANTITIES
from synth.response_cache import ResponseCache
from synth.scene.scene import parse_scene
from tests.few import thorough

GRATING = {"kind": "grating", "period": "1 mm", "height": "50 um", "ramp": "0.2 mm"}
FINGERTIP = {"kind": "fingertip", "contact_length": "5 mm"}
NARROW = {"sample_rate": 4000, "bandwidth": 500}


def taps(step: float, count: int = 24) -> list[list[float]]:
    """Return points `step` (s) apart: on the surface for three of six, at 80 mm/s."""
    return [[step * n, 0.08 * step * n, 0.5 if 0 < n % 6 < 4 else 0.0] for n in range(count)]


def planned(finger: dict[str, Any], texture: dict[str, Any], step: float, output: dict[str, Any], tol: float) -> Any:
    output = {"channels": list(QUANTITIES), "sample_rate": 16_000, **output}
    scene = {"finger": finger, "texture": texture, "scan": {"trajectory": taps(step)}, "output": output}
    return prepare(parse_scene({**scene, "accuracy": {"tolerance": tol}}), ResponseCache())


def frames_of(solved: Preparation, finer: int) -> Any:
    """Return all frames with `finer` times the planned solutions, SI [quantities, frames]."""
    plan = solved.frames
    assert plan is not None and solved.mean is not None
    rate, heights = solved.scene.output.sample_rate, solved.whole.heights
    count, stride = finer * plan.count, plan.stride
    solver = FrameSolver(
        heights, solved.scene, solved.mean, rate, count=count, scale=plan.scale, stride=stride, longest=0
    )
    length = round((solved.scene.scan.trajectory[-1][0] + 0.02) * rate)  # type: ignore[index]
    chunks = range(-(-length // solver.chunk))
    return np.concatenate([solver.solved(number, (0, 1, 2)) for number in chunks], axis=1)


@pytest.mark.parametrize(
    ("finger", "texture", "step", "output", "tolerance"),
    [
        (FINGERTIP, {}, 8e-3, {}, 1e-2),
        ({"kind": "probe"}, GRATING, 8e-3, NARROW, 1e-2),
        *(
            thorough(finger, texture, step, output, tolerance)
            for finger, tolerance in ((FINGERTIP, 1e-2), ({"kind": "probe"}, 1e-3), ({}, 1e-3))
            for texture in ({}, GRATING)
            for step in (2e-3, 3e-2)
            for output in ({}, NARROW)
        ),
    ],
)
def test_landings_within_a_recording_keep_the_tolerance_and_the_told_error(
    finger: dict[str, Any], texture: dict[str, Any], step: float, output: dict[str, Any], tolerance: float
) -> None:
    solved = planned(finger, texture, step, output, tolerance)
    errors = np.max(np.abs(frames_of(solved, 1) - frames_of(solved, 8)), axis=1)
    for channel, error, told in zip(solved.channels, errors, solved.frames.errors, strict=True):
        assert error / channel.extent <= told <= 1.1 * tolerance


def test_a_landing_that_would_take_too_many_solutions_tells_its_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """It is several times the tolerance with the number of a slow landing."""
    monkeypatch.setattr("synth.plan.landing.PATIENCE", 1e-3)
    solved = planned(FINGERTIP, {}, 8e-3, {}, 1e-2)
    error = np.max(np.abs(frames_of(solved, 1) - frames_of(solved, 8)), axis=1)[2] / solved.channels[2].extent
    assert 2e-2 < error <= solved.frames.errors[2]
    assert any("acceleration of the moving scan may be" in text for text in solved.warnings)


def test_a_landing_that_takes_too_long_to_look_at_is_extrapolated(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("synth.plan.landing.ROUNDS", 0)  # the same as a LONGEST that the next number exceeds
    solved = planned(FINGERTIP, {}, 8e-3, {}, 1e-2)
    errors = np.max(np.abs(frames_of(solved, 1) - frames_of(solved, 8)), axis=1)
    for channel, error, told in zip(solved.channels, errors, solved.frames.errors, strict=True):
        assert error / channel.extent <= told <= 1.1e-2
