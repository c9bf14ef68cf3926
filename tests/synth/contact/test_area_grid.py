"""Fingers on height fields: z against brute force over the points, with the texture computed anew."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import ridgewave as rw
from synth.contact.area_contact import CombOnArea
from synth.contact.area_grid import AreaGrid
from synth.contact.area_solver import WIDE, highest_tops
from synth.contact.area_texture import crests_of
from synth.contact.fingertip import FingertipContact
from synth.contact.footprint import Footprint
from synth.contact.geometry import Geometry
from synth.contact.scene_contact import contact_of
from synth.contact.stiffness import Stiffness
from synth.errors import SceneError
from synth.scene.scene import parse_scene
from synth.surfaces import profile_of
from synth.surfaces.height_field import HeightField
from synth.surfaces.measured_area import MeasuredArea
from synth.surfaces.sinusoid import Sinusoid
from synth.surfaces.surface_data import SurfaceData
from tests.few import thorough
from tests.reference import area_oracle
from tests.synth.contact.area_points import points_of
from tests.synth.engine_cases import Real

SMALL = {"contact_length": "1.5 mm"}
LEVELS, SMALLER_LEVELS = 4e-3, 1.5e-3  # of the texture's height: errors with cells of the usual size and half as large


def random_case(seed: int) -> tuple[FingertipContact | CombOnArea, HeightField, Any, float]:
    """Return a random finger on random dots or a random map, the oracle's heights, and a load (N)."""
    random = np.random.default_rng([22, seed])
    finger: dict[str, Any] = {**SMALL, "ridge_amplitude": float(random.uniform(0.0, 50e-6))}
    if seed % 2:
        finger |= {"kind": "fingertip", "seed": seed}
    load = float(10.0 ** random.uniform(-1.5, 0.5))
    if seed % 3:
        period, rows = random.uniform(0.5e-3, 2e-3, 2).tolist()
        diameter, top = 0.8 * min(period, rows), 0.2 * min(period, rows)
        height, stagger = float(random.uniform(-40e-6, 40e-6)), float(random.choice([0.0, 0.5]))
        texture = {"kind": "dots", "period": period, "row_distance": rows, "dot_height": height, "stagger": stagger}
        sizes = {"dot_diameter": diameter, "dot_top": top}
        scene = parse_scene({"finger": finger, "texture": {**texture, **sizes}})
        field = profile_of(scene)
        heights = area_oracle.dots(period, rows, stagger, height, diameter, top, scene.texture.phase)
    else:
        scene, ends, spacing = parse_scene({"finger": finger}), ("join", "mirror")[seed % 2], (150e-6, 200e-6)
        values = random.normal(0.0, 10e-6, (12, 16)).astype(np.float32)
        field = MeasuredArea(SurfaceData(values, spacing), ends, 0.4)
        heights = area_oracle.bilinear(values.astype(float), spacing, ends, 0.4)
    assert isinstance(field, HeightField)
    return on_field(scene, field), field, heights, load


def on_field(scene: Any, field: HeightField) -> FingertipContact | CombOnArea:
    """Return the contact of the finger of `scene` on `field`."""
    if profile_of(scene) == field:
        found = contact_of(scene)
        assert isinstance(found, FingertipContact | CombOnArea)
        return found
    contact, geometry = contact_of(scene), Geometry.of_surfaces(scene.finger, field)
    if isinstance(contact, FingertipContact):
        return contact.on(geometry)
    return CombOnArea(geometry, Stiffness.of_contact(geometry, contact.stiffness.contact_modulus))


@pytest.mark.parametrize("seed", [*range(4), *(thorough(seed) for seed in range(4, 50))])
def test_z_is_that_of_brute_force_over_the_points(seed: int) -> None:
    contact, field, heights, load = random_case(seed)
    x, y, h1, share = points_of(contact)
    random = np.random.default_rng(seed)
    path = np.stack([random.uniform(0.0, 2.0 * field.period, 4), np.zeros(4)], axis=1)
    z = area_oracle.approach(x, y, h1, share, heights, path, contact.indentation(load))
    tall = field.extent[1] - field.extent[0]
    moved = field.area(path[:2, 0], np.zeros(1))[0] - heights(path[:2, 0], np.zeros(2))
    assert np.ptp(moved) < 1e-6 * tall  # the oracle's heights are about another level
    smaller = contact.halved()
    assert smaller is not None
    for one, most in ((contact, LEVELS), (smaller, SMALLER_LEVELS)):
        found = one.approach(path[:, 0] / field.period, load)[0]
        assert np.max(np.abs(found - z - moved[0])) < most * tall


