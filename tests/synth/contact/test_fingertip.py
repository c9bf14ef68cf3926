"""A fingertip: renders beside brute force, its surface, its growth with the load, and what it does to a texture."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import ridgewave as rw
from synth.contact.fingertip import FingertipContact
from synth.contact.fingertip_solver import FingertipGrid
from synth.contact.footprint import REACH, Footprint
from synth.contact.geometry import Geometry
from synth.contact.scene_contact import contact_of
from synth.contact.stiffness import Stiffness
from synth.plan.contact_picture import picture
from synth.scene.scene import Scene, parse_scene
from synth.surfaces.ridge_field import PATTERNS
from tests.few import thorough
from tests.reference.fingertip_oracle import Print, footprint_depth
from tests.synth.contact.fingertip_study import random_scene, render_errors
from tests.synth.response.table_study import measured_scene

RATE = 8000
FINGERTIP: dict[str, Any] = {"kind": "fingertip"}
SMALL = {"contact_length": "3 mm", "contact_width": "2 mm"}
QUICK = (0, 1, 2, 4, 7, 9, 10, 16)  # whose brute force is near enough with half of its columns and rows
TRUSTED = 1e-2  # largest doubt about brute force, of the peak-to-peak


def tip_of(scene: Any) -> FingertipContact:
    """Return the fingertip of `scene`."""
    contact = contact_of(scene if isinstance(scene, Scene) else parse_scene(scene))
    assert isinstance(contact, FingertipContact)
    return contact


def grid_of(contact: FingertipContact) -> FingertipGrid:
    """Return the solver of a fingertip on a texture along one line."""
    assert isinstance(contact.grid, FingertipGrid)
    return contact.grid


@pytest.mark.parametrize("seed", [*QUICK, *(thorough(seed) for seed in range(50) if seed not in QUICK)])
def test_a_render_is_within_its_told_error_of_brute_force(seed: int) -> None:
    """In displacement, velocity and acceleration; brute force is a sum over points, at two distances of the points."""
    tolerance = (1e-2, 1e-3)[seed // 5 % 2]
    for found in render_errors(random_scene(seed), tolerance, many=0.5 if seed in QUICK else 1.0):
        assert found.doubt < TRUSTED
        assert found.true <= found.told + found.doubt


@pytest.mark.thorough
def test_the_samples_of_the_finger_are_part_of_the_told_error() -> None:
    """What is left at fine columns and nodes is the error of the polynomials between the samples of the finger."""
    asked = {"finger": FINGERTIP, "texture": {"kind": "grating-800um-40um"}, "scan": {"load": 0.1, "speed": "80 mm/s"}}
    displacement = render_errors(asked, 1e-3)[0]
    assert displacement.doubt < 0.5 * displacement.told
    assert displacement.true <= displacement.told + displacement.doubt


@pytest.mark.parametrize("pattern", PATTERNS)
def test_the_surface_is_that_of_the_ridges_drawn_anew(pattern: str) -> None:
    size = {"contact_length": "4 mm", "contact_width": "3 mm"}
    scene = parse_scene({"finger": {**FINGERTIP, **size, "pattern": pattern}})
    finger, contact = scene.finger, tip_of(scene)
    flat = Geometry(finger.ridge_amplitude, finger.ridge_period, 0.0, finger.ridge_period, 0.0, 4e-3)
    law = Stiffness.of_contact(flat, contact.stiffness.contact_modulus, 3e-3)
    depth = footprint_depth(finger.ridge_amplitude, law.indentation(1.0))
    assert contact.footprint.depth == pytest.approx(depth, rel=1e-9)
    drawn, random = (
        Print(finger.ridge_period, finger.ridge_amplitude, pattern, 0.3, 0.3, 0.3, 0),
        np.random.default_rng(1),
    )
    x, y = random.uniform(-4e-3, 4e-3, 50), random.uniform(-3e-3, 3e-3, 40)
    every = np.repeat(x, len(y)), np.tile(y, len(x))
    drop = depth * ((2.0 * every[0] / 4e-3) ** 2 + (2.0 * every[1] / 3e-3) ** 2)
    assert np.allclose(contact.surface.heights(x, y).ravel(), drawn.heights(*every) - drop, rtol=0.0, atol=1e-12)


def test_forces_and_areas_follow_from_the_solution() -> None:
    """F at the solved z is w / k at any phases and loads, and the slopes are the derivative of the energy."""
    asked = {"finger": {**FINGERTIP, **SMALL}, "texture": {"kind": "grating", "period": "1.3 mm"}}
    contact = replace(tip_of(asked), coarser=0.25)
    phases = np.sort(np.random.default_rng(2).uniform(-3.0, 3.0, 40))
    for load in (0.01, 0.3, 3.0):
        z, _rate = contact.approach(phases, load)
        depth, touching = contact.measure(phases, z, load)
        assert np.allclose(depth, contact.indentation(load), rtol=1e-6)
        step = 1e-9
        nearer, _touching = contact.measure(phases, z - step, load)
        assert np.allclose((nearer - depth) / step, touching, rtol=2e-3)
        moved = 1e-3  # of a period
        slope = grid_of(contact).slope_integrals(1.3e-3, phases, z)
        ahead, behind = (contact.measure(phases + sign * moved, z, load)[0] for sign in (1.0, -1.0))
        assert np.allclose((behind - ahead) / (2.0 * moved * 1.3e-3), slope[1], atol=2e-2 * np.max(np.abs(slope[1])))
        assert np.allclose(slope[2:], [depth, touching], rtol=1e-9)


def test_what_was_solved_before_changes_nothing() -> None:
    """Heavier loads make the columns deeper, which must not move the sound of lighter ones."""
    finger = {**FINGERTIP, **SMALL, "seed": 77}
    contact = tip_of({"finger": finger, "texture": {"period": "1.3 mm", "amplitude": "40 um"}})
    phases = np.random.default_rng(3).uniform(0.0, 1.0, 64)
    before, depth = contact.approach(phases, 0.1)[0], len(grid_of(contact).fold.areas)
    contact.approach(phases, 20.0)
    assert len(grid_of(contact).fold.areas) > depth
    assert np.array_equal(contact.approach(phases, 0.1)[0], before)


def test_results_depend_on_no_order_of_phases() -> None:
    contact = tip_of({"finger": {**FINGERTIP, **SMALL}, "texture": {"kind": "rough", "period": "3 mm"}})
    phases = np.random.default_rng(4).uniform(0.0, 1.0, 200)
    z, backwards = contact.approach(phases, 0.3)[0], contact.approach(phases[::-1], 0.3)[0][::-1]
    assert np.max(np.abs(z - backwards)) < 1e-9 * contact.geometry.height_scale


def test_a_smooth_fingertip_on_a_plate_is_a_paraboloid_on_a_foundation() -> None:
    """Its volume above the plate is pi a b d / 2, so at 1 N it touches over L0 by W0."""
    law = tip_of({"finger": {**FINGERTIP, "ridge_amplitude": 0.0}}).stiffness
    footprint = Footprint.of(0.01, 0.02, 0.0, law)
    volume = 0.5 * math.pi * 0.005 * 0.01 * footprint.depth
    assert volume == pytest.approx(law.indentation(1.0) * 0.01 * 0.02, rel=1e-3)


def test_the_footprint_grows_with_the_load_and_fades_to_its_edge() -> None:
    contact = tip_of({"finger": FINGERTIP})
    x, y = np.linspace(-0.01, 0.01, 801), np.linspace(-0.01, 0.01, 601)
    h = contact.surface.heights(x, y) + contact.geometry.texture(x)[:, np.newaxis]
    lengths = []
    for load in (0.05, 0.3, 1.0, 5.0):
        z = float(contact.approach(np.zeros(1), load)[0][0])
        pressed = np.clip(h - z, 0.0, None)
        along, edge = pressed.sum(axis=1), np.max(np.abs(x[np.any(pressed > 0.0, axis=1)]))
        share = np.cumsum(np.bincount(np.digitize(np.abs(x), np.linspace(0.0, 0.01, 51)), along, 53))
        lengths.append(2.0 * 0.01 / 50.0 * float(np.searchsorted(share, 0.99 * share[-1])))
        assert edge < 0.5 * REACH * 0.01
        assert along[np.abs(x) > 0.9 * edge].mean() < 0.25 * along[np.abs(x) < 1e-3].mean()
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
    found = [contact.approach(np.arange(16) / 16, 0.3)[0] for contact in (one, same, other)]
    assert one.key == same.key and np.array_equal(found[0], found[1])
    assert one.key != other.key and not np.array_equal(found[0], found[2])


@pytest.mark.parametrize(
    "change",
    [{"ridge_amplitude": 0.0}, {"contact_length": 1e-5}, thorough({"contact_width": 0.02}), {"spacing_spread": 0.5}],
    ids=str,
)
def test_hard_fingertips_render(change: dict[str, float]) -> None:
    output = {"duration": 0.05, "sample_rate": RATE}
    values = rw.render({"finger": {**FINGERTIP, **change}, "output": output}).values
    assert np.isfinite(values).all() and values.any()


@pytest.mark.parametrize("period", [thorough("10 um"), "100 mm"])
def test_a_fingertip_on_a_texture_of_a_hard_period_renders(period: str) -> None:
    scan, output = {"speed": "8 mm/s"}, {"duration": 0.05, "sample_rate": RATE}
    texture = {"period": period, "amplitude": "1 um"}
    values = rw.render({"finger": FINGERTIP, "texture": texture, "scan": scan, "output": output}).values
    assert np.isfinite(values).all()


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
    assert contact_of(parse_scene({**asked, "scan": {"load": "1 N", "speed": "20 mm/s"}})).grid is contact.grid
    for other in ({"finger": {"kind": "fingertip", "seed": 1}}, {"texture": {"period": "1.6 mm"}}):
        assert contact_of(parse_scene({**asked, **other})).grid is not contact.grid
