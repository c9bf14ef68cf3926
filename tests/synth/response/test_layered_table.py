"""Layered tables: z at any place of an area and any load, against brute force over all points."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import pytest

from synth.contact.area_layers import LayerPlan
from synth.contact.load_balance import Contact
from synth.contact.scene_contact import contact_of
from synth.response.layered_cost import (
    LAYERED_BOUNDS,
    LayeredBounds,
    LayeredCost,
    grid_of,
    layered_cost,
    levels_of,
)
from synth.response.layered_making import make_layered_table, spline_through
from synth.response.layered_table import LayeredTable
from synth.scene.scene import parse_scene
from synth.surfaces.height_field import HeightField
from synth.surfaces.measured_area import MeasuredArea
from synth.surfaces.surface_data import SurfaceData
from tests.few import thorough
from tests.reference import layered_oracle
from tests.synth.contact.test_area_grid import on_field, random_case

FINGERS = {
    "fingertip": {"kind": "fingertip", "contact_length": "3 mm"},
    "comb": {"contact_length": "2 mm"},
    "smooth": {"kind": "fingertip", "contact_length": "3 mm", "ridge_amplitude": 0},
}
DOTS = {"kind": "dots", "period": "1.3 mm", "row_distance": "1 mm", "dot_diameter": "0.6 mm", "dot_top": "0.2 mm"}
CASES = [
    ("fingertip", "dots"),
    ("fingertip", "self-affine"),
    ("fingertip", "steps"),
    ("fingertip", "constant across"),
    ("comb", "dots"),
    thorough("smooth", "self-affine"),
]


def self_affine(count: int, spacing: float, seed: int = 1) -> Any:
    """Return a random map [count, count] (m) with a Hurst exponent of 0.8 and Rq 10 um."""
    random = np.random.default_rng(seed)
    waves = np.hypot(np.fft.fftfreq(count, spacing)[:, np.newaxis], np.fft.rfftfreq(count, spacing))
    sizes = np.where((waves > 0.6e3) & (waves < 5e3), np.maximum(waves, 1.0) ** -1.8, 0.0)
    heights = np.fft.irfft2(np.fft.rfft2(random.normal(size=(count, count))) * sizes, (count, count))
    return (heights * (10e-6 / heights.std())).astype(np.float32)


def field_of(kind: str) -> HeightField:
    """Return one of the height fields."""
    spacing = 50e-6, 50e-6
    heights = self_affine(60, spacing[0])
    if kind == "steps":
        heights = np.round(heights / 15e-6).astype(np.float32) * np.float32(10e-6)
    if kind == "constant across":
        heights, spacing = np.tile(heights[:1], (8, 1)), (50e-6, 200e-6)
    return MeasuredArea(SurfaceData(heights, spacing), "join")


@cache
def contact_for(finger: str, kind: str) -> Contact:
    """Return a finger on a height field."""
    scene = parse_scene({"finger": FINGERS[finger], **({"texture": DOTS} if kind == "dots" else {})})
    return contact_of(scene) if kind == "dots" else on_field(scene, field_of(kind))


@cache
def table_for(finger: str, kind: str) -> LayeredTable:
    """Return its table, with the usual bounds."""
    return make_layered_table(contact_for(finger, kind))


def random_places(count: int, seed: int) -> tuple[Any, Any, Any]:
    """Return phases, places across, and loads (N) between those of the first and last row."""
    random = np.random.default_rng(seed)
    return random.uniform(-1.0, 2.0, count), random.uniform(-1.0, 2.0, count), 10.0 ** random.uniform(-3, 0.69, count)


def parts_of_told(contact: Contact, table: LayeredTable, seed: int) -> Any:
    """Return the differences from the exact solver at 1,000 random places and loads, over those that are told."""
    phases, across, loads = random_places(1000, seed)
    exact = grid_of(contact).solve_places(phases, across, contact.indentations(loads)).height
    return np.abs(table.heights(phases, across, loads) - exact) / [table.error_at(load) for load in loads]


@pytest.mark.parametrize(("finger", "kind"), CASES)
def test_z_is_that_of_brute_force_within_the_told_error(finger: str, kind: str) -> None:
    contact, table = contact_for(finger, kind), table_for(finger, kind)
    phases, across, loads = random_places(10, 20)
    found, brute = table.heights(phases, across, loads), layered_oracle.BruteForce(grid_of(contact))
    for phase, beside, load, z in zip(phases, across, loads, found, strict=True):
        wanted = brute.approach(phase, beside, contact.indentation(load))
        assert abs(z - wanted) <= table.error_at(load)


@pytest.mark.parametrize(("finger", "kind"), CASES)
def test_the_bracket_holds(finger: str, kind: str) -> None:
    contact, table = contact_for(finger, kind), table_for(finger, kind)
    phases, across, loads = random_places(500, 21)
    found = table.heights(phases, across, loads)
    exact = grid_of(contact).solve_places(phases, across, contact.indentations(loads)).height
    for load, z, wanted in zip(loads, found, exact, strict=True):
        below, above = table.bracket_at(load)
        assert z - below <= wanted <= z + above


@pytest.mark.parametrize("seed", [0, *(thorough(seed) for seed in range(1, 40))])
def test_hardly_any_difference_is_larger_than_told_on_random_surfaces(seed: int) -> None:
    contact = random_case(seed)[0]
    table = make_layered_table(contact)
    parts = parts_of_told(contact, table, seed)
    assert np.mean(parts > 1.0) <= 2e-3 and np.max(parts) < 1.5


@pytest.mark.parametrize("kind", ["self-affine", "steps"])
def test_the_layers_alone_bound_z_at_the_rows(kind: str) -> None:
    """Also where the layers are so coarse that their error is far above that of the lattice."""
    contact = contact_for("fingertip", kind)
    step, _stride, lowest = levels_of(contact, LAYERED_BOUNDS)
    plan = LayerPlan.of(grid_of(contact), (216, 216), 3.0 * step, 1, lowest)
    table = make_layered_table(contact, cost=LayeredCost.of(grid_of(contact), plan, lowest, 24))
    phases, across, _loads = random_places(500, 22)
    misses = []
    for load, below, above in zip(table.loads[8:16], table.below[8:16], table.above[8:16], strict=True):
        found = table.heights(phases, across, np.full(500, load))
        exact = grid_of(contact).solve_places(phases, across, contact.indentation(load)).height
        assert np.all(found - below <= exact) and np.all(exact <= found + above)
        misses.append(np.max(np.abs(found - exact)) / min(below, above))
    assert max(misses) > 0.05  # the bounds are not much wider than needed


def test_the_error_falls_with_the_square_of_the_layers_or_faster() -> None:
    contact = contact_for("fingertip", "self-affine")
    grid, (step, _stride, lowest) = grid_of(contact), levels_of(contact, LAYERED_BOUNDS)
    phases, across, _loads = random_places(200, 23)
    errors = []
    for factor in (8.0, 4.0, 2.0):
        cost = LayeredCost.of(grid, LayerPlan.of(grid, (216, 216), factor * step, 1, lowest), lowest, 24)
        table = make_layered_table(contact, cost=cost)
        load = float(table.loads[12])
        exact = grid.solve_places(phases, across, contact.indentation(load)).height
        difference = table.heights(phases, across, np.full(200, load)) - exact
        errors.append(float(np.std(difference)))
    assert errors[1] < errors[0] / 3.0 and errors[2] < errors[1] / 2.0


def test_the_error_of_a_usual_fingertip_is_a_few_per_cent_of_the_motion() -> None:
    scene = parse_scene({"finger": {"kind": "fingertip"}})
    contact = on_field(scene, MeasuredArea(SurfaceData(self_affine(80, 50e-6), (50e-6, 50e-6)), "join"))
    table = make_layered_table(contact)
    usual = (table.loads[:-1] > 0.02) & (table.loads[:-1] < 2.0)
    assert np.max(table.errors[usual] / table.swings[1:][usual]) < 0.08


def test_a_map_that_is_constant_across_reads_the_same_at_every_y() -> None:
    table = table_for("fingertip", "constant across")
    phases, _across, loads = random_places(200, 24)
    found = [table.heights(phases, np.full(200, across), loads) for across in (0.0, 0.123, 0.5, 0.77)]
    assert np.max(np.ptp(found, axis=0)) < 1e-4 * table.swings.min()


def test_the_mean_is_that_over_the_area() -> None:
    table = table_for("fingertip", "self-affine")
    columns, rows = table.places
    x, y = np.meshgrid(np.arange(columns) / columns, np.arange(rows) / rows)
    for load in (0.01, 0.3, 4.0):
        found = table.heights(x.ravel(), y.ravel(), np.full(x.size, load))
        assert float(table.mean(np.array([load]))[0]) == pytest.approx(float(found.mean()), abs=1e-4 * np.ptp(found))


def test_the_reader_equals_its_twin_at_any_place_and_load() -> None:
    table = table_for("fingertip", "dots")
    phases, across, loads = random_places(200, 25)
    phases[:4], across[:4], loads[:6] = (
        [0.0, 1.0, -1e-18, 1e9],
        [1.0, 0.0, 5.0, -1e-18],
        [0.0, 1e-4, 5.0, 7.0, 1e3, 1e-3],
    )
    found = table.heights(phases, across, loads)
    wanted = [layered_oracle.read(table, *one) for one in zip(phases, across, loads, strict=True)]
    assert np.max(np.abs(found - wanted)) < 1e-9 * table.swings.max()


def test_what_is_not_a_number_stays_that_and_harms_nothing() -> None:
    table = table_for("fingertip", "dots")
    places = np.array([0.1, np.nan, np.inf, 0.1, 0.1])
    found = table.heights(places, np.roll(places, 1), np.array([0.3, 0.3, 0.3, np.inf, 0.3]))
    assert np.isnan(found[1:4]).all() and np.isfinite(found[[0, 4]]).all()
    with pytest.raises(ValueError, match="shapes"):
        table.heights(places, places[1:], places)
    with pytest.raises(ValueError, match="shapes"):
        table.heights(places.reshape(1, 5), places.reshape(1, 5), places.reshape(1, 5))


@pytest.mark.parametrize(
    "bounds",
    [
        LAYERED_BOUNDS,
        LayeredBounds(nbytes=300_000),
        LayeredBounds(seconds=0.45),
        LayeredBounds(rows=(8,), heaviest=1.0),
    ],
)
def test_memory_and_predicted_time_are_bounded(bounds: LayeredBounds) -> None:
    contact = contact_for("fingertip", "self-affine")
    cost = layered_cost(contact, bounds)
    assert cost.nbytes <= bounds.nbytes and cost.seconds <= bounds.seconds
    table = make_layered_table(contact, bounds, cost)
    assert table.coefficients.nbytes == cost.nbytes and table.memory_bytes < cost.nbytes + 5000
    assert table.places == cost.plan.places
    assert len(table.loads) == cost.rows in bounds.rows and table.loads[-1] == pytest.approx(bounds.heaviest)


def test_the_error_of_a_coarse_lattice_is_told() -> None:
    contact = contact_for("fingertip", "self-affine")
    coarse = make_layered_table(contact, LayeredBounds(nbytes=70_000))
    assert max(coarse.places) <= 0.2 * max(table_for("fingertip", "self-affine").places)
    parts = parts_of_told(contact, coarse, 27)
    assert np.mean(parts > 1.0) <= 2e-3 and np.max(parts) < 1.5


def test_the_table_does_not_depend_on_the_workers() -> None:
    contact = contact_for("comb", "dots")
    one, two = table_for("comb", "dots"), make_layered_table(contact, workers=2)
    assert np.array_equal(one.coefficients, two.coefficients)
    for name in ("curve", "scales", "errors", "below", "above", "swings"):
        assert np.array_equal(getattr(one, name), getattr(two, name)), name


@pytest.mark.parametrize("count", [5, 24])
def test_the_spline_over_load_goes_through_its_values_and_keeps_cubics(count: int) -> None:
    values = np.random.default_rng(1).normal(size=(count, 3))
    c = spline_through(values)
    assert np.allclose((c[:-2] + 4.0 * c[1:-1] + c[2:]) / 6.0, values)
    cubics = np.asarray(np.arange(count) ** 3.0, np.float64)
    third = np.diff(spline_through(cubics), 3)
    assert np.allclose(third, 6.0)


def test_a_flat_map_moves_nothing() -> None:
    flat = on_field(
        parse_scene({"finger": FINGERS["fingertip"]}),
        MeasuredArea(SurfaceData(np.zeros((8, 8), np.float32), (50e-6, 50e-6)), "join"),
    )
    table = make_layered_table(flat)
    phases, across, loads = random_places(50, 26)
    assert np.max(np.abs(table.heights(phases, across, loads) - table.mean(loads))) < 1e-5 * 50e-6
    assert math.isfinite(table.error_at(0.3)) and all(map(math.isfinite, table.bracket_at(0.3)))
