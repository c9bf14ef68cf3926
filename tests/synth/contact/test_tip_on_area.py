"""A probe over an area, against the integral over its paraboloid and the stiffness of eqs 4-5, written out anew."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from synth.contact.area_path import heights_along
from synth.contact.scene_contact import contact_of
from synth.contact.tip_on_area import TipOnArea
from synth.errors import SceneError
from synth.scene.scene import parse_scene
from synth.surfaces.dots import Dots
from tests.few import thorough
from tests.reference import area_oracle

RIDGE_PERIOD = 0.5e-3  # m: what eq. 5 takes for a probe (docs/scene.md)
MODULUS, POISSON = 3e9, 0.37  # of a probe by default
DOTS = {
    "period": "1.2 mm",
    "row_distance": "1 mm",
    "dot_height": "30 um",
    "dot_diameter": "0.9 mm",
    "dot_top": "0.3 mm",
}
POINTS = 1500  # along and across a tip
WAVES = (12e-6 * np.cos(2.0 * np.pi * np.arange(64) / 64)).tolist()
SPACING = 12.5e-6


def probe(radius: float, texture: dict[str, Any], load: float = 0.3) -> TipOnArea:
    """Return the contact of a probe over an area."""
    found = contact_of(
        parse_scene({"finger": {"kind": "probe", "tip_radius": radius}, "texture": texture, "scan": {"load": load}})
    )
    assert isinstance(found, TipOnArea)
    return found


def pressed_volume(radius: float, amplitude: float, period: float, load: float) -> float:
    """Return w / K (m^3): the pressure of a point is K times its depth, and K = k / L^2 of a cylinder of length L.

    amplitude, period: of the sinusoid that stands for the texture in eqs 4-5, m.
    """
    modulus = MODULUS / (1.0 - POISSON**2)
    shared = 2.0 * RIDGE_PERIOD * period / (RIDGE_PERIOD + period)
    ridge_radius = 1.0 / (4.0 * math.pi**2 * amplitude / period**2)

    def stiffness(length: float) -> float:
        half_width = math.sqrt(4.0 * load * shared / length**2 * ridge_radius / (math.pi * modulus))
        return 1.18 * modulus * length**2 / half_width

    def unbalanced(half: float) -> float:
        return (2.0 / 3.0) * stiffness(2.0 * half) / (2.0 * half) * half**3 / radius - load

    length = 2.0 * float(brentq(unbalanced, 1e-9, 0.1, xtol=1e-18))
    return load * length**2 / stiffness(length)


def approach(heights: Any, radius: float, reach: float, middle: tuple[float, float], volume: float) -> float:
    """Return z (m) of a paraboloid over many points.

    heights: of the texture (m) at x and y (m).
    reach: half the width of what may touch, m.
    middle: place of the tip on the texture, m.
    """
    part = ((np.arange(POINTS) + 0.5) / POINTS - 0.5) * 2.0 * reach
    x, y = np.meshgrid(part, part)
    h = heights(x + middle[0], y + middle[1]) - (x**2 + y**2) / (2.0 * radius)
    cell, top = (2.0 * reach / POINTS) ** 2, float(h.max())
    return float(
        brentq(lambda z: cell * float(np.sum(np.clip(h - z, 0.0, None))) - volume, top - 1e-3, top, xtol=1e-16)
    )


@pytest.mark.parametrize("load", [0.05, 0.3, 1.8])
def test_the_indentation_is_that_of_the_equations(load: float) -> None:
    found = probe(1e-3, {"kind": "dots", **DOTS})
    texture = found.geometry.profile
    assert texture is not None
    wanted = pressed_volume(1e-3, texture.equivalent().amplitude, texture.equivalent().period, load)
    assert found.indentation(load) * found.width_at(load) ** 2 == pytest.approx(wanted, rel=1e-9)
    assert found.indentations(np.array([load])) == pytest.approx([found.indentation(load)], rel=1e-12)
    assert found.stiffness_at(load) * found.indentation(load) == pytest.approx(load)
    step = 1e-4 * load
    slope = (found.approach(np.zeros(1), load + step)[0] - found.approach(np.zeros(1), load - step)[0]) / (2.0 * step)
    assert found.approach(np.zeros(1), load)[1] == pytest.approx(slope, rel=2e-2)


@pytest.mark.parametrize("seed", [0, *(thorough(seed) for seed in range(1, 12))])
def test_z_on_dots_is_that_of_brute_force_at_any_direction(seed: int) -> None:
    random = np.random.default_rng([7, seed])
    radius, load = float(10.0 ** random.uniform(-3.3, -2.3)), float(10.0 ** random.uniform(-1.7, 0.3))
    found = probe(radius, {"kind": "dots", **DOTS})
    texture = found.geometry.profile
    assert isinstance(texture, Dots)
    volume = pressed_volume(radius, texture.equivalent().amplitude, texture.equivalent().period, load)
    heights = area_oracle.dots(1.2e-3, 1e-3, 0.0, 30e-6, 0.9e-3, 0.3e-3, texture.phase)
    places = random.uniform(-2e-3, 2e-3, (6, 2))
    wanted = [
        approach(heights, radius, 0.5 * found.span, (0.5 * radius - along, -across), volume) for along, across in places
    ]
    path = np.stack([places[:, 1], random.uniform(-3.0, 3.0, 6)])
    level = texture.heights(np.zeros(1)) - heights(np.zeros(1), np.zeros(1))
    finer = found.halved()
    assert finer is not None
    for one, most in ((found, 1e-3), (finer, 4e-4)):
        z = heights_along(one, places[:, 0] / texture.period, np.full(6, load), path)
        assert np.max(np.abs(z - level - wanted)) < most * 30e-6


@pytest.mark.parametrize("radius", [1e-3, 5e-3])
@pytest.mark.parametrize("load", [0.02, 0.3, 1.8])
def test_on_a_map_that_is_constant_across_it_is_the_sum_over_strips(radius: float, load: float) -> None:
    texture = {"kind": "heightmap", "rows": [WAVES] * 3, "spacing": SPACING, "ends": "join", "phase": 0.0}
    found, phases = probe(radius, texture), np.arange(16) / 16
    equal = contact_of(parse_scene({"texture": texture})).geometry.equivalent
    volume = pressed_volume(radius, *equal, load)
    x = np.linspace(-0.5 * found.span, 0.5 * found.span, 20_001)
    wanted = []
    for phase in phases:
        places = ((x + 0.5 * radius) / SPACING - 64 * phase) % 64
        h = np.interp(places, np.arange(65), [*WAVES, WAVES[0]]) - x**2 / (2.0 * radius)
        strips = [4.0 / 3.0 * math.sqrt(2.0 * radius), 1.5]

        def unbalanced(z: float, h: Any = h, strips: Any = strips) -> float:
            return float(np.trapezoid(strips[0] * np.clip(h - z, 0.0, None) ** strips[1], x)) - volume

        wanted.append(brentq(unbalanced, h.max() - 1e-3, h.max(), xtol=1e-17))
    z = found.heights(phases, np.full(16, load))
    assert np.max(np.abs(z - wanted)) < 1e-4 * np.ptp(wanted)


@pytest.mark.parametrize("load", [0.02, 0.3, 1.8])
def test_along_a_line_a_probe_is_a_cylinder_and_moves_nearly_as_the_tip(load: float) -> None:
    rows = {"kind": "heightmap", "rows": [WAVES] * 3, "ends": "join"}
    line = {"finger": {"kind": "probe"}, "texture": {"kind": "profile", "heights": WAVES, "spacing": SPACING}}
    tip, phases, loads = probe(1e-3, rows | {"spacing": SPACING}), np.arange(64) / 64, np.full(64, load)
    along = contact_of(parse_scene(line)).heights(phases, loads)
    over = tip.heights(phases, loads)
    assert np.ptp(along - over) < 0.01 * np.ptp(over)
    assert np.max(np.abs(along - over)) < 0.05 * np.ptp(over)


def test_a_plate_is_touched_over_nearly_the_square_of_a_line() -> None:
    """On a wave far longer than the tip, about its crest."""
    wave = (10e-6 * np.cos(2.0 * np.pi * np.arange(200) / 200)).tolist()
    texture = {"kind": "heightmap", "rows": [wave] * 3, "spacing": "1 mm", "ends": "join", "phase": 0.0}
    found, load = probe(1e-3, texture), 0.3
    crest = np.full(1, 0.5 * found.geometry.contact_length / 0.2)
    touching = found.grid.solve(crest, found.indentation(load)).touching * 1e-6
    length = found.tip.length_at(load)
    assert touching / length**2 == pytest.approx(math.pi / 4.0 * math.sqrt(16.0 / (3.0 * math.pi)), rel=2e-3)


def test_a_tip_that_is_too_flat_is_refused() -> None:
    finger = {"kind": "probe", "tip_radius": 0.1, "youngs_modulus": "1 kPa"}
    with pytest.raises(SceneError, match="touches within"):
        contact_of(parse_scene({"finger": finger, "texture": {"kind": "dots"}, "scan": {"load": 1e3}}))
