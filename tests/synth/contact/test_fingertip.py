"""A fingertip: its points against sums over all of them, its growth with the load, and what it does to a texture."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import ridgewave as rw
from synth.contact.fingertip import REACH, FingertipContact, Footprint
from synth.contact.fingertip_solver import FingertipGrid
from synth.contact.geometry import Geometry
from synth.contact.scene_contact import contact_of
from synth.contact.stiffness import Stiffness
from synth.errors import SceneError
from synth.plan.contact_picture import picture
from synth.response.spectrum import curves
from synth.scene.scene import Scene, parse_scene
from synth.surfaces import profile_of
from synth.surfaces.ridge_field import PATTERNS
from tests.few import thorough
from tests.reference.fingertip_oracle import Heights, Print, approach, footprint_depth
from tests.synth.response.table_study import measured_scene
from tests.synth.surfaces.texture_cases import random_texture

RATE = 8000
FINGERTIP: dict[str, Any] = {"kind": "fingertip"}
KINDS = ("sinusoid", "harmonics", "grating", "rough", "profile")


def tip_of(scene: Any) -> FingertipContact:
    """Return the fingertip of `scene`."""
    contact = contact_of(scene if isinstance(scene, Scene) else parse_scene(scene))
    assert isinstance(contact, FingertipContact)
    return contact


def grid_of(contact: FingertipContact) -> FingertipGrid:
    """Return the points of a fingertip on a texture along one line."""
    assert isinstance(contact.grid, FingertipGrid)
    return contact.grid


def points_of(contact: FingertipContact) -> tuple[Any, Any]:
    """Return place along the scan and height (m) of every point of the solver."""
    grid = grid_of(contact)
    places = grid.places * contact.geometry.texture_period
    return np.repeat(places, np.diff(grid.starts)), grid.heights.astype(float) * grid.height_scale


def texture_of(contact: FingertipContact) -> Heights:
    """Return the heights (m) of the texture at places along it (m), as the columns meet it: straight between knots."""
    knots, period = grid_of(contact).texture * grid_of(contact).height_scale, contact.geometry.texture_period
    turns = np.arange(len(knots)) / (len(knots) - 1)
    return lambda places: np.interp(places / period % 1.0, turns, knots)


def random_scene(seed: int) -> dict[str, Any]:
    """Return a random fingertip on a random texture of kind number `seed` modulo their number."""
    random = np.random.default_rng([19, seed])
    kind = KINDS[seed % len(KINDS)]
    finger = {
        "kind": "fingertip",
        "ridge_period": float(random.uniform(0.4e-3, 0.6e-3)),
        "ridge_amplitude": float(random.uniform(20e-6, 60e-6)),
        "contact_length": float(random.uniform(2e-3, 6e-3)),
        "contact_width": float(random.uniform(2e-3, 6e-3)),
        "pattern": PATTERNS[int(random.integers(3))],
        **{name: float(random.uniform(0.0, 0.5)) for name in ("spacing_spread", "direction_spread", "height_spread")},
        "seed": int(random.integers(1_000_000)),
    }
    sinusoid = {"period": float(random.uniform(0.2e-3, 4e-3)), "amplitude": float(random.uniform(2e-6, 30e-6))}
    texture = sinusoid if kind == "sinusoid" else random_texture(kind, random)
    scan = {"load": float(10.0 ** random.uniform(-1.5, 0.5)), "speed": float(random.uniform(0.05, 0.2))}
    output = {"quantity": "displacement", "sample_rate": RATE, "duration": 0.05}
    return {"finger": finger, "texture": texture, "scan": scan, "output": output}


@pytest.mark.parametrize("seeds", [range(5), *(thorough(range(first, first + 15)) for first in (5, 20, 35))])
def test_a_file_is_that_of_brute_force_over_the_points(seeds: range) -> None:
    """Every kind of texture: the error is within the tolerance, or within the error that the plan reports."""
    for seed in seeds:
        sound = rw.render(random_scene(seed))
        scene = rw.parse_scene(sound.scene)
        contact, profile = tip_of(scene), profile_of(scene)
        load, turns = scene.scan.load, scene.scan.speed / profile.period
        highest = max(1, math.ceil(1000.0 / turns) - 1)
        count = 1 << (64 * highest).bit_length()
        solved, _slope = contact.approach(np.arange(count) / count, load)
        x, h1 = points_of(contact)
        some = np.random.default_rng(seed).choice(count, 16)
        places, indentation = some / count * profile.period, Stiffness.of_scene(scene).indentation(load)
        z = approach(x, h1, grid_of(contact).cell, texture_of(contact), places, indentation)
        assert np.max(np.abs(solved[some] - z)) < 1e-11 * grid_of(contact).height_scale
        series = np.fft.rfft(solved)[: highest + 1] / count
        series[0] = 0.0
        extent = float(np.ptp(curves(series, 0, count)))
        n = np.arange(1, highest + 1)
        wanted = (
            2.0 * (np.exp(2j * math.pi * np.outer(turns * np.arange(len(sound.values)) / RATE, n)) @ series[1:]).real
        )
        told = sound.plan.estimated_error["displacement"] if sound.plan else 0.0
        folded = 2e-4  # of the series here, at 64 places a harmonic or more
        assert np.max(np.abs(sound.values[:, 0] - wanted)) <= (max(1e-3, told) + folded) * extent, seed


@pytest.mark.parametrize("kind", KINDS)
def test_a_column_meets_the_mean_of_the_texture_over_its_width(kind: str) -> None:
    """Waves as short as a column is wide would otherwise move the whole finger slowly."""
    random = np.random.default_rng(7)
    texture = {"period": "0.8 mm"} if kind == "sinusoid" else random_texture(kind, random)
    contact = tip_of({"finger": FINGERTIP, "texture": texture})
    profile, period = contact.geometry.profile, contact.geometry.texture_period
    assert profile is not None
    width = float(grid_of(contact).places[1] - grid_of(contact).places[0]) * period
    places = random.uniform(0.0, period, 64)
    inside = (np.arange(4096) + 0.5) / 4096 - 0.5
    wanted = profile.heights(places[:, np.newaxis] + width * inside).mean(axis=1)
    assert np.max(np.abs(texture_of(contact)(places) - wanted)) <= 2e-4 * (profile.extent[1] - profile.extent[0])


@pytest.mark.parametrize("pattern", PATTERNS)
def test_the_points_are_those_of_the_ridges_drawn_anew(pattern: str) -> None:
    size = {"contact_length": "4 mm", "contact_width": "3 mm"}
    scene = parse_scene({"finger": {**FINGERTIP, **size, "pattern": pattern}})
    finger, contact = scene.finger, tip_of(scene)
    flat = Geometry(finger.ridge_amplitude, finger.ridge_period, 0.0, finger.ridge_period, 0.0, 4e-3)
    law = Stiffness.of_contact(flat, contact.stiffness.contact_modulus)
    depth = footprint_depth(finger.ridge_amplitude, law.indentation(1.0))
    assert contact.footprint.depth == pytest.approx(depth, rel=1e-9)
    drawn = Print(finger.ridge_period, finger.ridge_amplitude, pattern, 0.3, 0.3, 0.3, 0)
    x, found = points_of(contact)
    rows = 2.0 * 3e-3
    for column in (0, len(grid_of(contact).places) // 3, len(grid_of(contact).places) // 2):
        place = grid_of(contact).places[column] * contact.geometry.texture_period
        ours = found[x == place]
        count = round(rows / _row_step(contact))
        y = (np.arange(count) + 0.5) * (rows / count) - 0.5 * rows
        inside = (2.0 * place / (REACH * 4e-3)) ** 2 + (2.0 * y / rows) ** 2 < 1.0
        y = y[inside]
        drop = contact.footprint.depth * ((2.0 * place / 4e-3) ** 2 + (2.0 * y / 3e-3) ** 2)
        theirs = np.sort(drawn.heights(np.full_like(y, place), y) - drop)[::-1]
        assert np.allclose(ours, theirs, rtol=2e-7, atol=0.0)


def _row_step(contact: FingertipContact) -> float:
    """Return the distance of rows (m), from the area of a point."""
    grid, footprint = grid_of(contact), contact.footprint
    along = float(grid.places[1] - grid.places[0]) * contact.geometry.texture_period
    return grid.cell * footprint.length * footprint.width / along


def test_a_smooth_fingertip_on_a_plate_is_a_paraboloid_on_a_foundation() -> None:
    """Its volume above the plate is pi a b d / 2, so at 1 N it touches over L0 by W0."""
    law = tip_of({"finger": {**FINGERTIP, "ridge_amplitude": 0.0}}).stiffness
    footprint = Footprint.of(0.01, 0.02, 0.0, law)
    volume = 0.5 * math.pi * 0.005 * 0.01 * footprint.depth
    assert volume == pytest.approx(law.indentation(1.0) * 0.01 * 0.02, rel=1e-3)


def test_the_footprint_grows_with_the_load_and_fades_to_its_edge() -> None:
    contact = tip_of({"finger": FINGERTIP})
    x, h1 = points_of(contact)
    lengths = []
    for load in (0.05, 0.3, 1.0, 5.0):
        z = float(contact.approach(np.zeros(1), load)[0][0])
        h = h1 + contact.geometry.texture(x)
        pressed = np.clip(h - z, 0.0, None)
        share = np.cumsum(np.bincount(np.digitize(np.abs(x), np.linspace(0.0, 0.01, 51)), pressed, 53))
        lengths.append(2.0 * 0.01 / 50.0 * float(np.searchsorted(share, 0.99 * share[-1])))
        assert np.max(np.abs(x[pressed > 0.0])) < 0.5 * REACH * 0.01
        edge = pressed[np.abs(x) > 0.9 * np.max(np.abs(x[pressed > 0.0]))].mean()
        assert edge < 0.25 * pressed[np.abs(x) < 1e-3].mean()
    assert lengths == sorted(lengths) and 0.006 < lengths[2] < 0.014


@pytest.mark.parametrize("spread", [0.0, 0.3])
def test_the_spread_of_the_ridges_brings_the_fundamental_back(spread: float) -> None:
    """Equal ridges cancel it where they are commensurate with the texture; unequal ones do not (Delhaye, 2012)."""
    spreads = dict.fromkeys(("spacing_spread", "direction_spread", "height_spread"), spread)
    finger = {**FINGERTIP, **spreads, "ridge_period": "0.5 mm", "pattern": "straight"}
    contact = tip_of({"finger": finger, "texture": {"period": "0.8 mm"}})
    lines = np.abs(np.fft.rfft(contact.approach(np.arange(128) / 128, 0.3)[0]))[1:]
    assert (lines[0] > 0.5 * lines.max()) == (spread > 0.0)


@pytest.mark.parametrize("period", [0.1e-3, *(thorough(one) for one in (0.2e-3, 0.46e-3, 2e-3, 5e-3)), 0.8e-3])
def test_a_table_is_within_its_reported_error(period: float) -> None:
    scene = parse_scene({"finger": FINGERTIP, "texture": {"period": period, "amplitude": min(20e-6, 0.03 * period)}})
    found = measured_scene(scene, 3, loads=4)
    assert np.max(found.errors / found.told) <= 1.0
    assert found.nbytes <= 4_000_000
    if period >= 0.4e-3:
        assert np.max(found.errors[0]) <= 2e-3


def test_the_same_seed_is_the_same_finger_and_another_is_another() -> None:
    one, same, other = (tip_of({"finger": {**FINGERTIP, "seed": seed}}) for seed in (1, 1, 2))
    assert one.key == same.key and np.array_equal(grid_of(one).heights, grid_of(same).heights)
    assert one.key != other.key and not np.array_equal(grid_of(one).heights, grid_of(other).heights)


def test_hard_fingertips_render_or_say_what_to_write() -> None:
    output = {"duration": 0.05, "sample_rate": RATE}
    for change in (
        {"ridge_amplitude": 0.0},
        {"contact_length": 1e-5},
        {"contact_width": 0.02},
        {"spacing_spread": 0.5},
    ):
        values = rw.render({"finger": {**FINGERTIP, **change}, "output": output}).values
        assert np.isfinite(values).all() and values.any()
    with pytest.raises(SceneError, match=r"a period of 40 um or more under .*finger\.kind"):
        tip_of({"finger": FINGERTIP, "texture": {"period": "10 um", "amplitude": "1 um"}})
    assert tip_of({"finger": FINGERTIP, "texture": {"period": "40 um", "amplitude": "1 um"}}).grid


def test_no_load_is_silence_and_a_stroke_that_lifts_ends_in_zeros() -> None:
    finger = {**FINGERTIP, "contact_length": "2 mm"}
    values = rw.render({"finger": finger, "scan": {"load": 0.0}, "output": {"duration": 0.05}}).values
    assert not values.any()
    scan = {"trajectory": [[0, 0, 0.3], [0.1, 0.008, 0.3], [0.15, 0.012, 0.0], [0.3, 0.02, 0.0]]}
    values = rw.render({"finger": finger, "scan": scan, "output": {"duration": 0.3, "sample_rate": RATE}}).values
    assert values[:800].any() and not values[1300:].any()


def test_the_picture_is_the_line_through_the_middle() -> None:
    drawn = picture(parse_scene({"finger": FINGERTIP}), points=512, phases=8)
    begin, end = drawn["finger"]["begin"], drawn["finger"]["begin"] + drawn["finger"]["length"]
    edges = [edge for phase in drawn["touching"] for edge in phase]
    assert begin == pytest.approx(min(edges) - 0.46e-3) and end == pytest.approx(max(edges) + 0.46e-3)  # a ridge more
    assert len(drawn["touching"]) == 8 and all(len(edges) % 2 == 0 for edges in drawn["touching"])
    middle = np.array(drawn["finger"]["heights"])
    assert middle[256 - 60 : 256 + 60].max() > middle[:60].max()


def test_scenes_that_differ_in_their_scan_share_a_fingertip() -> None:
    asked = {"finger": {"kind": "fingertip"}, "texture": {"period": "1.5 mm"}}
    contact = contact_of(parse_scene(asked))
    assert contact_of(parse_scene({**asked, "scan": {"load": "1 N", "speed": "20 mm/s"}})) is contact
    for other in ({"finger": {"kind": "fingertip", "seed": 1}}, {"texture": {"period": "1.6 mm"}}):
        assert contact_of(parse_scene({**asked, **other})) is not contact
