"""`contact_growth` and `curvature` of a comb over an area: against sums over points, and the same effects on a line."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from synth import open_voice, parse_scene
from synth.contact.scene_contact import contact_of
from synth.plan.preparation import Preparation
from synth.plan.prepare import prepare
from synth.response.table_error import QUANTITIES
from synth.sampling.frame_solver import FrameSolver
from synth.scene.effects_section import declaration
from synth.scene.scene import Scene
from synth.surfaces import profile_of
from synth.surfaces.grooves import Grooves
from tests.few import thorough
from tests.reference.area_stepping_oracle import KNOTS, AreaPoints
from tests.synth.effects import test_points_over_area as over_area
from tests.synth.effects.whole_renders import below
from tests.synth.engine_cases import physical

RATE, FINER, REACH = over_area.RATE, 2, 40
SECONDS, BELOW = 0.025, 0.12  # s; part of the rate below which z is compared: well within the band
COLUMNS = 160  # points of the oracle along and across
OWN_ERROR = 4e-3  # of the oracle, as in `test_points_over_area`
LENGTH, REFERENCE = 1.6e-3, 0.4  # m, N
SHAPES: dict[str, dict[str, Any]] = {
    "contact_growth": {"contact_growth": {"reference_load": REFERENCE}},
    "curvature": {"curvature": {"reference_load": REFERENCE}},
}


def load_at(t: Any) -> Any:
    """A load that swings (N)."""
    return 0.3 + 0.12 * np.sin(60.0 * t)


def steady_at(t: Any) -> Any:
    """A constant load (N)."""
    return 0.3 + 0.0 * t


def scene_of(shape: str, load: Any, effects: dict[str, Any] | None = None, **sections: Any) -> Scene:
    """Return a scene over dots, on a path that turns."""
    t = np.arange(round(SECONDS * 2000) + 1) / 2000
    points = np.stack([t, *over_area.turning(t), load(t)], axis=1).tolist()
    document = {
        "finger": {"contact_length": LENGTH, "ridge_amplitude": "60 um"},
        "texture": over_area.DOTS,
        "scan": {"trajectory": points},
        "effects": {**SHAPES[shape], **(effects or {})},
        "output": {"quantity": "approach", "sample_rate": RATE, "bandwidth": 1500.0, "full_scale": 1e-5},
        "accuracy": {"tolerance": 3e-2},
    }
    return parse_scene({**document, **sections})


def foundation(contact: Any, half: float, load: float) -> float:
    """Return kappa = k / L (Pa/m) of eqs 4-5 at the length 2 `half` (m) and `load` (N)."""
    return float(contact.stiffness.over(2.0 * half).stiffness(load) / (2.0 * half))


def round_half(contact: Any, radius: float, load: float) -> float:
    """Return half the length (m) that a smooth round finger touches at `load` (N): w = (2/3) kappa b^3 / R."""

    def excess(b: float) -> float:
        return 2.0 / 3.0 * foundation(contact, b, load) * b**3 / radius - load

    return float(brentq(excess, 1e-6, 1.0, xtol=1e-15))


def points_of(shape: str, scene: Scene, load: float) -> AreaPoints:
    """Return the points of the finger at `load` (N), of the definition of the effect."""
    contact: Any = contact_of(scene)
    along = across = LENGTH * (load / REFERENCE) ** (1.0 / 3.0)
    bend, modulus = 0.0, foundation(contact, 0.5 * along, load) / along  # Pa/m
    if shape == "curvature":
        radius = 2.0 / 3.0 * foundation(contact, 0.5 * LENGTH, REFERENCE) * (0.5 * LENGTH) ** 3 / REFERENCE
        half = round_half(contact, radius, load)
        modulus, bend = foundation(contact, half, load) / LENGTH, 1.0 / radius
        along, across = 6.0 * half, LENGTH
    rows = [(np.arange(COLUMNS) + 0.5) / COLUMNS * size - 0.5 * size for size in (along, across)]
    x, y = (one.ravel() for one in np.meshgrid(*rows, indexing="ij"))
    heights = -60e-6 * np.cos(2.0 * np.pi * (x + 0.5 * LENGTH) / scene.finger.ridge_period) - 0.5 * bend * x**2
    return AreaPoints(x, y, heights, modulus * along * across / COLUMNS**2, *field(), 0.5 * LENGTH)


@cache
def field() -> tuple[Any, tuple[float, float]]:
    """Return the heights of one period of the dots, and its periods (m)."""
    texture: Any = contact_of(parse_scene({"texture": over_area.DOTS})).geometry.profile
    places = np.arange(KNOTS) / KNOTS
    return texture.area(places * texture.period, places * texture.across), (texture.period, texture.across)


@pytest.mark.parametrize(
    ("shape", "load"),
    [
        ("curvature", load_at),
        thorough("contact_growth", load_at),
        thorough("contact_growth", steady_at),
        thorough("curvature", steady_at),
    ],
)
def test_a_file_on_a_path_is_brute_force_over_the_points(shape: str, load: Any) -> None:
    scene = scene_of(shape, load)
    times, truth = np.arange(round(SECONDS * RATE) * FINER) / (RATE * FINER), []
    for t in times.tolist():
        points = points_of(shape, scene, float(load(t)))
        truth.append(points.resting(points.heights(*over_area.turning(t)), float(load(t))))
    voice = open_voice(scene)
    found = physical(voice, round(SECONDS * RATE))[:, 0]
    ours, wanted = below(found, 1, BELOW, REACH), below(np.array(truth), FINER, BELOW, REACH)
    apart = ours - wanted[: len(ours)]
    apart -= 0.5 * (np.max(apart) + np.min(apart))
    error, told = float(np.max(np.abs(apart)) / np.ptp(wanted)), voice.plan.estimated_error["approach"]
    assert error <= told + OWN_ERROR, f"errs by {error:.2e}, told {told:.2e}"


@pytest.mark.thorough
def test_the_told_error_allows_for_cells_that_the_ends_of_the_contact_pass() -> None:
    t = np.arange(81) / 800
    document = {
        "finger": {"contact_length": "3 mm"},
        "texture": {"kind": "braille-2340um"},
        "scan": {"trajectory": np.stack([t, 0.06 * t, 0.6 + 0.3 * np.sin(8.0 * np.pi * t)], axis=1).tolist()},
        "effects": {"contact_growth": {}},
        "output": {"channels": [{"quantity": one} for one in QUANTITIES], "sample_rate": RATE, "duration": 0.1},
        "accuracy": {"tolerance": 3e-2},
    }
    solved = prepare(parse_scene(document))
    contact: Any = solved.contact
    chunks = [solved_again(solved, one.heights) for one in (contact, contact.halved())]
    changed = np.max(np.abs(chunks[1] - chunks[0]), axis=1) / [one.extent for one in solved.channels]
    told = np.array([one.error for one in solved.channels])
    assert np.all(changed <= told), f"changed {changed}, told {told}"
    assert np.max(changed / told) > 0.1, "what is told is a bound, not a guess"


def solved_again(solved: Preparation, heights: Any) -> Any:
    """Return the frames of a file from another source of z."""
    plan, mean = solved.frames, solved.mean
    assert plan is not None and mean is not None
    solver = FrameSolver(
        heights, solved.scene, mean, RATE, count=plan.count, stride=plan.stride, scale=plan.scale,
        landings=plan.landings(solved.orders), finer=plan.finer,
    )  # fmt: skip
    numbers = range(math.ceil(solved.scene.output.duration * RATE / solver.chunk))
    return np.concatenate([solver.solved(one, solved.orders) for one in numbers], axis=1)


@pytest.mark.parametrize("shape", SHAPES)
def test_on_grooves_the_area_has_the_z_of_the_line(shape: str) -> None:
    scene = parse_scene({"finger": {"contact_length": "2.2 mm"}, "effects": SHAPES[shape]})
    effect: Any = declaration(shape)
    loads, phases = np.tile([0.05, 0.3, 1.1], 32), np.repeat(np.arange(32) / 32, 3)
    grooves = contact_of(scene, Grooves(profile_of(scene)))
    on_line, over = (effect.shaped(one, scene.effects[shape]) for one in (contact_of(scene), grooves))
    over = over.covering(1.1).halved().halved()
    wanted, found = on_line.heights(phases, loads), over.heights(phases, loads)
    for load in (0.05, 0.3, 1.1):
        some = loads == load
        apart, extent = (found - wanted)[some], np.ptp(wanted[some])
        assert np.max(np.abs(apart - np.mean(apart))) < 1e-3 * extent
        assert abs(np.mean(apart)) < 2e-3 * extent, "its edges are those of the square"
