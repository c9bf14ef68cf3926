"""Stick-slip on flat surfaces: bent paths that stop, the level of the force, and what the plan tells of both."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from synth.accuracy.costing import explain
from synth.encode.sound import Sound, render

FLAT: dict[str, Any] = {"texture": {"amplitude": 0}, "finger": {"kind": "probe"}}
PACE, REST = np.linspace(0.0, 1.0, 251), np.full(150, 1.0)
WAY = np.r_[PACE**2 * (3.0 - 2.0 * PACE), REST]  # 0 to 1 in 0.5 s, then at rest
TIMES = 0.002 * np.arange(len(WAY))
RINGING = {
    "static_friction": 0.2508, "kinetic_friction": 0.06599, "stribeck_speed": 0.01748, "mass": 0.021, "damping": 1.19,
    "stiffness": 1951, "bristle_stiffness": 1169, "bristle_damping": 0.29,
}  # fmt: skip
SLOW_TO_SETTLE = {
    "static_friction": 0.30424, "kinetic_friction": 0.136266, "stribeck_speed": 0.0713447, "mass": 6.3325e-4,
    "damping": 0.27277, "stiffness": 6987.5, "bristle_stiffness": 31038.2, "bristle_damping": 0.206127,
}  # fmt: skip


def flat(scan: dict[str, Any], settings: dict[str, Any], output: dict[str, Any] | None = None) -> Any:
    return {**FLAT, "scan": scan, "effects": {"stick_slip": settings}, "output": output or {}}


def forces_of(sound: Sound) -> Any:
    """Return the forces along x and y [frames, 2], N."""
    columns = [sound.quantities.index(name) for name in ("friction_force", "friction_force_y")]
    return np.asarray(sound.values, dtype=np.float64)[:, columns]


def along(x: Any, y: Any) -> Any:
    """Return the forces of a recording on wet glass."""
    points = np.c_[TIMES, x, y, 0.0 * TIMES, 0.0 * TIMES + 0.4].tolist()
    return forces_of(render(flat({"trajectory": points}, {"surface": "wet_glass", "components": "xy"})))


PATHS = {
    "straight": (0.006 * WAY, 0.0 * WAY),
    "half a circle": (0.002 * np.cos(np.pi * WAY), 0.002 * np.sin(np.pi * WAY)),
    "a bump": (0.006 * WAY, 1e-4 * np.exp(-(((0.006 * WAY - 0.003) / 3e-4) ** 2))),
    "a tracker that trembles": (0.006 * WAY, 3e-6 * np.sin(997.0 * TIMES) * np.cos(1361.0 * TIMES)),
    "a tracker that trembles both ways": (0.006 * WAY + 3e-6 * np.sin(1501.0 * TIMES), 3e-6 * np.sin(997.0 * TIMES)),
}


@pytest.mark.parametrize("path", PATHS)
def test_a_skin_that_sticks_keeps_its_force_where_the_hand_stops(path: str) -> None:
    force = along(*PATHS[path])
    moving = force[4800:24000]
    rest = force[27000:-960]  # before the lift
    largest = 0.8 * 0.4
    assert np.max(np.hypot(*force.T)) < 1.2 * largest
    assert np.max(np.abs(np.diff(force, axis=0))) < 0.02 * largest * 4.0, "a slip takes a millisecond, a click a frame"
    assert np.min(np.hypot(*rest.T)) > 0.25 * np.mean(np.hypot(*moving.T)), "nothing lets go of the skin"
    assert np.ptp(np.hypot(*rest.T)) < 0.1 * largest


@pytest.mark.parametrize("heading", ["0 deg", "60 deg", "90 deg"])
def test_the_frequency_is_that_of_the_way_of_the_hand_in_any_direction(heading: str) -> None:
    scan = {"speed": "10 mm/s", "load": "0.5 N", "heading": heading}
    told = explain(flat(scan, {"surface": "wet_glass", "components": "xy"})).document()["response"]["motion"]
    assert told["frequency_hz"] == pytest.approx(35.5366, rel=1e-4)


def test_a_ringing_that_dies_out_is_sliding() -> None:
    told = explain(flat({"speed": "37 mm/s", "load": 0.5557}, RINGING)).document()["response"]["motion"]
    assert told["frequency_hz"] == 0.0
    assert "sticks and slips" not in told["reason"]


def test_the_force_of_a_finger_that_settles_late_is_that_of_its_file() -> None:
    scene = flat({"speed": 0.0869219, "load": 2.1088}, SLOW_TO_SETTLE, {"duration": 4.0})
    told = explain(scene).document()["response"]["motion"]["force_peak_to_peak"]
    late = np.asarray(render(scene).values, dtype=np.float64)[96000:, 1]
    assert told == pytest.approx(np.ptp(late), rel=0.01)


def test_an_error_of_the_force_is_told_on_a_surface_without_height_and_warned_of_where_it_is_felt() -> None:
    loose = {"surface": "wet_glass", "mass": 1e-6, "damping": 0.0, "bristle_damping": 0.0}
    plan = explain(flat({"speed": "10 mm/s", "load": "0.5 N"}, loose))
    assert plan.estimated_error["friction_force"] > 0.1
    assert any("The error of the friction force" in warning for warning in plan.warnings)
    usual = explain(flat({"speed": "10 mm/s", "load": "0.5 N"}, {"surface": "wet_glass"}))
    assert 0.0 < usual.estimated_error["friction_force"] < 0.01
    assert not any("friction force" in warning for warning in usual.warnings)


@pytest.mark.parametrize(("rate", "duration"), [(48000, 1.0), (8000, 1.0), (8000, 10.0)])
def test_the_told_error_is_that_of_the_force_at_any_time(rate: int, duration: float) -> None:
    scan, settings = {"speed": "10 mm/s", "load": "0.5 N"}, {"surface": "wet_glass", "full_scale": 1.0}
    output = {"sample_rate": rate, "duration": duration}
    drawn = render(flat(scan, settings, output))
    finer = render(flat(scan, settings, output | {"sample_rate": 192000}))
    told = explain(flat(scan, settings, output)).estimated_error["friction_force"]
    one, other = (np.asarray(sound.values, dtype=np.float64)[:, 1] for sound in (drawn, finer))
    wrong = np.max(np.abs(one - other[:: 192000 // rate])) / np.ptp(other)
    assert wrong < told, (wrong, told)
    assert told < 10.0 * wrong, "no more than it is"


@pytest.mark.parametrize("damping", [3.0, 100.0, 1000.0])
def test_a_file_of_the_force_stays_within_its_scale(damping: float) -> None:
    sound = render(flat({"stroke": {"speed": "20 mm/s"}}, {"bristle_damping": damping}))
    peak = np.max(np.abs(np.asarray(sound.values, dtype=np.float64)[:, 1])) / sound.full_scale[1]
    assert 0.4 < peak <= 0.8 * (1.0 + 1e-6)
