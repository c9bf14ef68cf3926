"""Fingers that move and turn over a height field, against a print drawn anew, brute force and symmetry."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from synth.contact.area_contact import CombOnArea
from synth.contact.area_grid import AreaGrid
from synth.contact.area_path import OVERLAP, TURN_STEP, coarsened, heights_along
from synth.contact.area_solver import BEFORE
from synth.contact.fingertip import FingertipContact
from synth.contact.scene_contact import contact_of
from synth.response_cache import PARTS
from synth.scene.scene import parse_scene
from synth.surfaces.dots import Dots
from synth.surfaces.measured_area import MeasuredArea
from synth.surfaces.surface_data import SurfaceData
from tests.few import thorough
from tests.reference import area_oracle
from tests.synth.contact.area_points import cells_drawn_anew, points_of
from tests.synth.contact.test_area_grid import on_field

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


@pytest.mark.parametrize("kind", ["fingertip", "comb"])
@pytest.mark.parametrize("seed", [0, *(thorough(seed) for seed in range(1, 12))])
def test_z_of_a_turned_finger_is_that_of_brute_force(kind: str, seed: int) -> None:
    random = np.random.default_rng([31, seed])
    found, load = contact(kind, stagger=float(random.choice([0.0, 0.5]))), float(10.0 ** random.uniform(-1.0, 0.3))
    direction = float(random.uniform(-3.0, 3.0))
    texture = texture_of(found)
    x, y, h1, share = points_of(found, direction)
    heights = area_oracle.dots(1.5e-3, 1.5e-3, texture.stagger, 40e-6, 1.2e-3, 0.3e-3, texture.phase)
    places = random.uniform(-2.0, 2.0, (3, 2)) * [texture.period, texture.across]
    wanted = area_oracle.approach(x, y, h1, share, heights, places, found.indentation(load))
    path = np.stack([places[:, 1], np.full(3, direction)])
    got = heights_along(found, places[:, 0] / texture.period, np.full(3, load), path)
    turns = np.arange(48) / 48  # the few places of the oracle may be nearly equally high
    across = np.stack([0.4 * turns * texture.across, np.full(48, direction)])
    extent = np.ptp(heights_along(found, turns, np.full(48, load), across))
    assert np.ptp(got - wanted) < min(LEVELS * 40e-6, 0.1 * extent)


def test_the_cells_of_a_turned_finger_have_the_means_of_the_print_drawn_anew() -> None:
    for kind in ("fingertip", "comb"):
        found = contact(kind)
        straight = None
        for direction in (0.0, -2.0):
            grid = found.grid_at(direction)
            x, _y, h1, share = cells_drawn_anew(found, direction)
            kept = grid.finger[:, 0][grid.finger[:, 0] > -1e20] * grid.height_scale
            errors = np.abs(kept - h1.mean(axis=1)) / found.geometry.ridge_amplitude
            assert np.sqrt(np.mean(errors**2)) < 1e-3 and np.max(errors) < 1e-2
            area = float(np.sum(grid.shares)) * grid.cell
            if kind == "comb":
                assert area == pytest.approx(1.0)
            else:
                straight = straight or x.size * share
                assert x.size * share == pytest.approx(straight, rel=0.03)


@pytest.mark.parametrize("kind", ["fingertip", "comb"])
def test_turning_finger_and_path_by_a_right_angle_changes_nothing_on_square_dots(kind: str) -> None:
    found, load = contact(kind), 0.05 if kind == "comb" else 0.3  # all of the comb touches at 0.3 N
    texture, random = texture_of(found), np.random.default_rng(5)
    middle = 0.0 if kind == "fingertip" else 0.5 * found.geometry.contact_length
    place = random.uniform(-1e-3, 1e-3, (40, 2))  # of the middle of the finger on the surface
    turned = np.stack([-place[:, 1], place[:, 0]], axis=1)

    def z(places: Any, direction: float) -> Any:
        path = np.stack([-places[:, 1], np.full(40, direction)])
        shift = middle - places[:, 0] + texture.phase / (2 * np.pi) * texture.period
        return heights_along(found, shift / texture.period, np.full(40, load), path)

    assert texture.phase != 0.0
    straight, round_ = z(place, 0.0), z(turned, 0.5 * math.pi)
    changed = np.ptp(straight - round_)  # the lattice lies otherwise on so few ridges, and on the edges of a comb
    assert changed < (0.05 if kind == "comb" else 0.005) * np.ptp(straight)
    assert np.ptp(z(turned, 0.0) - straight) > 5.0 * changed


def test_a_finger_that_turns_slowly_moves_without_a_step() -> None:
    """Over two directions of its cells, a hundredth of a degree at a time."""
    found, count = contact("fingertip"), 200
    path = np.stack([np.full(count, 0.2e-3), TURN_STEP * (100.0 + np.linspace(0.0, 2.0, count))])
    z = heights_along(found, np.full(count, 0.3), np.full(count, 0.4), path)
    places = np.random.default_rng(3).uniform(size=(2, 50))
    extent = np.ptp(heights_along(found, places[0], np.full(50, 0.4), np.stack([places[1] * 1.5e-3, path[1, :50]])))
    assert np.ptp(z) > 0.0
    assert np.max(np.abs(np.diff(z))) < 1.2e-4 * extent  # without the overlap it is seven times as much
    assert len(heights_along(found, np.zeros(0), np.zeros(0), path[:, :0])) == 0


@pytest.mark.parametrize("kind", ["fingertip", "comb"])
def test_between_two_directions_z_errs_by_little_of_its_peak_to_peak(kind: str) -> None:
    found = contact(kind)
    random = np.random.default_rng(2)
    phases, loads, across = random.random(60), np.full(60, 0.4), random.random(60) * 1e-3
    for one, most in ((found, 0.01), (coarsened(found, 1.5), 0.03)):
        for part in (0.2, 0.44):
            direction = (10.0 + part) * TURN_STEP
            between = heights_along(one, phases, loads, np.stack([across, np.full(60, direction)]))
            grid = one.grid_at(direction)
            assert isinstance(grid, AreaGrid)
            exact = grid.solve_places(phases, across / 1.5e-3, one.indentation(0.4)).height
            assert np.max(np.abs(between - exact)) < most * np.ptp(exact)


def test_blocks_stay_on_the_stored_texture_as_a_finger_turns() -> None:
    """Also where the cells are much shorter than they are wide: only the far ones are then clipped."""
    heights = np.zeros((4, 512), np.float32)
    heights[:, ::2] = 1e-6
    scene = parse_scene({"finger": {"kind": "fingertip", "contact_length": "8 mm"}})
    found = on_field(scene, MeasuredArea(SurfaceData(heights, (20e-6, 2e-3)), "join"))
    assert isinstance(found, FingertipContact)
    for grid in (found.grid_at(0.0), found.grid_at(1.0)):
        moved = 0.5 * (1.0 + OVERLAP) * TURN_STEP * np.abs(grid.arms[:-1, 0])
        assert np.max(moved) < BEFORE - 1


def test_a_line_of_the_scan_is_a_place_of_the_path() -> None:
    load, phases = np.full(20, 0.3), np.linspace(0.0, 1.0, 20)
    found, middle = contact("fingertip", {"y": "0.3 mm", "direction": "20 deg"}), contact("fingertip")
    line = found.heights(phases, load)
    path = np.stack([np.full(20, -0.3e-3), np.full(20, math.radians(20.0))])
    assert found.heights(phases, load, path) - line == pytest.approx(np.full(20, 0.0), abs=1e-12)
    assert middle.heights(phases, load, path) - line == pytest.approx(np.full(20, 0.0), abs=1e-9)
    assert np.ptp(middle.heights(phases, load) - line) > 1e-7


def test_a_hand_that_trembles_makes_no_cells_again_even_where_the_cache_has_no_room(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(PARTS, "max_bytes", 0)
    found, made = contact("fingertip", period="1.47 mm"), list[float]()
    monkeypatch.setattr(FingertipContact, "grid_at", spied(FingertipContact.grid_at, made))
    directions = TURN_STEP * np.array([0.0, 0.5, 1.0, 0.4, 0.1, 0.5, 0.9])
    z = [z_at(found, direction) for direction in directions]
    assert len(made) == 1
    PARTS.resize(1 << 27)
    assert [z_at(contact("fingertip", period="1.47 mm"), direction) for direction in directions] == z


def spied(method: Callable[..., AreaGrid], made: list[float]) -> Callable[..., AreaGrid]:
    """Return `method`, which adds the direction of each call to `made`."""

    def grid_at(self: FingertipContact, direction: float) -> AreaGrid:
        made.append(direction)
        return method(self, direction)

    return grid_at


def z_at(found: FingertipContact | CombOnArea, direction: float) -> float:
    """Return z (m) at one place and direction (rad)."""
    return float(heights_along(found, np.array([0.3]), np.array([0.4]), np.array([[1e-4], [direction]]))[0])
