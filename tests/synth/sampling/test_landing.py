"""Where a recording lifts and lands within itself, z is solved as often as the landing requires."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from synth.plan.frame_plan import FramePlan
from synth.plan.preparation import Preparation
from synth.plan.prepare import prepare
from synth.response.table_error import QUANTITIES
from synth.response_cache import ResponseCache
from synth.sampling.frame_solver import FrameSolver, Heights
from synth.sampling.landing import low_pass
from synth.scene.scene import parse_scene
from tests.few import thorough

GRATING = {"kind": "grating", "period": "1 mm", "height": "50 um", "ramp": "0.2 mm"}
FINGERTIP = {"kind": "fingertip", "contact_length": "5 mm"}
OFTEN = 24  # times the usual solutions, for the whole recording
NARROW = {"sample_rate": 4000, "bandwidth": 500}


def taps(step: float, count: int = 24) -> list[list[float]]:
    """Return points `step` (s) apart: on the surface for three of six, at 80 mm/s."""
    return [[step * n, 0.08 * step * n, 0.5 if 0 < n % 6 < 4 else 0.0] for n in range(count)]


def planned(finger: dict[str, Any], texture: dict[str, Any], step: float, output: dict[str, Any], tol: float) -> Any:
    output = {"channels": list(QUANTITIES), "sample_rate": 16_000, **output}
    scene = {"finger": finger, "texture": texture, "scan": {"trajectory": taps(step)}, "output": output}
    return prepare(parse_scene({**scene, "accuracy": {"tolerance": tol}}), ResponseCache())


def frames_of(solved: Preparation, finer: int | None = None) -> Any:
    """Return all frames of the file, SI [quantities, frames]; finer: with so many times its solutions, everywhere."""
    plan = solved.frames
    assert plan is not None and solved.mean is not None
    rate, heights = solved.scene.output.sample_rate, solved.whole.heights
    count, landings, most = plan.count, plan.landings(solved.orders), plan.finer
    if finer is not None:
        count, landings, most = finer * count, {}, 1
    solver = FrameSolver(
        heights, solved.scene, solved.mean, rate, count=count, scale=plan.scale, stride=plan.stride, longest=0,
        landings=landings, finer=most,
    )  # fmt: skip
    length = round((solved.scene.scan.trajectory[-1][0] + 0.02) * rate)  # type: ignore[index]
    chunks = range(-(-length // solver.chunk))
    return np.concatenate([solver.solved(number, (0, 1, 2)) for number in chunks], axis=1)


@pytest.mark.parametrize(
    ("finger", "texture", "step", "output", "tolerance"),
    [
        thorough(FINGERTIP, {}, 8e-3, {}, 1e-2),
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
    errors = np.max(np.abs(frames_of(solved) - frames_of(solved, OFTEN)), axis=1)
    for channel, error, told in zip(solved.channels, errors, solved.frames.errors, strict=True):
        assert error / channel.extent <= told <= 1.1 * tolerance


def test_a_press_whose_frequency_divides_the_steps_keeps_the_told_error() -> None:
    """At 1000 and at 2000 steps a second lines of 40 Hz fold onto each other, so twice the steps change little."""
    times = np.linspace(0.0, 0.1, 81)
    loads = 0.1 + 0.2 * (1.0 - np.cos(80.0 * np.pi * times))
    points = np.stack([times, np.full(81, 1e-3), loads], axis=1).tolist()
    output = {"channels": list(QUANTITIES), "sample_rate": 8000, "bandwidth": 100}
    scene = {"finger": {"contact_length": "3 mm"}, "scan": {"trajectory": points}, "output": output}
    solved = prepare(parse_scene({**scene, "accuracy": {"tolerance": 1e-2}}), ResponseCache())
    errors = np.max(np.abs(frames_of(solved) - frames_of(solved, OFTEN)), axis=1)
    for channel, error in zip(solved.channels, errors, strict=True):
        assert error <= channel.error * channel.extent


def test_the_end_of_a_landing_after_a_heavier_lift_is_judged() -> None:
    """The lift changes the load most, also where it counts as slow; the light load erred three times what was told."""
    points = [[0, 0, 0.5], [0.03, 0.001, 0], [0.1, 0.002, 0], [0.15, 0.004, 0.3], [0.25, 0.009, 0.3]]
    output = {"channels": list(QUANTITIES), "sample_rate": 8000, "duration": 0.25}
    texture = {"period": "90 um", "amplitude": "4 um"}
    scene = {"finger": {"contact_length": "4 mm"}, "texture": texture, "scan": {"trajectory": points}, "output": output}
    solved = prepare(parse_scene(scene), ResponseCache())
    errors = np.max(np.abs(frames_of(solved) - frames_of(solved, OFTEN)), axis=1)
    for channel, error in zip(solved.channels, errors, strict=True):
        assert error <= channel.error * channel.extent


def test_a_landing_that_would_take_too_many_solutions_tells_its_error() -> None:
    """With twice the usual solutions only, what is left is found, and is more than is allowed."""
    solved = planned(FINGERTIP, {}, 8e-3, {}, 1e-2)
    plan, contact, orders = solved.frames, solved.whole, (0, 1, 2)
    assert plan is not None and solved.mean is not None
    allowed = {order: 1e-4 * channel.extent for order, channel in zip(orders, solved.channels, strict=True)}
    found = []
    for finer in (2, 64):
        solver = FrameSolver(
            contact.heights, solved.scene, solved.mean, 16_000, count=4, scale=plan.scale, stride=plan.stride,
            landings=allowed, finer=finer,
        )  # fmt: skip
        found.append(solver.solved_with_error(0, orders))
    (few, left), (many, rest) = found
    change = np.max(np.abs(few - many), axis=1)
    assert np.all(rest <= list(allowed.values()))
    assert np.all(change <= left + rest) and left[2] > allowed[2]


def counted() -> tuple[Preparation, FramePlan, Heights, list[int]]:
    """Return a recording of a fingertip, its plan, its z, and a list that gets the number of solutions of each call."""
    solved, solutions = planned(FINGERTIP, {}, 0.1, NARROW, 1e-2), list[int]()
    plan, contact = solved.frames, solved.whole
    assert plan is not None

    def heights(phases: Any, loads: Any) -> Any:
        solutions.append(len(phases))
        return contact.heights(phases, loads)

    return solved, plan, heights, solutions


def test_frames_away_from_landings_do_not_pay_for_them() -> None:
    """Only a few milliseconds about each landing are solved again."""
    solved, plan, heights, solutions = counted()
    assert solved.mean is not None

    solver = FrameSolver(
        heights, solved.scene, solved.mean, 4000, count=plan.count, scale=plan.scale, stride=plan.stride,
        landings=plan.landings(solved.orders), finer=plan.finer,
    )  # fmt: skip
    chunks = range(-(-int(2.3 * 4000) // solver.chunk))
    for number in chunks:
        solver.solved(number, (0, 1, 2))
    assert sum(solutions) < 4.0 * solver.solutions * len(chunks)


def test_neighbouring_chunks_solve_their_margins_once_and_render_the_same_in_any_order() -> None:
    solved, plan, heights, solutions = counted()
    mean = solved.mean
    assert mean is not None

    def solver() -> FrameSolver:
        return FrameSolver(
            heights, solved.scene, mean, 4000, count=plan.count, scale=plan.scale, stride=plan.stride, longest=0
        )

    one, other = solver(), solver()
    forwards = [one.solved(number, (0, 1, 2)) for number in range(6)]
    touching = sum(solutions)
    assert touching <= (6 + 1) * one.solutions  # a chunk is twice as long as a margin: both outer margins are another
    backwards = [other.solved(number, (0, 1, 2)) for number in reversed(range(6))]
    assert all(np.array_equal(a, b) for a, b in zip(forwards, reversed(backwards), strict=True))


@pytest.mark.parametrize("top", [0.03, 0.1225, 0.25])
@pytest.mark.parametrize("finer", [2, 8, 64])
def test_the_low_pass_keeps_the_band_and_removes_what_would_fold_into_it(finer: int, top: float) -> None:
    weights = low_pass(finer, top)
    places = (np.arange(len(weights)) - len(weights) // 2) / finer

    def gains(cycles: Any) -> Any:
        return np.abs(np.exp(-2j * np.pi * np.outer(cycles, places)) @ weights)

    assert np.max(np.abs(gains(np.linspace(0.0, top, 50)) - 1.0)) <= 1e-5
    assert np.max(gains(np.linspace(1.0 - top, min(0.5 * finer, 8.0), 400))) <= 1e-5
