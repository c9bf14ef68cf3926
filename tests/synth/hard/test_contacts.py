"""Hard contacts against the oracle: at the ends of what a scene allows, and where a patch is born or two merge.

Model   At one phase, z passes a crest of h (a patch is born), a valley (two merge), or the height at an end of the
        contact. The load at which z is exactly there follows from the oracle by Newton's method, dw = dz |C|.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import pytest

from synth.contact.exact_solver import Grid
from synth.contact.geometry import Geometry
from synth.contact.stiffness import Stiffness
from synth.scene.scene import Scene
from tests.few import few
from tests.reference.contact_oracle import solve_contact
from tests.reference.contact_oracle_mpmath import solve_exactly
from tests.reference.stiffness_oracle import contact_in_metres
from tests.reference.two_cosines import Floats, make_profiles, monotone_pieces
from tests.synth.engine_cases import Real, scene_of, touch_of

PROMISED = 2e-12  # of a1 + a2: the error of z


@dataclass(frozen=True)
class Touching:
    """A contact: sections of its scene, loads (N), and by how much its z may miss the oracle, in parts of a1 + a2 (and
    1e-14 of z itself, which lies w / k deep: the rounding of the powers of eqs 4-5).
    """

    finger: dict[str, float] = field(default_factory=dict)
    texture: dict[str, float] = field(default_factory=dict)
    loads: tuple[float, ...] = (0.0, 1e-9, 1e-3, 0.3, 10.0, 1e3)
    allowed: float = PROMISED


CONTACTS: dict[str, Touching] = {
    "the default": Touching(),
    "a smooth finger": Touching(finger={"ridge_amplitude": 0.0}),
    "a smooth texture": Touching(texture={"amplitude": 0.0}),
    "a texture of a millionth of the ridges": Touching({"ridge_amplitude": 1e-3}, {"amplitude": 1e-9}),
    "a texture of a million times the ridges": Touching({"ridge_amplitude": 1e-9}, {"amplitude": 1e-3}),
    "locked: one period for both": Touching(texture={"period": 0.5e-3}),
    "a millionth off locked": Touching(texture={"period": 0.5e-3 * (1 + 1e-6)}),
    "locked and as high": Touching(texture={"period": 0.5e-3, "amplitude": 40e-6}),
    "locked, opposite and as high": Touching(texture={"period": 0.5e-3, "amplitude": 40e-6, "phase": math.pi}),
    "opposite, as high, a millionth off locked": Touching(
        texture={"period": 0.5e-3 * (1 + 1e-6), "amplitude": 40e-6, "phase": math.pi}
    ),
    "opposite and a billionth off as high": Touching(
        texture={"period": 0.5e-3, "amplitude": 40e-6 * (1 + 1e-9), "phase": math.pi}
    ),
    "10,000 texture periods": Touching(texture={"period": 1e-6, "amplitude": 1e-7}, loads=(0.3,), allowed=2e-11),
    "a texture of a metre": Touching(texture={"period": 1.0, "amplitude": 1e-3}),
    "shorter than a ridge": Touching(finger={"contact_length": 1e-4}),
    "the shortest": Touching(finger={"contact_length": 1e-5, "ridge_period": 1e-2}, texture={"period": 1.0}),
    "1000 ridges": Touching(finger={"ridge_period": 1e-5}, loads=(0.3,)),
    "whole numbers of both periods": Touching(texture={"period": 1e-3}, loads=(0.3, 1.5, 3.0, 30.0)),
    "a ridge that just touches": Touching(texture={"period": 0.25e-3}, loads=(1e-12, 1e-10, 1e-8, 1e-6)),
    "the softest skin": Touching(finger={"youngs_modulus": 1e3}),
    "the highest of both": Touching({"ridge_amplitude": 1e-3}, {"amplitude": 1e-3}),
    "the lowest of both": Touching({"ridge_amplitude": 1e-9}, {"amplitude": 1e-9}),
}


def solved(scene: Scene, theta: Real, load: float) -> Real:
    """Return z (m) at each phase."""
    return Grid.of_geometry(Geometry.of_scene(scene)).solve(theta, Stiffness.of_scene(scene).indentation(load)).height


@pytest.mark.timeout(120)
@pytest.mark.parametrize("name", CONTACTS)
def test_a_hard_contact_is_that_of_the_oracle(name: str) -> None:
    case = CONTACTS[name]
    scene = scene_of(finger=case.finger, texture=case.texture)
    theta = (0.0, 0.25, 0.1234567)
    tall = scene.finger.ridge_amplitude + scene.texture.amplitude
    for load in case.loads:
        found = solved(scene, np.array(theta), load)
        wanted = contact_in_metres(touch_of(scene), np.array(theta), load).approach
        deep = float(np.max(np.abs(wanted)))
        assert np.max(np.abs(found - wanted)) <= case.allowed * tall + 1e-14 * deep, f"{load} N"


ROUND_OFF = 2e-13  # of a1 + a2: what the solver states
ASIDE = (1e-3, 1e-6, 1e-9, 1e-12, 1e-15)


@dataclass(frozen=True)
class Event:
    """A contact in units of its ridges, and where on it something happens.

    kind: "crest", "valley" or "end". number: which one, from the highest. patches: how many there are more, once z has
    passed it on its way down.
    """

    kind: str
    number: int
    patches: int
    tau: float
    period: float
    amplitude: float
    theta: float = 0.2
    phi: float = 1.4


EVENTS: dict[str, Event] = {
    "a patch is born": Event("crest", 1, 1, 6.0, 1.37, 0.5, theta=0.3),
    "the last patch is born": Event("crest", -1, 1, 6.0, 1.37, 0.5),
    "a patch is born on a fine texture": Event("crest", 3, 1, 5.3, 0.21, 0.4),
    "a ridge touches beside the only one that does": Event("crest", 1, 1, 2.2, 7.9, 0.8),
    "two patches merge": Event("valley", 0, -1, 6.0, 1.37, 0.5),
    "the last two merge": Event("valley", -1, -1, 6.0, 1.37, 0.5),
    "two merge on a fine texture": Event("valley", 4, -1, 5.3, 0.21, 0.4),
    "a patch is born at an end": Event("end", 0, 1, 6.4, 1.37, 0.5, theta=0.9),
    "a patch is born at an end of a short contact": Event("end", 0, 1, 1.3, 0.9, 0.7, theta=0.9),
    "a patch comes to an end": Event("end", -1, 0, 6.4, 1.37, 0.5, theta=0.4),
}


def turning(event: Event) -> tuple[Floats, Floats]:
    """Return positions and heights where h turns, the two ends of the contact included, in long double."""
    profiles = make_profiles(event.tau, event.period, 1.0, event.amplitude, event.theta, event.phi, np.longdouble)
    pieces = monotone_pieces(profiles)
    return np.append(pieces.left, pieces.right[-1]), np.append(pieces.height_left, pieces.height_right[-1])


def place_and_height(event: Event) -> tuple[float, np.longdouble]:
    """Return the position (ridges) and the height at which the event happens."""
    places, heights = turning(event)
    inner = heights[1:-1]
    crests = np.flatnonzero((inner > heights[:-2]) & (inner > heights[2:])) + 1
    valleys = np.flatnonzero((inner < heights[:-2]) & (inner < heights[2:])) + 1
    found = {"crest": crests, "valley": valleys, "end": np.array([0, len(heights) - 1])}[event.kind]
    chosen = found[np.argsort(-heights[found])][event.number]
    return float(places[chosen]), heights[chosen]


def load_of(event: Event, height: np.longdouble) -> float:
    """Return the load at which z is `height`, to round-off."""
    load = np.longdouble(1e-2)
    for _ in range(60):
        contact = solve_contact(event.tau, event.period, event.amplitude, load, event.theta, event.phi)
        if abs(contact.approach[()] - height) < 2e-18 * (1.0 + event.amplitude):
            break
        load = np.maximum(load + (contact.approach[()] - height) * contact.contact_length[()], load / 16)
    assert abs(contact.approach[()] - height) < 1e-17 * (1.0 + event.amplitude)
    return float(load)


def errors(event: Event, loads: Real, thetas: Real) -> Real:
    """Return the error of z at each load and phase, over a1 + a2."""
    geometry = Geometry(1.0, 1.0, event.amplitude, event.period, event.phi, event.tau)
    grid = Grid.of_geometry(geometry)
    pairs = zip(loads, thetas, strict=True)
    found = [grid.solve(np.array([theta]), float(load) / event.tau).height[0] for load, theta in pairs]
    wanted = solve_contact(event.tau, event.period, event.amplitude, loads, thetas, event.phi)
    return np.asarray(np.abs(found - wanted.approach) / (1.0 + event.amplitude), dtype=float)


@pytest.mark.parametrize("name", few(EVENTS, 4))
def test_at_an_event_and_on_both_sides_of_it_z_is_that_of_the_oracle(name: str) -> None:
    event = EVENTS[name]
    place, height = place_and_height(event)
    load = load_of(event, height)
    sides = np.array([0.0, *ASIDE, *(-aside for aside in ASIDE)])
    assert np.max(errors(event, load * (1.0 + sides), np.full(sides.shape, event.theta))) <= ROUND_OFF
    assert np.max(errors(event, np.full(sides.shape, load), event.theta + sides)) <= ROUND_OFF
    above, below = (
        solve_exactly(event.tau, event.period, event.amplitude, load * part, event.theta, event.phi)
        for part in (1.0 - 1e-6, 1.0 + 1e-6)
    )
    assert below.patches - above.patches == event.patches
    if event.kind == "end":
        assert place in (0.0, event.tau)
    else:
        geometry = Geometry(1.0, 1.0, event.amplitude, event.period, event.phi, event.tau)
        cells = Grid.of_geometry(geometry).tables.shape[1]
        beside = 2.0 * place / event.tau * cells % 1.0  # in halves of a cell: away from its ends and its centre
        assert 0.05 < beside < 0.95


@pytest.mark.parametrize("load", [1e-12, 1e-9, 1e-6, 1e-2])
@pytest.mark.parametrize("aside", [0.0, *ASIDE])
def test_ridges_that_touch_together_are_as_one(load: float, aside: float) -> None:
    """Half the period of the ridges: every ridge meets the same height, so all touch at once; a little aside, in order
    of height: z there is compared with the oracle on both sides.
    """
    event = Event("crest", 0, 7, 7.0, 0.5 * (1.0 + aside), 0.6, theta=0.3)
    sides = np.array([0.3, 0.3 + 1e-9, 0.3 - 1e-9, 0.3 + 1e-4])
    assert np.max(errors(event, np.full(sides.shape, load), sides)) <= ROUND_OFF


def test_a_patch_that_is_born_or_merges_makes_no_jump() -> None:
    """Where patches are born and merge z is still smooth in the load: close loads give close heights, in order."""
    scene = scene_of(texture={"period": 0.37e-3})
    loads = 0.3 * (1.0 + 1e-7 * np.arange(400))
    theta = np.arange(64) / 64
    heights = np.array([solved(scene, theta, float(load)) for load in loads])
    steps = np.diff(heights, axis=0)
    assert np.all(steps < 0.0)
    assert np.max(np.abs(np.diff(steps, axis=0))) <= 1e-3 * np.max(np.abs(steps)) + 1e-12 * 60e-6
