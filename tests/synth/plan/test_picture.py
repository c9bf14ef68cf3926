"""The picture of a contact: its surfaces add up to eq. 2, and its patches carry the load of the paper's law."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.special import roots_legendre

from synth.arrays import Array
from synth.contact.fingertip import FingertipContact
from synth.contact.scene_contact import contact_of
from synth.errors import InvalidRequest
from synth.plan.contact_picture import DIGITS, MOST_PATCHES, PHASES, POINTS, picture
from synth.plan.prepare import prepare
from synth.response_cache import ResponseCache
from synth.scene.scene import Scene, parse_scene
from tests.few import few
from tests.synth.engine_cases import spread

ROUNDED = 10.0**-DIGITS
SCENES: dict[str, dict[str, Any]] = {
    "default": {},
    "light": {"scan": {"load": "1 mN"}},
    "hardly": {"scan": {"load": "1 uN"}},
    "heavy": {"scan": {"load": "50 N"}},
    "locked": {"texture": {"period": "0.5 mm", "amplitude": "40 um"}},
    "nearly locked": {"texture": {"period": "0.501 mm", "amplitude": "40 um"}},
    "smooth finger": {"finger": {"ridge_amplitude": 0}},
    "flat texture": {"texture": {"amplitude": 0}},
    "long period": {"texture": {"period": "20 mm", "amplitude": "200 um"}},
    "fine": {"texture": {"period": "50 um", "amplitude": "2 um"}},
    "elastic": {"texture": {"youngs_modulus": "1 MPa"}},
    "grown": {"effects": {"contact_growth": {}}, "scan": {"load": "3 N"}},
    "shrunk": {"effects": {"contact_growth": {}}, "scan": {"load": "20 mN"}},
    "round": {"effects": {"curvature": {}}},
    "round by itself": {"effects": {"curvature": "auto"}},
}


def drawn(scene: Scene, **asked: Any) -> SimpleNamespace:
    """Return the picture of `scene`, with arrays by name."""
    told = picture(scene, **asked)
    finger, response = told["finger"], told["response"]
    own = {"approach": np.array(response["heights"]), "heights_of_finger": np.array(finger["heights"])}
    return SimpleNamespace(**told | finger | response | own)


def overlap(scene: Scene, made: SimpleNamespace, x: Array, phase: float, z: float) -> Array:
    """Return h - z (m) of eq. 2, and of a round finger, written out."""
    finger, texture = scene.finger, scene.texture
    p = phase * texture.period
    h = texture.amplitude * np.cos(2 * math.pi * (x - p) / texture.period + texture.phase)
    h = h - finger.ridge_amplitude * np.cos(2 * math.pi * x / finger.ridge_period)
    dome = 0.0
    if "curvature" in scene.effects:
        contact = prepare(scene, CACHE).contact
        assert contact is not None
        dome = contact.dome
    return np.asarray(h - 0.5 * dome * (x - 0.5 * finger.contact_length) ** 2 - z)


CACHE = ResponseCache()
NODES, WEIGHTS = roots_legendre(16)


def carried(scene: Scene, made: SimpleNamespace, place: int) -> float:
    """Return the force (N) of the overlap within the patches of one phase."""
    assert made.touching is not None and made.foundation is not None
    edges, total = made.touching[place], 0.0
    shortest = min(scene.finger.ridge_period, scene.texture.period)
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        cuts = np.linspace(begin, end, max(1, math.ceil(4 * (end - begin) / shortest)) + 1)
        half = 0.5 * np.diff(cuts)[:, np.newaxis]
        x = 0.5 * (cuts[1:] + cuts[:-1])[:, np.newaxis] + half * NODES
        deep = overlap(scene, made, x, place / len(made.approach), float(made.approach[place]))
        total += float(np.sum(half * WEIGHTS * deep))
    return float(made.foundation * total)


@pytest.mark.parametrize("name", SCENES)
def test_the_patches_carry_the_load(name: str) -> None:
    scene = parse_scene(SCENES[name])
    made = drawn(scene, phases=12, cache=CACHE)
    for place in range(12):
        allowed = 1e-4 if scene.effects else 1e-7  # a round or a growing finger is solved on segments
        assert carried(scene, made, place) == pytest.approx(scene.scan.load, rel=allowed), place


@pytest.mark.parametrize("name", SCENES)
def test_outside_the_patches_there_is_a_gap_and_inside_there_is_none(name: str) -> None:
    scene = parse_scene(SCENES[name])
    made = drawn(scene, phases=6, cache=CACHE)
    assert made.touching is not None
    x = np.linspace(made.begin, made.begin + made.length, 10_001)
    rounding = 1e-12 * (scene.finger.ridge_amplitude + scene.texture.amplitude) + 1e-18
    for place, edges in enumerate(made.touching):
        assert edges == sorted(edges) and len(edges) % 2 == 0
        inside = np.searchsorted(edges, x) % 2 == 1
        deep = overlap(scene, made, x, place / 6, float(made.approach[place]))
        far = np.min(np.abs(x[:, np.newaxis] - np.array(edges)), axis=1) > 1e-9 * made.length
        assert np.all(deep[inside & far] > -rounding)
        assert np.all(deep[~inside & far] < rounding)


@pytest.mark.parametrize("name", ["default", "light", "heavy", "nearly locked", "grown", "round"])
def test_the_patches_are_as_long_as_the_solver_says(name: str) -> None:
    scene = parse_scene(SCENES[name])
    made = drawn(scene, phases=16, cache=CACHE)
    contact = prepare(scene, CACHE).contact
    assert contact is not None and made.touching is not None
    _depth, touching = contact.measure(np.arange(16) / 16, made.approach, scene.scan.load)
    found = [sum(edges[1::2]) - sum(edges[::2]) for edges in made.touching]
    assert np.array(found) / made.length == pytest.approx(touching, abs=1e-5 if scene.effects else 1e-7)


@pytest.mark.parametrize("seed", few(range(8), 3))
def test_random_contacts_carry_their_load(seed: int) -> None:
    random = np.random.default_rng(seed)
    for _ in range(6):
        ridge = spread(random, 2e-4, 1e-3)
        document = {
            "finger": {
                "ridge_period": ridge,
                "ridge_amplitude": spread(random, 2e-6, 1e-4),
                "contact_length": spread(random, 5e-4, 2e-2),
            },
            "texture": {
                "period": ridge * spread(random, 0.1, 20),
                "amplitude": spread(random, 2e-6, 1e-4),
                "phase": float(random.uniform(-9, 9)),
            },
            "scan": {"load": spread(random, 1e-4, 3)},
        }
        scene = parse_scene(document)
        made = drawn(scene, phases=6)
        for place in range(6):
            assert carried(scene, made, place) == pytest.approx(scene.scan.load, rel=1e-6), (document, place)


def test_z_is_that_of_the_solver_to_the_last_digit() -> None:
    scene = parse_scene({})
    wanted, _slope = contact_of(scene).approach(np.arange(PHASES) / PHASES, scene.scan.load)
    assert picture(scene)["response"]["heights"] == wanted.tolist()


@pytest.mark.parametrize("name", ["default", "grown", "round", "long period"])
def test_what_is_told_adds_up_to_the_overlap(name: str) -> None:
    """The two surfaces of the picture together give the overlap of eq. 2."""
    scene = parse_scene(SCENES[name])
    told = picture(scene, points=4096, phases=5, cache=CACHE)
    texture, finger, response = told["texture"], told["finger"], told["response"]
    count = len(finger["heights"])
    x = finger["begin"] + finger["length"] * np.arange(count) / (count - 1)
    places = texture["period"] * np.arange(len(texture["heights"])) / len(texture["heights"])
    made = drawn(scene, phases=5, cache=CACHE)
    for place, z in enumerate(response["heights"]):
        moved = x - place / 5 * texture["period"]
        under = np.interp(moved, places, texture["heights"], period=texture["period"])
        shown = under + np.array(finger["heights"]) - z
        scale = scene.texture.amplitude + scene.finger.ridge_amplitude
        assert shown == pytest.approx(overlap(scene, made, x, place / 5, z), abs=1e-6 * scale)


def test_heights_are_told_with_nine_digits() -> None:
    told = picture(parse_scene({}), points=32, phases=2)
    exact = 20e-6 * math.cos(2 * math.pi * 3 / 32 + math.sqrt(2))
    assert told["texture"]["heights"][3] == pytest.approx(exact, rel=ROUNDED)
    assert told["texture"]["heights"][3] == float(f"{exact:.9g}")


def test_a_contact_that_grew_lies_about_the_middle_of_the_nominal_one() -> None:
    scene = parse_scene(SCENES["grown"])
    made = drawn(scene, phases=1)
    assert made.length > scene.finger.contact_length and made.begin < 0
    assert made.begin + 0.5 * made.length == pytest.approx(0.5 * scene.finger.contact_length)
    plain = drawn(parse_scene({}), phases=1)
    assert (plain.begin, plain.length) == (0.0, 0.01)


def test_what_moves_z_with_time_is_left_out_and_named() -> None:
    effects: dict[str, Any] = {"inertia": {}, "adhesion": {}, "tangential": {}, "curvature": {}}
    scene = parse_scene({"effects": effects})
    made = drawn(scene, phases=4)
    assert set(made.left_out) == {"inertia", "adhesion", "tangential"}
    assert np.array_equal(made.approach, drawn(parse_scene({"effects": {"curvature": {}}}), phases=4).approach)


def test_without_a_load_nothing_touches() -> None:
    pulls: dict[str, Any] = {"effects": {"adhesion": {}}, "scan": {"load": "-10 mN"}}
    for document in ({"scan": {"load": 0}}, pulls):
        made = drawn(parse_scene(document), phases=4)
        assert made.touching == [[], [], [], []] and made.foundation is None and made.load == 0.0
        assert np.all(np.isfinite(made.approach))


def test_no_phases_is_the_surfaces_alone() -> None:
    told = picture(parse_scene({}), phases=0)
    assert told["response"]["heights"] == told["touching"] == []
    assert len(told["texture"]["heights"]) == POINTS


def test_too_many_patches_are_told_as_none() -> None:
    fine = parse_scene({"texture": {"period": "10 um"}})
    assert MOST_PATCHES < 256 * 1000
    assert drawn(fine).touching is None
    few = drawn(fine, phases=16)
    assert few.touching is not None and len(few.touching) == 16


def test_the_cost_is_bounded_whatever_the_scene() -> None:
    many = parse_scene({"texture": {"period": "1 um"}, "finger": {"contact_length": "0.1 m"}})
    assert 1 <= len(drawn(many).approach) < 32
    with pytest.raises(InvalidRequest) as refused:
        picture(many, phases=1024)
    (fault,) = refused.value.faults
    assert fault.pointer == "/phases" and "for this scene" in fault.allowed


def test_every_number_that_is_wrong_is_named() -> None:
    with pytest.raises(InvalidRequest) as refused:
        picture(parse_scene({}), points=1, phases=5000)
    assert [fault.pointer for fault in refused.value.faults] == ["/points", "/phases"]


@pytest.mark.parametrize("texture", [{}, {"kind": "grating-2mm-157um"}], ids=["0.8 mm", "2 mm"])
def test_the_line_of_a_fingertip_touches_where_the_picture_says(texture: dict[str, Any]) -> None:
    scene = parse_scene({"finger": {"kind": "fingertip"}, "texture": texture})
    made = drawn(scene, points=1024, phases=12)
    contact = contact_of(scene)
    assert isinstance(contact, FingertipContact) and made.touching is not None
    line = contact.middle_line(
        np.linspace(made.begin, made.begin + made.length, 1024) - 0.5 * scene.finger.contact_length
    )
    assert np.abs(made.heights_of_finger - line).max() < 1e-9
    edges = [edge for phase in made.touching for edge in phase]
    ridge = scene.finger.ridge_period
    assert [made.begin, made.begin + made.length] == pytest.approx([min(edges) - ridge, max(edges) + ridge])
    x = np.linspace(made.begin, made.begin + made.length, 4001)
    for place, phase in enumerate(made.touching):
        moved = x - place / 12 * scene.texture.period
        height = contact.middle_line(x - 0.5 * scene.finger.contact_length) + contact.geometry.texture(moved)
        deep = height - float(made.approach[place])
        inside = np.searchsorted(phase, x) % 2 == 1
        far = np.abs(deep) > 1e-9
        assert np.array_equal(inside[far], deep[far] > 0.0)


def test_a_fingertip_that_is_lifted_is_shown_whole() -> None:
    made = drawn(parse_scene({"finger": {"kind": "fingertip"}, "scan": {"load": 0}}), points=64, phases=4)
    assert (made.begin, made.length) == pytest.approx((-5e-3, 20e-3))
    assert made.touching == [[]] * 4
