"""Fingers that move and turn over a height field, against a print drawn anew, brute force and symmetry."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from synth.contact.area_contact import CombOnArea
from synth.contact.area_grid import AreaGrid
from synth.contact.area_path import coarsened, heights_along, turn_step
from synth.contact.fingertip import FingertipContact
from synth.contact.scene_contact import contact_of
from synth.scene.scene import parse_scene
from synth.surfaces.dots import Dots
from tests.few import thorough
from tests.reference import area_oracle
from tests.reference.fingertip_oracle import Print

SMALL = {"contact_length": "2.2 mm", "ridge_amplitude": "60 um"}
DOTS = {
    "period": "1.5 mm",
    "row_distance": "1.5 mm",
    "dot_diameter": "1.2 mm",
    "dot_top": "0.3 mm",
    "dot_height": "40 um",
}
LEVELS = 3e-3  # of the texture's height: the error of its mean over a cell, here and in the oracle, beside its level


def contact(kind: str, scan: dict[str, Any] | None = None, **texture: Any) -> FingertipContact | CombOnArea:
    """Return a small finger on square dots."""
    finger = {"kind": kind, **SMALL} | ({"seed": 3} if kind == "fingertip" else {})
    found = contact_of(parse_scene({"finger": finger, "texture": {"kind": "dots", **DOTS, **texture}, "scan": scan}))
    assert isinstance(found, FingertipContact | CombOnArea)
    return found


def texture_of(found: FingertipContact | CombOnArea) -> Dots:
    """Return the dots under a finger."""
    assert isinstance(found.geometry.profile, Dots)
    return found.geometry.profile


def drawn(found: FingertipContact | CombOnArea, direction: float) -> tuple[Any, Any, Any, tuple[float, float], float]:
    """Return x, y and height (m) of every point of a turned finger, drawn anew, its cell (m) and A0 (m^2).

    The places are those of the solver; the heights are not.
    """
    grid, texture = found.grid_at(direction), texture_of(found)
    step = texture.period / grid.texture.columns, texture.across / grid.texture.shape[0]
    column = grid.starts[:, 1:] + np.arange(grid.heights.shape[1])
    row = np.repeat(grid.starts[:, :1], grid.heights.shape[1], axis=1)
    there = grid.heights > -1e20
    x = (grid.begin[0] * texture.period + column * step[0])[there]
    y = (grid.begin[1] * texture.across + row * step[1])[there]
    area = step[0] * step[1] / grid.cell
    middle = 0.0 if isinstance(found, FingertipContact) else 0.5 * found.geometry.contact_length
    turned = (x - middle + 1j * y) * np.exp(-1j * direction)  # in the frame of the finger
    u, v = turned.real, turned.imag
    if isinstance(found, FingertipContact):
        field, foot = found.field, found.footprint
        spreads = field.spacing_spread, field.direction_spread, field.height_spread
        ridges = Print(field.period, field.amplitude, field.pattern, *spreads, field.seed).heights(u, v)
        return x, y, ridges - foot.depth * ((2 * u / foot.length) ** 2 + (2 * v / foot.width) ** 2), step, area
    surfaces = found.geometry
    heights = -surfaces.ridge_amplitude * np.cos(2 * np.pi * (u + middle) / surfaces.ridge_period)
    return x, y, heights, step, area


@pytest.mark.parametrize("kind", ["fingertip", "comb"])
@pytest.mark.parametrize("seed", [0, *(thorough(seed) for seed in range(1, 12))])
def test_z_of_a_turned_finger_is_that_of_brute_force(kind: str, seed: int) -> None:
    random = np.random.default_rng([31, seed])
    found, load = contact(kind, stagger=float(random.choice([0.0, 0.5]))), float(10.0 ** random.uniform(-1.0, 0.3))
    direction = turn_step(found) * float(random.integers(-700, 700))
    texture = texture_of(found)
    x, y, h1, cell, area = drawn(found, direction)
    heights = area_oracle.dots(1.5e-3, 1.5e-3, texture.stagger, 40e-6, 1.2e-3, 0.3e-3, texture.phase)
    places = random.uniform(-2.0, 2.0, (4, 2)) * [texture.period, texture.across]
    wanted = area_oracle.approach(x, y, h1, cell, area, heights, places, found.indentation(load))
    path = np.stack([places[:, 1], np.full(4, direction)])
    got = heights_along(found, places[:, 0] / texture.period, np.full(4, load), path)
    assert np.ptp(got - wanted) < min(LEVELS * 40e-6, 0.1 * np.ptp(wanted))


def test_the_points_of_a_turned_finger_are_those_of_the_print_drawn_anew() -> None:
    for kind in ("fingertip", "comb"):
        found = contact(kind)
        for direction in (0.0, 0.7, -2.0, math.pi):
            grid = found.grid_at(direction)
            x, _y, h1, _cell, area = drawn(found, direction)
            kept = grid.heights[grid.heights > -1e20] * grid.height_scale
            assert np.max(np.abs(kept - h1)) < 2e-7 * np.max(np.abs(h1))  # float32
            assert len(x) * grid.cell == pytest.approx(len(drawn(found, 0.0)[0]) * found.grid_at(0.0).cell, rel=0.03)
            assert area == pytest.approx(drawn(found, 0.0)[4], rel=1e-9)


@pytest.mark.parametrize("kind", ["fingertip", "comb"])
def test_turning_finger_and_path_by_a_right_angle_changes_nothing_on_square_dots(kind: str) -> None:
    found = contact(kind)
    texture, random = texture_of(found), np.random.default_rng(5)
    middle = 0.0 if kind == "fingertip" else 0.5 * found.geometry.contact_length
    place = random.uniform(-1e-3, 1e-3, (40, 2))  # of the middle of the finger on the surface
    turned = np.stack([-place[:, 1], place[:, 0]], axis=1)

    def z(places: Any, direction: float) -> Any:
        path = np.stack([-places[:, 1], np.full(40, direction)])
        shift = middle - places[:, 0] + texture.phase / (2 * np.pi) * texture.period
        return heights_along(found, shift / texture.period, np.full(40, 0.3), path)

    assert texture.phase != 0.0
    straight, round_ = z(place, 0.0), z(turned, 0.5 * math.pi)
    changed = np.ptp(straight - round_)  # the lattice lies otherwise on so few ridges
    assert changed < 0.05 * np.ptp(straight)
    assert np.ptp(z(turned, 0.0) - straight) > 1.5 * changed


def test_between_two_directions_z_is_linear() -> None:
    found = contact("fingertip")
    step, count = turn_step(found), 9
    phases, loads = np.full(count, 0.3), np.full(count, 0.4)
    path = np.stack([np.full(count, 0.2e-3), step * (100.0 + np.linspace(0.0, 1.0, count))])
    z = heights_along(found, phases, loads, path)
    assert z == pytest.approx(np.linspace(z[0], z[-1], count), abs=1e-9 * abs(z[0]))
    assert z[0] != z[-1]
    assert len(heights_along(found, phases[:0], loads[:0], path[:, :0])) == 0


def test_halfway_between_two_directions_z_errs_by_little_of_its_peak_to_peak() -> None:
    found = contact("fingertip")
    random = np.random.default_rng(2)
    phases, loads, across = random.random(60), np.full(60, 0.4), random.random(60) * 1e-3
    for one, most in ((found, 0.01), (coarsened(found, 1.5), 0.06)):
        step = turn_step(one)
        between = heights_along(one, phases, loads, np.stack([across, np.full(60, 10.5 * step)]))
        grid = one.grid_at(10.5 * step)
        assert isinstance(grid, AreaGrid)
        exact = grid.solve_places(phases, across / 1.5e-3, one.indentation(0.4)).height
        assert np.max(np.abs(between - exact)) < most * np.ptp(exact)


def test_a_line_of_the_scan_is_a_place_of_the_path() -> None:
    load, phases = np.full(20, 0.3), np.linspace(0.0, 1.0, 20)
    found, middle = contact("fingertip", {"y": "0.3 mm", "direction": "20 deg"}), contact("fingertip")
    line = found.heights(phases, load)
    path = np.stack([np.full(20, -0.3e-3), np.full(20, math.radians(20.0))])
    assert found.heights(phases, load, path) - line == pytest.approx(np.full(20, 0.0), abs=1e-12)
    assert middle.heights(phases, load, path) - line == pytest.approx(np.full(20, 0.0), abs=1e-9)
    assert np.ptp(middle.heights(phases, load) - line) > 1e-7
