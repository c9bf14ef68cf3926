"""Combs and fingertips that are turned on a texture along a line, against sums over points of their own."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from synth.contact.area_contact import CombOnArea
from synth.contact.area_path import heights_along
from synth.contact.fingertip import FingertipContact
from synth.contact.scene_contact import contact_of
from synth.scene.scene import parse_scene
from synth.surfaces import profile_of
from synth.surfaces.grooves import Grooves
from tests.few import thorough
from tests.reference import area_oracle
from tests.reference.fingertip_oracle import Print

SMALL = {"contact_length": "2.2 mm", "ridge_amplitude": "60 um"}
WAVE = {"kind": "sinusoid", "period": "0.9 mm", "amplitude": "15 um", "phase": 0.0}
ALONG_A_FINGERTIP = 700  # points along and across


def turned(kind: str, direction: float = 0.5, texture: dict[str, Any] | None = None) -> CombOnArea | FingertipContact:
    """Return a small finger that is turned on a wave."""
    finger = {"kind": kind, **SMALL} | ({"seed": 3} if kind == "fingertip" else {})
    found = contact_of(parse_scene({"finger": finger, "texture": texture or WAVE, "scan": {"direction": direction}}))
    assert isinstance(found, CombOnArea | FingertipContact)
    return found


def points(
    found: CombOnArea | FingertipContact, direction: float, count: int = ALONG_A_FINGERTIP
) -> tuple[Any, Any, Any, float]:
    """Return x, y and height (m) of points of the turned finger, and the area of one over A0.

    count: points along and across a fingertip.
    """
    ridges = found.geometry
    if isinstance(found, CombOnArea):
        return area_oracle.comb(ridges.contact_length, ridges.ridge_amplitude, ridges.ridge_period, direction, 0.0)
    foot, own = found.footprint, found.field
    spreads = own.spacing_spread, own.direction_spread, own.height_spread
    parts = ((np.arange(count) + 0.5) / count - 0.5) * 2.0
    u, v = np.repeat(parts * foot.length, len(parts)), np.tile(parts * foot.width, len(parts))
    there = (u / foot.length) ** 2 + (v / foot.width) ** 2 < 1.0
    u, v = u[there], v[there]
    heights = Print(own.period, own.amplitude, own.pattern, *spreads, own.seed).heights(u, v)
    heights -= foot.depth * ((2.0 * u / foot.length) ** 2 + (2.0 * v / foot.width) ** 2)
    place = (u + 1j * v) * np.exp(1j * direction)
    return place.real, place.imag, heights, 4.0 / count**2


@pytest.mark.parametrize("kind", ["comb", "fingertip"])
@pytest.mark.parametrize("seed", [0, 1, *(thorough(seed) for seed in range(2, 12))])
def test_z_is_that_of_brute_force_at_any_direction_and_place(kind: str, seed: int) -> None:
    random = np.random.default_rng([17, seed])
    load, direction = float(10.0 ** random.uniform(-1.3, 0.3)), float(random.uniform(-3.0, 3.0))
    found = turned(kind)
    places = random.uniform(-2e-3, 2e-3, (4, 2))
    wanted = area_oracle.approach(
        *points(found, direction),
        lambda x, _y: np.asarray(15e-6 * np.cos(2.0 * np.pi * x / 0.9e-3)),
        places,
        found.indentation(load),
    )
    path = np.stack([places[:, 1], np.full(4, direction)])
    finer = found.halved()
    assert finer is not None
    for one, most in ((found, 6e-3), (finer, 2e-3)):
        z = heights_along(one, places[:, 0] / 0.9e-3, np.full(4, load), path)
        assert np.max(np.abs(z - wanted)) < most * 30e-6


@pytest.mark.parametrize("kind", ["comb", "fingertip"])
def test_without_a_turn_it_is_the_contact_along_the_line(kind: str) -> None:
    found, phases, loads = turned(kind), np.arange(40) / 40, np.full(40, 0.1)
    finger = {"kind": kind, **SMALL} | ({"seed": 3} if kind == "fingertip" else {})
    line = contact_of(parse_scene({"finger": finger, "texture": WAVE})).heights(phases, loads)
    path = np.stack([np.linspace(0.0, 5e-3, 40), np.zeros(40)])
    finer = found.halved()
    assert finer is not None
    errors = [np.max(np.abs(one.heights(phases, loads, path) - line)) for one in (found, finer)]
    assert errors[0] < 6e-3 * 30e-6
    assert errors[1] < 0.5 * errors[0]


@pytest.mark.parametrize("kind", ["comb", "fingertip"])
def test_the_place_across_changes_nothing(kind: str) -> None:
    found, phases, loads = turned(kind), np.arange(40) / 40, np.full(40, 0.1)
    z = [
        found.heights(phases, loads, np.stack([across, np.full(40, 0.7)]))
        for across in (np.zeros(40), np.linspace(-0.3, 0.7, 40))
    ]
    assert np.max(np.abs(z[0] - z[1])) < 1e-9 * 30e-6


def test_one_row_of_the_texture_is_stored() -> None:
    for texture in (WAVE, {"kind": "rough"}, {"kind": "grating"}):
        grid = turned("comb", texture=texture).grid
        rows, _finer_x, finer_y, *_rest = grid.texture.shape.tolist()  # type: ignore[attr-defined]
        assert (rows, finer_y) == (1, 1)


def test_the_grooves_are_the_profile() -> None:
    plain = profile_of(parse_scene({"texture": {"kind": "grating"}}))
    field = profile_of(parse_scene({"texture": {"kind": "grating"}, "scan": {"direction": 0.2}}))
    assert isinstance(field, Grooves) and field.profile == plain
    x, y = np.linspace(-1e-3, 3e-3, 50), np.linspace(0.0, 1e-2, 3)
    assert np.array_equal(field.area(x, y), np.stack([plain.heights(x)] * 3))
    assert np.array_equal(field.heights(x), plain.heights(x))
    assert (field.bounds, field.rms, field.period) == (plain.bounds, plain.rms, plain.period)
    assert field.equivalent() == plain.equivalent() and field != plain
