"""The mean of z that displacement leaves out, against a mean that is solved at every load of the motion."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from synth.arrays import Array
from synth.contact.scene_contact import contact_of
from synth.plan.mean_choice import MeanChoice
from synth.plan.prepare import prepare
from synth.response.mean_approach import Mean
from synth.response.table_error import QUANTITIES
from synth.response_cache import ResponseCache
from synth.sampling.frame_solver import FrameSolver
from synth.scene.scene import parse_scene
from tests.few import thorough

RATE, SECONDS, PLACES = 2000, 0.1, 375  # places: no power of two
SHORT = {"contact_length": "3 mm"}
GRATING = {"kind": "grating", "period": "1 mm"}


def pressing(speed: float, lightest: float) -> list[list[float]]:
    """Return a finger that presses and relaxes ten times a second while it moves at `speed`."""
    times = np.linspace(0.0, SECONDS, 21)
    loads = lightest + 0.2 * (1.0 - np.cos(20.0 * math.pi * times))
    found: list[list[float]] = np.stack([times, 1e-3 + speed * times, loads], axis=1).tolist()
    return found


def solved_mean(contact: Any) -> Mean:
    """Return the mean over PLACES, solved at every load."""
    places = np.arange(PLACES) / PLACES
    known: dict[float, float] = {}

    def mean(roots: Array) -> Array:
        for root in set(roots.tolist()) - set(known):
            known[root] = float(np.mean(contact.heights(places, np.full(PLACES, root**3))))
        return np.array([known[root] for root in roots.tolist()])

    return mean


@pytest.mark.parametrize(
    ("texture", "speed", "lightest"), [({}, 0.0, 0.1), thorough(GRATING, 0.0, 0.1), (GRATING, 0.04, 0.0)]
)
def test_the_error_of_the_mean_is_told(texture: dict[str, Any], speed: float, lightest: float) -> None:
    """A finger that presses without moving has little motion of its own, so the mean decides its acceleration."""
    output = {"sample_rate": RATE, "bandwidth": 500, "channels": list(QUANTITIES)}
    scan = {"trajectory": pressing(speed, lightest)}
    scene = parse_scene({"finger": SHORT, "texture": texture, "scan": scan, "output": output})
    solved = prepare(scene, ResponseCache())
    plan = solved.frames
    assert plan is not None and solved.mean is not None and solved.contact is not None

    def frames(mean: Mean) -> Array:
        assert solved.contact is not None
        solver = FrameSolver(
            solved.contact.heights, scene, mean, RATE, count=plan.count, stride=plan.stride, scale=plan.scale
        )
        return solver.solved(0, solved.orders)[:, : round(RATE * SECONDS)]

    found, exact = frames(solved.mean), frames(solved_mean(solved.contact))
    told = np.array([channel.error * channel.extent for channel in solved.channels])
    extents = np.array([channel.extent for channel in solved.channels])
    missed = np.max(np.abs(found - exact), axis=1)
    assert np.all(missed <= told), f"{missed / extents} of the peak-to-peak, told {told / extents}"


def test_a_tighter_tolerance_has_a_nearer_mean() -> None:
    times = np.linspace(0.0, 1.0, 51)
    places = 0.02 * np.sin(1.2 * math.pi * times) + 0.03 * times
    loads = np.maximum(0.0, 0.6 + 0.8 * np.sin(2.2 * math.pi * times))
    scan = {"trajectory": np.stack([times, places, loads], axis=1).tolist()}
    output = {"sample_rate": RATE, "bandwidth": 500, "channels": ["displacement"]}
    document = {"finger": SHORT, "texture": {"kind": "grating-800um-40um"}, "scan": scan, "output": output}
    scene = parse_scene(document | {"accuracy": {"tolerance": 1e-5}})
    assert prepare(scene, ResponseCache()).channels[0].error < 5e-5


def test_the_mean_in_smaller_cells_is_that_which_is_solved_in_them() -> None:
    """What the cells change is solved at fewer places; it is larger than what is left of it."""
    texture = {"kind": "dots", "period": "1.1 mm", "row_distance": "1.3 mm", "dot_height": "40 um"}
    contact: Any = contact_of(parse_scene({"finger": {"contact_length": "1.5 mm"}, "texture": texture}))
    choice = MeanChoice(contact, True, (0.02, 0.6), 0.3, 1e-3, 0.1, 17, 512)
    mean, finer = choice.solved(), contact.halved().halved()
    exact, moved = replace(choice, contact=finer).solved(), choice.in_cells(mean, finer)
    roots, extent = np.cbrt(np.linspace(0.02, 0.6, 100)), np.ptp(contact.heights(np.arange(64) / 64, np.full(64, 0.3)))
    left, change = (np.max(np.abs(one(roots) - exact(roots))) / extent for one in (moved, mean))
    told = sum(np.max(np.abs(one(roots) - moved(roots))) for one in moved.coarser()) / extent
    assert left < 0.1 * change and left < told
