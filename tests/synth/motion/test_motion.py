"""Motions: each row of strokes and trajectories is the derivative of the one above; trajectories pass their points."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from synth.motion.motion import ACROSS, DIRECTION, LOAD, LOAD_BEND, LOAD_RATE, SPEED, SPEED_RATE, Motion, completed
from synth.motion.recorded_motion import rendered_part
from synth.motion.scan_motion import LIFT_TIME, ScanMotion
from synth.scene.scene import Scene
from tests.synth.engine_cases import Real, scene_of

RATE = 48000
POINTS = [[0.0, 0.0, 0.3], [0.05, 0.003, 0.35], [0.11, 0.008, 0.2], [0.17, 0.007, 0.4], [0.25, 0.0, 0.25]]


def trajectory() -> Scene:
    return scene_of(scan={"trajectory": POINTS}, output={"duration": 0.5})


def stroke(**fields: object) -> Scene:
    return scene_of(scan={"stroke": {"length": "10 mm", "speed": "80 mm/s", "turn_time": "50 ms", **fields}})


def slope(values: Real) -> Real:
    """Return the derivative of samples by five-point differences, float64 [frames - 4]."""
    return (values[:-4] - 8 * values[1:-3] + 8 * values[3:-1] - values[4:]) * RATE / 12


def test_missing_rates_are_the_differences_from_frame_to_frame() -> None:
    before = np.full(4, np.nan)
    first = completed(Motion.of(2, load=[0.1, 0.3], position=[0.0, 1e-4]), 100, before).samples
    second = completed(Motion.of(1, load=[0.2], position=[4e-4]), 100, before).samples
    assert first == pytest.approx(np.array([[0.0, 0.01], [0.0, 0.0], [0.1, 0.3], [0.0, 20.0], [0.0, 0.0]]))
    assert second == pytest.approx(np.array([[0.03], [2.0], [0.2], [-10.0], [-3000.0]]))


@pytest.mark.parametrize("scene", [stroke(), trajectory()], ids=["stroke", "trajectory"])
def test_rates_are_the_derivatives_of_what_they_follow(scene: Scene) -> None:
    motion = ScanMotion(scene).at(0, RATE // 2)
    samples, inner = motion.samples, slice(2, -2)
    assert np.max(np.abs(slope(motion.position) - samples[SPEED, inner])) <= 1e-6
    smooth = np.max(np.abs(samples[SPEED_RATE]))
    assert np.max(np.abs(slope(samples[SPEED]) - samples[SPEED_RATE, inner])) <= 2e-3 * smooth
    assert np.max(np.abs(slope(samples[LOAD]) - samples[LOAD_RATE, inner])) <= 1e-3 * max(
        float(np.max(np.abs(samples[LOAD_RATE]))), 1e-9
    )
    bend = float(np.max(np.abs(samples[LOAD_BEND])))
    assert np.max(np.abs(slope(samples[LOAD_RATE]) - samples[LOAD_BEND, inner])) <= 0.02 * max(bend, 1e-9)


@pytest.mark.parametrize("scene", [stroke(), trajectory()], ids=["stroke", "trajectory"])
def test_a_motion_has_two_continuous_derivatives(scene: Scene) -> None:
    samples = ScanMotion(scene).at(0, RATE // 2).samples
    finer = ScanMotion(scene)
    finer.rate = 8 * RATE
    dense = finer.at(0, 8 * RATE // 2).samples
    for row in (SPEED, SPEED_RATE, LOAD, LOAD_RATE, LOAD_BEND):
        extent = float(np.ptp(samples[row]))
        coarse_step = float(np.max(np.abs(np.diff(samples[row]))))
        fine_step = float(np.max(np.abs(np.diff(dense[row]))))
        assert fine_step <= 0.2 * coarse_step + 1e-9 * extent  # a step would not shrink


def test_a_stroke_goes_to_its_length_and_back_along_the_same_way() -> None:
    scene = stroke()
    assert scene.scan.stroke is not None
    frames = round(scene.scan.stroke.period * RATE)
    motion = ScanMotion(scene).at(0, 2 * frames)
    position, speed = motion.position, motion.samples[SPEED]
    assert position[0] == pytest.approx(0.0, abs=1e-12)
    assert speed[0] == pytest.approx(0.0, abs=1e-9)
    assert position.max() == pytest.approx(10e-3, rel=1e-6)
    assert position.min() >= -1e-12
    assert np.max(np.abs(speed)) == pytest.approx(0.08, rel=1e-9)
    half = frames // 2
    assert np.max(np.abs(position[: half + 1] - position[frames - half : frames + 1][::-1])) <= 2e-6
    assert np.all(motion.samples[LOAD] == 0.3)


def test_a_stroke_repeats_with_its_period() -> None:
    scene = stroke(turn_time=0.0625, length=0.08 * 0.0625)  # a period of a whole number of frames
    assert scene.scan.stroke is not None
    period = scene.scan.stroke.period * RATE
    assert period == round(period)
    first = ScanMotion(scene).at(0, round(period))
    later = ScanMotion(scene).at(1000 * round(period), round(period))
    assert np.max(np.abs(first.position - later.position)) <= 1e-11
    assert np.max(np.abs(first.samples - later.samples)) <= 1e-8


def test_a_trajectory_passes_through_its_points() -> None:
    scan = ScanMotion(trajectory())
    for t, position, load in POINTS:
        motion = scan.at(round(t * RATE), 1)
        assert motion.position[0] == pytest.approx(position, abs=1e-12)
        assert motion.samples[LOAD, 0] == pytest.approx(load, rel=1e-9)


def test_a_trajectory_begins_at_its_first_point_and_lifts_after_its_last_one() -> None:
    scan = ScanMotion(trajectory())
    before = scan.at(-100, RATE // 2).samples[LOAD]
    assert np.all(before[:101] == before[100]) and before[100] == pytest.approx(0.3), "nothing lands before it"
    assert np.all(before[round((0.25 + LIFT_TIME) * RATE) + 101 :] == 0.0)
    assert np.all(before >= 0.0)
    later = scan.at(10 * RATE, 64).samples
    assert np.all(later[LOAD:] == 0.0)


def test_time_counts_from_the_first_point_whatever_the_clock_of_the_tracker() -> None:
    late = [[t + 12345.0, *rest] for t, *rest in POINTS]
    scene = scene_of(scan={"trajectory": late}, output={"duration": 0.5})
    now, then = (ScanMotion(one).at(0, RATE // 2) for one in (trajectory(), scene))
    assert then.position == pytest.approx(now.position, abs=1e-9)
    assert then.samples[LOAD] == pytest.approx(now.samples[LOAD], abs=1e-6)


def test_nothing_after_the_output_decides_the_motion_within_it() -> None:
    ends = [[0.26, 0.03, 20.0], [5.0, 0.2, 0.0]]
    scenes = (scene_of(scan={"trajectory": POINTS + more}, output={"duration": 0.25}) for more in ([], ends))
    cut, other = (rendered_part(scene)[0] for scene in scenes)
    assert cut == other
    assert np.array_equal(ScanMotion(cut).at(-50, RATE // 2).samples, ScanMotion(other).at(-50, RATE // 2).samples)
    assert ScanMotion(cut).at(0, RATE // 2).samples[LOAD].min() > 0.0, "it does not lift: that is not rendered"
    assert ScanMotion(cut, whole=True).at(0, RATE // 2).samples[LOAD].min() == 0.0, "a voice that plays on does"


def test_two_points_are_a_motion() -> None:
    motion = ScanMotion(scene_of(scan={"trajectory": [[0, 0, 0.2], [0.5, 0.03, 0.4]]})).at(0, RATE // 2)
    assert np.max(np.abs(motion.samples[SPEED] - 0.06)) <= 1e-12
    assert motion.samples[LOAD, 0] == 0.2 and np.all(np.diff(motion.samples[LOAD]) >= 0.0)


def test_a_path_over_an_area_goes_straight_on_before_its_first_and_after_its_last_point() -> None:
    points = [[t, x, 0.4 * x + 3e-3 * t, 0.1 + t, load] for t, x, load in POINTS]
    scan = ScanMotion(scene_of(texture={"kind": "dots"}, scan={"trajectory": points}))
    for end, away in ((0.0, -1), (0.25, 1)):
        motion = scan.at(round(end * RATE) + min(0, away * 960), 961)
        for way in (motion.position, motion.path[ACROSS]):
            steps = np.diff(way)
            assert abs(steps[0]) > 1e-9 and steps == pytest.approx(np.full(960, steps[0]), rel=1e-6)
        inside = scan.at(round(end * RATE) - away * 2, 5).path[ACROSS]
        assert np.abs(np.diff(inside, 2)).max() <= 1e-3 * np.abs(np.diff(inside)).max(), "the speed has no step"
        assert np.ptp(motion.path[DIRECTION]) == 0.0


def test_loads_of_a_trajectory_are_told() -> None:
    low, high = ScanMotion(trajectory()).recorded_loads()
    assert 0.15 < low <= 0.2 and 0.4 <= high < 0.45
    assert ScanMotion(trajectory()).load_range()[0] == 0.0, "it lifts within the output"
    flat = scene_of(
        scan={"trajectory": [[0, 0, 0.3], [0.1, 1e-3, 0.3], [0.2, 2e-3, 0.3], [3, 3e-3, 0.3]]}, output={"duration": 2}
    )
    assert ScanMotion(flat).load_range() == (0.3, 0.3)
    assert ScanMotion(stroke(load=0.7)).load_range() == (0.7, 0.7)


def test_the_same_frame_is_the_same_motion_wherever_a_block_begins() -> None:
    for scene in (stroke(), trajectory(), scene_of(scan={"speed": -0.031, "load": 0.2})):
        scan = ScanMotion(scene)
        whole, part = scan.at(0, 9000), scan.at(4321, 77)
        assert np.array_equal(whole.samples[:, 4321:4398], part.samples)
        assert np.array_equal(whole.position[4321:4398], part.position)


def test_a_constant_scan_does_not_change() -> None:
    motion = ScanMotion(scene_of(scan={"speed": -0.031, "load": 0.2})).at(100, 50)
    assert np.all(motion.samples[SPEED] == -0.031) and np.all(motion.samples[LOAD] == 0.2)
    assert not motion.samples[[SPEED_RATE, LOAD_RATE, LOAD_BEND]].any()
    assert motion.position == pytest.approx(-0.031 * np.arange(100, 150) / RATE)


def test_a_motion_of_numbers_fills_every_frame() -> None:
    motion = Motion.of(5, speed=0.1, load=[0.1, 0.2, 0.3, 0.4, 0.5], speed_rate=0.0, load_rate=1.0, load_bend=0.0)
    assert motion.frames == 5 and motion.complete
    assert motion.samples[SPEED].tolist() == [0.1] * 5
    assert motion.samples[LOAD].tolist() == [0.1, 0.2, 0.3, 0.4, 0.5]
    assert not Motion.of(5, speed=0.1, load=0.3).complete


def test_a_negative_load_is_no_load() -> None:
    assert Motion.of(3, speed=0.1, load=[-1.0, 0.0, 0.1]).samples[LOAD].tolist() == [0.0, 0.0, 0.1]


def test_a_motion_without_speed_or_position_is_refused() -> None:
    with pytest.raises(ValueError, match="speed="):
        Motion.of(4, load=0.3)


@pytest.mark.parametrize(
    ("name", "given"),
    [
        ("position", np.zeros(10)),
        ("speed", math.nan),
        ("load", "0.3"),
        ("load", [0.3, 0.3]),
        ("across", math.inf),
        ("load", np.ma.array(np.full(480, 0.3), mask=np.arange(480) == 2)),
        ("speed", 0.08 + 1j),
        ("direction", 10**400),
    ],
)
def test_a_value_that_is_no_number_or_not_one_per_frame_is_named(name: str, given: Any) -> None:
    with pytest.raises(ValueError, match=f"^{name}: give a finite number in SI units, or 480, one per frame"):
        Motion.of(480, **({"position": 0.0, "load": 0.3} | {name: given}))


def test_the_number_of_frames_is_whole_and_not_negative() -> None:
    frames: Any
    for frames, error in ((4.0, TypeError), ("4", TypeError), (None, TypeError), (-1, ValueError)):
        with pytest.raises(error):
            Motion.of(frames, speed=0.08, load=0.3)
    frames = np.int64(4)
    assert Motion.of(frames, speed=0.08, load=0.3).frames == 4
