"""Effects of a fingertip and of a probe in whole renders, against sums over the points of the finger."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from synth import open_voice, parse_scene
from synth.contact.scene_contact import contact_of
from synth.errors import SceneError
from synth.scene.scene import Scene
from tests.few import thorough
from tests.reference.moving_oracle import Harmonics
from tests.reference.moving_points_oracle import Points
from tests.reference.shaped_contact_oracle import smooth_half_length
from tests.reference.stiffness_oracle import stiffness
from tests.synth.effects.finger_points import points_of, tip_points
from tests.synth.effects.whole_renders import check_quantities, errors_of, scene_of
from tests.synth.engine_cases import Real, physical, touch_of

FORCE = "tangential_force"
COUNT = 512  # places of the texture: the error of the oracle's derivatives is that of its 255 harmonics
LOAD, HEAVIEST = 0.3, 1.0  # N
FINGERS: dict[str, dict[str, Any]] = {
    "fingertip": {"kind": "fingertip", "contact_length": "2 mm"},
    "probe": {"kind": "probe"},
}
OWN_ERROR = 1e-4
STRESS, REACH, MOVE = 5e3, 5e-6, 2e-8  # Pa, m; m: step in which the finger of the oracle is followed


def heights_at(points: Points, place: float) -> tuple[Real, Real]:
    """Return the height of every point (m) and the slope of the texture there, which has moved by `place` (m)."""
    k = 2.0 * math.pi / points.period
    angle = k * (points.places - place) + points.phase
    return points.finger + points.amplitude * np.cos(angle), -points.amplitude * k * np.sin(angle)


def places_of(points: Points) -> Real:
    """Return COUNT places of one period (m)."""
    return np.arange(COUNT) / COUNT * points.period


def slope_force(points: Points) -> Real:
    """Return minus the sum of the force of every point times the slope of the texture (N) at every place."""
    forces = []
    places = places_of(points)
    for place, z in zip(places.tolist(), points.resting(LOAD, places).tolist(), strict=True):
        heights, slopes = heights_at(points, place)
        forces.append(-points.share(LOAD) * float(np.sum(np.maximum(heights - z, 0.0) * slopes)))
    return np.array(forces)


@pytest.mark.parametrize("kind", FINGERS)
def test_the_force_on_the_slopes_errs_by_no_more_than_the_plan_says(kind: str) -> None:
    scene = scene_of("default", {"tangential": {"friction_coefficient": 0}}, finger=FINGERS[kind])
    points = points_of(kind, scene, HEAVIEST)
    force = slope_force(points)
    wanted = Harmonics(np.fft.rfft(force) / COUNT, scene.scan.speed / points.period)
    voice = open_voice(scene)
    error = errors_of(scene, voice, {FORCE: (wanted, 0)})[FORCE]
    assert np.ptp(force) > 1e-3
    assert error <= voice.plan.estimated_error[FORCE] + OWN_ERROR


@pytest.mark.parametrize("kind", FINGERS)
def test_friction_has_the_mean_mu_w_against_a_stroke_and_a_hand_hears_the_same(kind: str) -> None:
    stroke = {"speed": "80 mm/s", "length": "40 mm", "turn_time": "60 ms"}
    quick: dict[str, Any] = {"finger": FINGERS[kind], "output": {"channels": ["displacement"], "bandwidth": 1000}}
    scene = scene_of("default", {"tangential": {}}, scan={"stroke": stroke}, **quick)
    found = physical(open_voice(scene), 8000)[:, -1]
    assert np.max(found) > 0.14 and np.min(found) < -0.14
    assert np.mean(found[800:2400]) == pytest.approx(0.5 * LOAD, rel=2e-3), "it strokes to the right"
    live = physical(open_voice(scene_of("default", {"tangential": {}}, **quick), live=True), 4000)[:, -1]
    assert np.mean(live[-1600:]) == pytest.approx(0.5 * LOAD, rel=2e-3)


def area_of(kind: str, scene: Scene, points: Points) -> float:
    """Return the area of a point (m^2): the nominal footprint has the stiffness k; a probe is as wide as it is long."""
    touch = touch_of(scene)
    if kind == "fingertip":
        return points.share(LOAD) / stiffness(touch).k * scene.finger.contact_length * scene.finger.width
    length = 2.0 * smooth_half_length(touch, LOAD, 1e-3)
    return float(points.places[1] - points.places[0]) * length


def rooted(excess: Callable[[float, Any], float], z: float, there: Any) -> float:
    """Return the root of `excess` (N) `there` that a finger at `z` (m) moves to: upwards where it is above 0."""
    step = MOVE if excess(z, there) > 0.0 else -MOVE
    other = z + step
    while excess(other, there) * step > 0.0:
        z, other = other, other + step
    return float(brentq(excess, *sorted((z, other)), args=(there,), xtol=1e-16))


def attracted(points: Points, area: float, stress: float = STRESS, reach: float = REACH) -> Real:
    """Return z (m) of a finger that is attracted, at every place, followed from one to the next.

    area: of a point, m^2.
    """
    share = points.share(LOAD)

    def excess(z: float, heights: Real) -> float:
        depth = heights - z
        pull = stress * area * float(np.sum(np.clip(1.0 + depth / reach, 0.0, 1.0)))
        return share * float(np.sum(np.maximum(depth, 0.0))) - pull - LOAD

    found = []
    z = float(points.resting(LOAD, np.zeros(1))[0])
    for place in (*places_of(points)[-32:].tolist(), *places_of(points).tolist()):
        heights, _slopes = heights_at(points, place)
        z = rooted(excess, z, heights)
        found.append(z)
    return np.array(found[32:])


@pytest.mark.parametrize("kind", [thorough("fingertip"), "probe"])
def test_an_attraction_pulls_as_brute_force_does(kind: str) -> None:
    scene = scene_of("default", {"adhesion": {}}, finger=FINGERS[kind])
    points = tip_points(scene, 1.6) if kind == "fingertip" else points_of(kind, scene, HEAVIEST)
    z = attracted(points, area_of(kind, scene, points))
    wanted = Harmonics(np.fft.rfft(z) / COUNT, scene.scan.speed / points.period)
    check_quantities(scene, (wanted,), 1e-3)


def test_an_attraction_reaches_beyond_the_places_that_touch_without_it() -> None:
    finger, law = {"kind": "probe", "youngs_modulus": "2 MPa"}, {"stress": 2e4, "reach": 1.5e-5}
    scene = scene_of("default", {"adhesion": law}, finger=finger)
    points = points_of("probe", scene, 8.0 * HEAVIEST)
    z = attracted(points, area_of("probe", scene, points), **law)
    wanted = Harmonics(np.fft.rfft(z) / COUNT, scene.scan.speed / points.period)
    check_quantities(scene, (wanted,), 1e-3)


@pytest.mark.parametrize(("finger", "said"), [({}, ": 0.5 N where"), ({"contact_width": "5 mm"}, ": 0.25 N where")])
def test_the_plan_says_how_hard_the_whole_contact_attracts(finger: dict[str, Any], said: str) -> None:
    kind = "fingertip" if finger else "comb"
    finger = {"kind": kind, "contact_length": "10 mm", **finger}
    scene = parse_scene({"finger": finger, "effects": {"adhesion": {}}, "accuracy": {"tolerance": 1e-2}})
    plan = open_voice(scene).plan
    assert any(said in one.reason for one in plan.simulated if one.name == "adhesion")


REFUSED: dict[str, tuple[dict[str, Any], str]] = {
    "friction of another power under a fingertip": (
        {"finger": {"kind": "fingertip"}, "effects": {"tangential": {"pressure_exponent": 0.8}}},
        'Write a pressure_exponent of 1, or finger.kind "comb" or "probe"',
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_a_finger_cannot_have_is_refused_with_what_to_write_instead(name: str) -> None:
    scene, words = REFUSED[name]
    with pytest.raises(SceneError, match=words):
        open_voice(parse_scene(scene), live=True)


PRESSING = {"trajectory": [[0, 0, 0.1], [0.03, 0.002, 0.5], [0.06, 0.005, 0.05]]}


@pytest.mark.parametrize("effect", ["viscous_skin", "adhesion"])
@pytest.mark.parametrize("scan", [{}, PRESSING], ids=["constant", "pressing"])
def test_a_law_of_the_pressure_has_a_probe_under_every_load(effect: str, scan: dict[str, Any]) -> None:
    document = {"finger": {"kind": "probe"}, "effects": {effect: {}}, "scan": scan, "accuracy": {"tolerance": 0.03}}
    block = open_voice(parse_scene({**document, "output": {"sample_rate": 8000}})).render(480)
    assert np.all(np.isfinite(block)) and np.ptp(block) > 0.0


@pytest.mark.parametrize("kind", ["fingertip", thorough("comb")])
def test_an_attraction_over_an_area_is_that_of_the_depths_over_it(kind: str) -> None:
    """The attraction of a gap up to d0 is a difference of the mean depths at z and d0 lower."""
    finger = {"kind": kind, "contact_length": "1.5 mm"}
    sections: dict[str, Any] = {"finger": finger, "texture": {"kind": "dots"}, "accuracy": {"tolerance": 1e-2}}
    scene = scene_of("default", {"adhesion": {"stress": "20 kPa"}}, **sections)
    contact: Any = contact_of(scene)
    contact = contact.halved().halved()  # as a file has
    k, area = contact.stiffness_at(LOAD), scene.finger.contact_length * contact.width_at(LOAD)

    def excess(z: float, phase: float) -> float:
        near, far = (float(contact.measure(np.array([phase]), np.array([at]), LOAD)[0][0]) for at in (z, z - REACH))
        return float(k * near - 2e4 * area * (far - near) / REACH - LOAD)

    phases = np.arange(-32, COUNT) / COUNT
    z, found = float(contact.approach(phases[:1] % 1.0, LOAD)[0][0]), []
    for phase in (phases % 1.0).tolist():
        z = rooted(excess, z, phase)
        found.append(z)
    wanted = Harmonics(np.fft.rfft(found[32:]) / COUNT, scene.scan.speed / contact.geometry.texture_period)
    check_quantities(scene, (wanted,), 5e-3)
