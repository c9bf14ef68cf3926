"""Recorded scans: the rendered motion stays between the recorded points, is smooth, and reports changes."""

from __future__ import annotations

import numpy as np
import pytest

from synth.motion.motion import LOAD, LOAD_BEND, SPEED, SPEED_RATE
from synth.motion.recorded_motion import Curve, RecordedMotion
from synth.motion.scan_motion import ScanMotion
from synth.plan.prepare import prepare
from synth.scene.point_spacing import AROUND, LEAST_GAP, merged_places, spaced_times
from synth.scene.scene import Scene
from tests.synth.engine_cases import scene_of
from tests.synth.voice.recorded_cases import Points, random_recording, steady

RECORDINGS = 200
STEP = [[0, 0, 0.3], [0.1, 0.008, 0.3], [0.101, 0.00808, 3.0], [0.2, 0.016, 3.0]]


def recording(points: Points) -> Scene:
    return scene_of(scan={"trajectory": points})


def outside(curve: Curve, times: np.ndarray, values: np.ndarray) -> float:
    """Return how far a curve leaves the range of two neighbouring points, relative to the range of all points."""
    within = np.linspace(0.0, 1.0, 33)
    found = curve.value(times[:-1, None] + np.diff(times)[:, None] * within)
    low, high = np.minimum(values[:-1], values[1:]), np.maximum(values[:-1], values[1:])
    beyond = np.maximum(low[:, None] - found, found - high[:, None]).max()
    return float(beyond) / max(1e-6, float(np.abs(values).max()))


def test_place_and_load_stay_between_neighbouring_points() -> None:
    changed = 0
    for seed in range(RECORDINGS):
        points = np.array(random_recording(seed))
        points[:, 0] -= points[0, 0]
        found = RecordedMotion.of(recording(points.tolist()))
        times, places = merged_places(points[:, 0], points[:, 1])
        spaced = spaced_times(points[:, 0])
        assert outside(found.place, times, places) <= 1e-12, seed
        assert outside(found.load, spaced, points[:, 2]) <= 1e-12, seed
        assert np.allclose(found.load.value(spaced), points[:, 2], rtol=0.0, atol=1e-12), seed
        untouched = len(times) == len(points) and np.array_equal(spaced, points[:, 0])
        assert bool(found.warnings) != untouched, seed
        if untouched:
            assert np.allclose(found.place.value(points[:, 0]), points[:, 1], rtol=0.0, atol=1e-12), seed
        assert np.max(np.abs(spaced - points[:, 0])) <= 0.5 * AROUND, seed
        assert np.all(np.diff(spaced) > 0.0), seed
        changed += not untouched
    assert 0.1 * RECORDINGS < changed < 0.9 * RECORDINGS  # some are changed and some are not


@pytest.mark.parametrize("rise", [1e-3, 2e-6])
def test_a_step_of_the_load_is_passed_without_overshoot(rise: float) -> None:
    """Splines reached 54 N within 1 ms, and 1000 N within 2 us."""
    points = [*STEP[:2], [0.1 + rise, 0.008 + 0.08 * rise, 3.0], STEP[3]]
    motion = ScanMotion(recording(points), 1_000_000).at(0, 200_000)
    loads = motion.samples[LOAD]
    assert loads.min() >= 0.3 - 1e-12 and loads.max() <= 3.0 + 1e-12
    assert np.max(np.abs(motion.samples[SPEED])) <= 0.0801
    assert np.max(np.abs(motion.samples[LOAD_BEND])) <= 10.0 * 2.7 / LEAST_GAP**2


def test_a_report_that_comes_twice_makes_no_leap() -> None:
    """One additional point, 10 us later and 50 um further on, turned a stroke of 80 mm/s into 5 m/s."""
    points = steady(0.01, 21)
    points.insert(10, [points[9][0] + 1e-5, points[9][1] + 50e-6, 0.3])
    scene = recording(points)
    motion = ScanMotion(scene).at(0, 9600)
    assert np.max(np.abs(motion.samples[SPEED])) <= 0.09 and scene.scan.speed <= 0.09
    assert np.max(np.abs(motion.position - 0.08 * np.arange(9600) / 48000)) <= 30e-6
    assert any("too close in time" in text for text in prepare(scene).warnings)


@pytest.mark.parametrize("interval", [1e-4, 1e-3, 8e-3, 0.033, 0.1])
def test_even_times_are_never_changed(interval: float) -> None:
    points = np.array(steady(interval, 60))
    points[:, 1] += 1e-4 * np.sin(1e3 * points[:, 0])
    assert np.array_equal(spaced_times(points[:, 0]), points[:, 0])
    assert len(merged_places(points[:, 0], points[:, 1])[0]) == 60
    assert not RecordedMotion.of(recording(points.tolist())).warnings


def test_a_straight_line_is_one() -> None:
    scene = recording([[0, 0, 0.3], [0.01, 0.001, 0.3], [0.05, 0.005, 0.3], [0.3, 0.03, 0.3]])
    motion = ScanMotion(scene).at(0, 14400)
    assert np.max(np.abs(motion.samples[SPEED] - 0.1)) <= 1e-12
    assert np.max(np.abs(motion.samples[SPEED_RATE])) <= 1e-9


def test_the_second_derivative_goes_on_and_the_third_is_bounded() -> None:
    for seed in range(40):
        points = np.array(random_recording(seed))
        found = RecordedMotion.of(recording(points.tolist()))
        for curve in (found.place, found.load):
            knots = curve.value.x[1:-1]
            side = 1e-9 * np.minimum(np.diff(curve.value.x)[:-1], np.diff(curve.value.x)[1:])
            places = curve.value.x[:-1] + np.diff(curve.value.x) * np.linspace(0.0, 1.0, 33)[:, None]
            for part in (curve.value, curve.slope, curve.bend):
                scale = max(1e-3, float(np.max(np.abs(part(places)))))
                assert np.max(np.abs(part(knots + side) - part(knots - side))) <= 1e-6 * scale, seed


def test_the_load_lifts_within_its_recorded_range() -> None:
    points = [[0.0, 0, 3.0], [0.05, 0.004, 0.3], [0.1, 0.008, 0.5], [0.15, 0.012, 4.0]]
    scene = scene_of(scan={"trajectory": points}, output={"duration": 0.25})
    loads = ScanMotion(scene).at(-960, 12960).samples[LOAD]
    assert loads.max() <= 4.0 and loads[:960].max() <= 3.0
    assert loads[-1] == 0.0


def test_a_recorded_finger_turns_the_short_way_round() -> None:
    turned = [3.1, -3.1, 3.0, 3.0 - 4.0 * np.pi]
    points = [[0.1 * n, 0.0, 0.0, angle, 0.3] for n, angle in enumerate(turned)]
    found = RecordedMotion.of(scene_of(texture={"kind": "dots"}, scan={"trajectory": points}))
    assert found.area is not None
    angles = found.area[1].value(np.array([0.0, 0.1, 0.2, 0.3]))
    np.testing.assert_allclose(angles, [3.1, 2.0 * np.pi - 3.1, 3.0, 3.0], atol=1e-9)
    assert np.ptp(found.area[1].value(np.linspace(0.0, 0.3, 100))) < 0.2