def test_z_at_any_place_of_the_area_and_at_no_load() -> None:
    contact, field, heights, load = random_case(1)
    grid = contact.grid
    assert isinstance(grid, AreaGrid)
    x, y, h1, share = points_of(contact)
    path = np.random.default_rng(3).uniform(-2.0, 2.0, (8, 2)) * [field.period, field.across]
    turns = path / [field.period, field.across]
    wanted = area_oracle.approach(x, y, h1, share, heights, path, contact.indentation(load))
    found = grid.solve_places(turns[:, 0], turns[:, 1], contact.indentation(load)).height
    tall = field.extent[1] - field.extent[0]
    assert np.ptp(found - wanted) < LEVELS * tall
    lifted = grid.solve_places(turns[:, 0], turns[:, 1], 0.0)
    light = grid.solve_places(turns[:, 0], turns[:, 1], 1e-16)
    assert np.all(lifted.touching == 0.0) and np.all(lifted.height >= light.height)
    assert np.max(lifted.height - light.height) < 2e-3 * grid.height_scale


def test_z_does_not_depend_on_where_the_solver_starts() -> None:
    contact, field, _heights, load = random_case(1)
    phases = np.sort(np.random.default_rng(5).uniform(0.0, 1.0, 200))
    there = contact.approach(phases, load)[0]
    back = contact.approach(phases[::-1].copy(), load)[0][::-1]
    far = contact.approach(phases, load, np.full(200, field.extent[0] - 1e-3))[0]
    assert np.max(np.abs(there - back)) < 1e-11 * contact.scale_at(load)
    assert np.max(np.abs(there - far)) < 1e-11 * contact.scale_at(load)


def test_a_place_that_is_not_finite_is_refused() -> None:
    grid = random_case(1)[0].grid
    assert isinstance(grid, AreaGrid)
    for wrong in (math.nan, math.inf):
        with pytest.raises(ValueError, match="finite"):
            grid.solve_places(np.array([0.1, wrong]), np.zeros(2), 1e-6)
        with pytest.raises(ValueError, match="finite"):
            grid.solve_places(np.zeros(2), np.array([wrong, 0.1]), 1e-6)


def test_the_measured_force_is_that_of_the_solution() -> None:
    contact, _field, _heights, load = random_case(1)
    phases = np.random.default_rng(5).uniform(0.0, 1.0, 20)
    z, slope = contact.approach(phases, load)
    depth, touching = contact.measure(phases, z, load)
    assert np.allclose(depth, contact.indentation(load), rtol=1e-6)
    assert np.allclose(slope, -1.5 * contact.indentation(load) / load / touching, rtol=1e-6)
    near = contact.approach(phases, load * (1.0 + 1e-3))[0]
    assert np.allclose((near - z) / (1e-3 * load), slope, rtol=2e-2)


@pytest.mark.parametrize("finger", [{}, {"kind": "fingertip"}])
def test_a_map_that_is_constant_across_is_its_profile(finger: dict[str, Any]) -> None:
    """The same sinusoid as one line, solved by another solver, and as a map of 64 columns."""
    size = {"contact_length": "3 mm"}
    scene = parse_scene({"finger": {**finger, **size}, "texture": {"period": "0.8 mm", "amplitude": "20 um"}})
    line = contact_of(scene)
    period, columns = 0.8e-3, 64
    sinusoid = Sinusoid(20e-6, period, scene.texture.phase)
    heights = np.tile(sinusoid.heights(np.arange(columns) * period / columns), (4, 1)).astype(np.float32)
    area = on_field(scene, MeasuredArea(SurfaceData(heights, (period / columns, 1e-3)), "join"))
    phases = np.arange(64) / 64
    for load in (0.1, 1.0):
        wanted, found = line.approach(phases, load)[0], area.approach(phases, load)[0]
        assert np.ptp(found - wanted) < 2e-2 * np.ptp(wanted)  # the points of a fingertip lie elsewhere in both


@pytest.mark.parametrize("finger", [{}, {"kind": "fingertip"}])
def test_a_finger_that_stands_aside_touches_what_lies_there(finger: dict[str, Any]) -> None:
    """At y it is the finger at y = 0 on a map whose rows are moved by y."""
    spacing, rows = 0.25e-3, np.random.default_rng(8).normal(0.0, 10e-6, (13, 12))

    def z(heights: Real, y: float) -> Real:
        texture = {"kind": "heightmap", "rows": heights.tolist(), "spacing": spacing, "ends": "join"}
        scene = parse_scene({"finger": {**finger, "contact_length": "2 mm"}, "texture": texture, "scan": {"y": y}})
        return contact_of(scene).approach(np.arange(16) / 16, 0.5)[0]

    aside, straight = z(rows, 3 * spacing), z(rows, 0.0)
    assert np.ptp(aside - z(np.roll(rows, -3, axis=0), 0.0)) < 1e-3 * np.ptp(aside)
    assert np.ptp(aside - straight) > 0.1 * np.ptp(aside)


