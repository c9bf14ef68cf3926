"""The error that the plan of a file along a path tells, against smaller cells and more solutions along all of it."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from synth.arrays import Array
from synth.plan import own_motion
from synth.plan.prepare import prepare
from synth.response.table_error import QUANTITIES
from synth.response_cache import ResponseCache
from synth.sampling.frame_solver import FrameSolver
from synth.scene.scene import parse_scene
from tests.few import thorough

COMB = {"contact_length": "1 mm"}
TIP = {"kind": "fingertip", "contact_length": "2 mm"}
SECONDS = 0.2


def around(load: float, swing: float, turns: float) -> list[list[float]]:
    """Return half a circle at 50 mm/s under a load that swings, on which the finger turns."""
    times = np.linspace(0.0, SECONDS, 21)
    angle = times * 0.05 / 5e-3
    x, y = 5e-3 * np.cos(angle), 5e-3 * np.sin(angle)
    rows = times, x, y, turns * np.sin(3.0 * times), load + swing * np.sin(9.0 * times)
    found: list[list[float]] = np.stack(rows, axis=1).tolist()
    return found


def along(turns: float) -> list[list[float]]:
    """Return a straight path at an angle, with a load that does not change."""
    times = np.linspace(0.0, SECONDS, 4)
    rows = times, 0.04 * times, 0.02 * times, turns * times, np.full(4, 0.3)
    found: list[list[float]] = np.stack(rows, axis=1).tolist()
    return found


def rough() -> list[list[float]]:
    """Return the heights of a random surface, m."""
    random = np.random.default_rng(3)
    waves = np.hypot(*np.meshgrid(np.fft.fftfreq(48), np.fft.fftfreq(48)))
    power = np.where((waves > 0.02) & (waves < 0.2), np.maximum(waves, 0.01) ** -1.5, 0.0)
    heights = np.fft.ifft2(np.fft.fft2(random.standard_normal((48, 48))) * power).real
    found: list[list[float]] = (15e-6 * heights / heights.std()).tolist()
    return found


MAP = {"kind": "heightmap", "spacing": "0.1 mm", "rows": rough()}
DOTS = {"kind": "dots"}
FLAT = {"contact_length": "1 mm", "stiffness": 3000.0}  # two ridges on one period: the steady scan is still
LOW = {"kind": "dots", "period": "1 mm", "row_distance": "1 mm", "dot_height": "20 um", "dot_diameter": "0.6 mm"}
CASES: dict[str, tuple[dict[str, Any], dict[str, Any], list[list[float]]]] = {
    "a comb that turns on dots": (COMB, DOTS, around(0.1, 0.03, 0.3)),
    "a fingertip that turns on dots": (TIP, DOTS, around(0.15, 0.05, 0.3)),
    "a comb on a map at one load": (COMB, MAP, along(0.0)),
    "a fingertip on a map": (TIP, MAP, around(0.15, 0.05, 0.0)),
    "a comb at one load on dots": (COMB, DOTS, along(0.5)),
    "a comb in full contact that turns at one load": (FLAT, LOW, along(1.0)),
}

QUICK = "a fingertip that turns on dots", "a fingertip on a map", "a comb at one load on dots"


@pytest.mark.parametrize("case", [case if case in QUICK else thorough(case) for case in CASES])
def test_a_file_along_a_path_tells_its_error(case: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(own_motion, "MOST_WORK", 400)  # the smallest cells take a minute
    finger, texture, points = CASES[case]
    output = {"duration": SECONDS, "sample_rate": 8000, "bandwidth": 500, "channels": list(QUANTITIES), "fade": 0}
    scene = parse_scene({
        **{"finger": finger, "texture": texture, "scan": {"trajectory": points}, "output": output},
        "accuracy": {"tolerance": 0.03},
    })  # fmt: skip
    solved = prepare(scene, ResponseCache())
    assert solved.frames is not None and solved.mean is not None and solved.contact is not None

    def frames(contact: Any, more: int) -> Array:
        plan = solved.frames
        assert plan is not None and solved.mean is not None
        solver = FrameSolver(
            contact.heights, scene, solved.mean, 8000, count=more * plan.count, stride=plan.stride, scale=plan.scale
        )
        numbers = range(math.ceil(8000 * SECONDS / solver.chunk))
        return np.concatenate([solver.solved(number, solved.orders) for number in numbers], axis=1)[:, :1600]

    smaller = replace(solved.contact, coarser=solved.contact.coarser / 2.0)  # type: ignore[attr-defined, call-arg]
    found, exact = frames(solved.contact, 1), frames(smaller, 2)
    extents = np.ptp(exact, axis=1)
    told = [channel.error * channel.extent for channel in solved.channels]
    missed = np.max(np.abs(found - exact), axis=1)
    assert np.all(missed <= told), f"{missed / extents} of the peak-to-peak, told {told / extents}"
    assert np.max(missed / told) > 0.02, "what is told is not a guess"
