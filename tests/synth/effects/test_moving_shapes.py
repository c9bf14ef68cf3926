"""A mass under a load that varies, on contacts whose shape or footprint follows the load, against brute force."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from synth import Motion, open_voice, parse_scene
from synth.contact.geometry import Geometry
from synth.contact.growing_contact import GrowingContact
from synth.contact.stiffness import Stiffness
from synth.effects.simulation.skin_points import WHOLE, SkinPoints, Span
from synth.effects.simulation.skin_steps import SkinStepper
from synth.effects.simulation.steps import HEIGHT, REACTION, ROWS, SLOPE_FORCE, StiffnessLaw
from synth.effects.simulation.terms import ELASTIC
from synth.errors import SceneError
from synth.response.phases import turns_to_phase
from synth.scene.scene import Scene
from tests.few import few, thorough
from tests.reference.moving_points_oracle import Pulp
from tests.synth.effects.finger_points import points_of
from tests.synth.effects.whole_renders import SHORT, below
from tests.synth.engine_cases import Real, physical

RATE = 8000
POINTS = 8000  # per second of a recording: with 2000, the load at its extremes is off by 5e-4 of the displacement
REACH = 24  # frames on each side that the filter of the comparison reads
BEGUN = 0.01  # s, after which the start is forgotten
ALLOWED = 1e-2  # of the peak-to-peak of the displacement
OWN_ERROR = 1e-4  # of the oracle: more cells and loads move its displacement by 1e-5
Path = Callable[[Any], tuple[Any, Any]]
"""Position (m) and load (N) at times (s)."""

KINDS: dict[str, dict[str, Any]] = {
    "contact_growth": {"effects": {"contact_growth": {}}},
    "curvature": {"effects": {"curvature": {}}},
    "probe": {"finger": {"kind": "probe"}},
    "fingertip": {"finger": {"kind": "fingertip", "contact_length": "2 mm"}},
}


def swinging(t: Any) -> tuple[Any, Any]:
    """A scan at varying speed while the load swings about 0.3 N."""
    return 0.05 * t + 4e-4 * np.sin(40 * t), 0.3 + 0.1 * np.sin(90 * t)


def stroking(t: Any) -> tuple[Any, Any]:
    """Back and forth while the load swings from 0.1 to 0.9 N."""
    return 4e-3 * (1 - np.cos(20 * t)), 0.5 + 0.4 * np.sin(33 * t)


def pressing(t: Any) -> tuple[Any, Any]:
    """A scan that presses from 0.1 to 1.5 N in 0.15 s, and lifts in another 0.15 s."""
    turn = np.cos(2 * np.pi * np.minimum(t, 0.3) / 0.3)
    return 0.06 * t, np.where(t < 0.15, 0.8 - 0.7 * turn, 0.75 - 0.75 * turn)


def scene_of(kind: str, path: Path | None, seconds: float, tolerance: float, **sections: Any) -> Scene:
    """Return the scene of `kind` with a mass; path: its trajectory, or None for a hand; more: other effects."""
    parts = KINDS[kind]
    finger = parts.get("finger", SHORT)
    effects = {"inertia": {}, **parts.get("effects", {}), **sections.pop("more", {})}
    output = {"quantity": "displacement", "sample_rate": RATE, "bandwidth": "full", "full_scale": 1e-5}
    scan = {}
    if path is not None:
        times = np.arange(round(seconds * POINTS) + 1) / POINTS
        scan = {"trajectory": np.stack([times, *path(times)], axis=1).tolist()}
    accuracy = {"tolerance": tolerance}
    return parse_scene(
        {"finger": finger, "effects": effects, "output": output, "scan": scan, "accuracy": accuracy, **sections}
    )


def truth_of(kind: str, scene: Scene, path: Path, frames: int, loads: tuple[float, float], means: int) -> Real:
    """Return the displacement (m) of the oracle at twice the rate, for `frames` frames within the range of `loads`."""
    inertia, points = scene.effects["inertia"], points_of(kind, scene, 1.01 * loads[1])
    mean = points.means(0.9 * loads[0], 1.01 * loads[1], means)
    times = np.arange(2 * frames) / (2 * RATE)
    pulp = Pulp(inertia.mass, inertia.damping, inertia.stiffness)

    def motion(t: float) -> tuple[float, float]:
        place, load = path(t)
        return float(place), float(load)

    moved = pulp.moved(points, motion, times, mean)
    return np.asarray(moved - mean(path(times)[1]))


def error_of(found: Real, truth: Real) -> float:
    """Return the largest error after the start, relative to the peak-to-peak; found: at the rate, truth: at twice it.

    Both are about their own mean: that of the simulation has one offset, the oracle none.
    """
    ours, wanted = below(found, 1, reach=REACH), below(truth, 2, reach=REACH)[: len(found) - 2 * REACH]
    apart = (ours - wanted)[round(BEGUN * RATE) :]
    return float(np.max(np.abs(apart - np.mean(apart))) / np.ptp(wanted))


def check(kind: str, path: Path, seconds: float, loads: tuple[float, float], means: int, **sections: Any) -> None:
    """Assert that a recording is brute force within ALLOWED, and within what the plan reports; then it is silent."""
    scene = scene_of(kind, path, sections.pop("until", seconds), sections.pop("tolerance", 1e-3), **sections)
    voice, frames = open_voice(scene), round(seconds * RATE)
    error = error_of(physical(voice, frames)[:, 0], truth_of(kind, scene, path, frames, loads, means))
    told = voice.plan.estimated_error["displacement"]
    assert error <= min(ALLOWED, told + OWN_ERROR), f"{kind} errs by {error:.2e}, reported {told:.2e}"


@pytest.mark.parametrize("kind", few(KINDS, 1))
def test_a_mass_under_a_swinging_load_is_brute_force_over_the_points(kind: str) -> None:
    check(kind, swinging, 0.06, (0.2, 0.4), 25, tolerance=5e-3)


@pytest.mark.thorough
@pytest.mark.parametrize("kind", KINDS)
def test_a_stroke_of_varying_load_is_brute_force_over_the_points(kind: str) -> None:
    check(kind, stroking, 0.3, (0.1, 0.9), 193, texture={"period": "1.3 mm"})


@pytest.mark.thorough
@pytest.mark.parametrize("kind", KINDS)
def test_a_finger_that_presses_and_lifts_is_brute_force_over_the_points(kind: str) -> None:
    check(kind, pressing, 0.285, (0.02, 1.5), 385, until=0.3)


@pytest.mark.parametrize("kind", ["curvature", *map(thorough, ("contact_growth", "probe", "fingertip"))])
def test_a_hand_that_presses_is_brute_force_over_the_points(kind: str) -> None:
    """A hand is late by what the voice says, and its displacement may have another offset."""
    scene, count = scene_of(kind, None, 0.0, 5e-3), 480
    t = np.arange(count) / RATE
    place, load = swinging(t)
    hand = Motion.of(
        count,
        speed=0.05 + 1.6e-2 * np.cos(40 * t),
        speed_rate=-0.64 * np.sin(40 * t),
        load=load,
        load_rate=9.0 * np.cos(90 * t),
        load_bend=-810.0 * np.sin(90 * t),
    )
    voice = open_voice(scene)
    found = voice.render(count, hand).astype(float)[:, 0] * voice.full_scale[0]
    truth = truth_of(kind, scene, swinging, count, (0.2, 0.4), 25)
    assert place[-1] > 2e-3 and error_of(found[voice.late :], truth) <= ALLOWED


@pytest.mark.parametrize("path", [swinging, None], ids=["a recording", "a hand"])
def test_skin_that_remembers_needs_a_contact_whose_ends_stay(path: Path | None) -> None:
    scene = scene_of("contact_growth", path, 0.06, 1e-2, more={"viscous_skin": {}})
    words = "contact_growth and viscous_skin can be combined only at a constant load. .* leave one of the two out"
    with pytest.raises(SceneError, match=words):
        open_voice(scene, live=path is None)


@pytest.mark.parametrize(
    ("shape", "law"),
    [("curvature", "viscous_skin"), thorough("contact_growth", "adhesion"), thorough("curvature", "adhesion")],
)
def test_every_other_law_of_the_pressure_follows_a_load_that_swings(shape: str, law: str) -> None:
    scene = scene_of(shape, swinging, 0.04, 3e-2, more={law: {}})
    block = open_voice(scene).render(320)
    assert np.all(np.isfinite(block)) and np.ptp(block[80:]) > 0.0


@pytest.mark.parametrize("load", [0.05, 0.3])
def test_the_ends_of_a_growing_contact_cut_the_pieces_between_points(load: float) -> None:
    """Points over the length at 1 N, of which the load takes a part, give what points over that part alone give."""
    scene = scene_of("contact_growth", None, 0.0, 1e-2)
    contact = GrowingContact.of(Geometry.of_scene(scene), Stiffness.of_scene(scene))
    turns, rows = np.arange(400) / 97, []
    for heaviest, span in ((1.0, Span.of(contact, 1.0)), (load, WHOLE)):
        law = StiffnessLaw.of(contact, heaviest, 1e-3)
        points = SkinPoints.of_contact(contact, heaviest, 4097)
        stepper = SkinStepper(points, ELASTIC, law, 1e-4, 2.4, with_force=True, span=span)
        rows.append(np.empty((ROWS, len(turns))))
        stepper.run(stepper.start(0, load, 100.0, 1e-4), turns_to_phase(turns), np.full(len(turns), load), rows[-1])
    # the slopes of a texture as a profile are constant between 4096 knots of a period
    for row, allowed in ((HEIGHT, 1e-4), (REACTION, 1e-4), (SLOPE_FORCE, 2e-3)):
        part, whole = rows[0][row], rows[1][row]
        assert np.max(np.abs(part - whole)) <= allowed * np.ptp(whole) > 0.0