@pytest.mark.parametrize("finger", [{}, {"kind": "fingertip"}])
def test_dots_render_to_a_file_live_and_to_a_table(finger: dict[str, Any]) -> None:
    scene: dict[str, Any] = {
        "finger": {**finger, **SMALL},
        "texture": {"kind": "dots", "period": "1 mm"},
        "output": {"duration": 0.1, "sample_rate": 8000, "quantity": "velocity"},
    }
    sound = rw.render(scene)
    assert sound.values.any() and np.isfinite(sound.values).all()
    contact: Any = contact_of(parse_scene(scene))
    contact = contact.halved().halved()  # as the file has
    count, turns = 1024, 80.0
    series = np.fft.rfft(contact.approach(np.arange(count) / count, 0.3)[0])[: math.ceil(1000.0 / turns)] / count
    n = np.arange(1, len(series))
    times = np.arange(len(sound.values)) / 8000
    wanted = 2.0 * (np.exp(2j * math.pi * turns * np.outer(times, n)) @ (2j * math.pi * turns * n * series[1:])).real
    assert np.max(np.abs(sound.values[:, 0] - wanted)) < 3e-3 * np.ptp(wanted)
    voice = rw.open_voice(scene, live=True)
    motion = rw.Motion.of(800, speed=0.08, load=0.3)
    live = voice.render(800, motion)[-100:, 0] * voice.full_scale[0]
    assert np.ptp(live) == pytest.approx(np.ptp(wanted), rel=0.05)


def test_the_footprint_of_a_fingertip_is_the_same_on_a_line_and_on_an_area() -> None:
    line = contact_of(parse_scene({"finger": {"kind": "fingertip", **SMALL}}))
    area = contact_of(parse_scene({"finger": {"kind": "fingertip", **SMALL}, "texture": {"kind": "dots"}}))
    assert isinstance(line, FingertipContact) and isinstance(area, FingertipContact)
    assert isinstance(line.footprint, Footprint) and line.footprint == area.footprint


@pytest.mark.parametrize("places", [(1, 1), (4, 2)])
def test_a_crest_is_at_least_the_highest_top_that_a_block_can_meet(places: tuple[int, int]) -> None:
    """Against the mean and the slopes of the bilinear surface, at random places."""
    random, (finer_x, finer_y), (rows, span) = np.random.default_rng(3), places, (7, 3 * WIDE)
    stored = random.normal(size=(finer_y, finer_x, rows, span)).astype(np.float32)
    shape = np.array([rows, finer_x, finer_y, rows * span, span], dtype=np.int64)
    tops = np.empty((rows, span), np.float32)
    highest_tops(stored.ravel(), shape, tops)
    crests, fine = crests_of(tops), stored.transpose(2, 0, 3, 1).reshape(rows * finer_y, span * finer_x).astype(float)
    for _ in range(300):
        y, x = float(random.uniform(0.0, rows * finer_y)), float(random.uniform(0.0, (2 * WIDE - 2) * finer_x))
        i, j, met = int(x), int(y), []
        for column in i + finer_x * np.arange(WIDE):
            (a, b), (c, d) = (fine[row, column : column + 2] for row in (j, (j + 1) % len(fine)))
            u, v = x - i, y - j
            below, above = a + u * (b - a), c + u * (d - c)
            slopes = finer_x * ((1 - v) * (b - a) + v * (d - c)), finer_y * (above - below)
            met.append(below + v * (above - below) + 0.5 * np.hypot(*slopes))
        assert max(met) <= crests[j // finer_y, i // finer_x] + 1e-5


@pytest.mark.parametrize("kind", ["comb", "fingertip"])
def test_rows_closer_than_the_points_may_be_are_felt_through_their_mean(kind: str) -> None:
    rows = [[0.0, 1e-5, 0.0, 1e-5], [0.0, 1e-5, 0.0, 0.0]]
    texture = {"kind": "heightmap", "rows": rows, "spacing": 1e-4, "spacing_across": 5e-7}
    grid = contact_of(parse_scene({"finger": {"kind": kind, "contact_length": "30 mm"}, "texture": texture})).grid
    assert isinstance(grid, AreaGrid) and len(grid.tops) * WIDE <= 2**21  # whole blocks
    z = [grid.solve_places(np.array([0.2]), np.array([across]), 1e-5).height[0] for across in (0.0, 0.3, 0.7)]
    np.testing.assert_allclose(z, z[0], rtol=1e-6)


@pytest.mark.parametrize("finger", [{"contact_length": 1e-5}, {"kind": "fingertip", "ridge_period": 1e-5}])
def test_a_texture_that_does_not_fit_into_memory_at_the_points_of_the_finger_is_refused(finger: Any) -> None:
    large = {"kind": "dots", "period": "0.2 m", "row_distance": "0.1 m"}
    texture = {**large, "dot_diameter": "20 um", "dot_height": "1 um"}
    with pytest.raises(SceneError, match=r"longer finger\.contact_length"):
        _ = contact_of(parse_scene({"finger": finger, "texture": texture})).grid
