"""The solver of any profile: exact for its polyline, and within its stated error for the profile."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from synth.contact.exact_solver import Grid
from synth.contact.geometry import Geometry
from synth.contact.load_balance import Contact
from synth.contact.profile_solver import SegmentGrid
from synth.contact.stiffness import Stiffness
from synth.response.demand import Demand
from synth.response.spectrum import solve_spectrum
from synth.scene.scene import Scene
from synth.surfaces.measured import MeasuredProfile
from synth.surfaces.sinusoid import Sinusoid
from tests.reference.slow_segments import heights_by_quadrature, slow_heights

LOADS = (0.003, 0.02, 0.3, 1.0, 5.0)
PHASES = np.sort(np.random.default_rng(1).random(40))


class UnknownSinusoid(Sinusoid):
    """A sinusoid that does not identify itself as one."""

    cosine = None  # type: ignore[assignment]


def both() -> tuple[Geometry, Geometry]:
    scene = Scene()
    texture = scene.texture
    known = Geometry.of_scene(scene)
    unknown = UnknownSinusoid(texture.amplitude, texture.period, texture.phase)
    return known, Geometry.of_surfaces(scene.finger, unknown)


def random_profile(rng: np.random.Generator, *, flats: bool) -> MeasuredProfile:
    count = int(rng.integers(2, 120))
    points = np.round(4.0 * rng.random(count)) * 5e-6 if flats else 2e-5 * rng.random(count)
    points[0] += 1e-6
    return MeasuredProfile(points, 10.0 ** rng.uniform(-4.0, -2.0) / count, float(rng.uniform(-10.0, 10.0)))


@pytest.mark.parametrize("load", LOADS)
def test_a_sinusoid_that_does_not_say_so_has_the_z_of_one_to_third_order(load: float) -> None:
    known, unknown = both()
    indentation = Stiffness.of_scene(Scene()).indentation(load)
    wanted = Grid.of_geometry(known).solve(PHASES, indentation).height
    errors = [
        float(np.max(np.abs(SegmentGrid.of_geometry(replace(unknown, segments=count)).solve(PHASES, indentation).height
                            - wanted)))
        for count in (410, 1640)
    ]  # fmt: skip
    assert errors[0] < 1e-4 * float(np.ptp(wanted))
    assert errors[1] < errors[0] / 16.0 + 1e-14


@pytest.mark.parametrize("flats", [False, True])
def test_the_kernel_is_its_slow_twin(flats: bool) -> None:
    rng = np.random.default_rng(7)
    for _ in range(1):
        profile = random_profile(rng, flats=flats)
        geometry = replace(Geometry.of_surfaces(Scene().finger, profile), segments=3 * len(profile.points))
        grid, indentation = SegmentGrid.of_geometry(geometry), 10.0 ** rng.uniform(-9.0, -4.5)
        phases = rng.random(2)
        found = grid.solve(phases, indentation)
        wanted = slow_heights(grid, geometry, phases, indentation)
        assert np.max(np.abs(found.height - wanted)) < 1e-11 * geometry.height_scale
        depth, touching = grid.measure(phases, found.height)
        assert np.max(np.abs(depth - indentation)) < 1e-13 * geometry.height_scale
        assert np.max(np.abs(touching - found.touching)) < 1e-6


@pytest.mark.parametrize("flats", [False, True])
def test_z_of_measured_heights_is_that_of_quadrature_on_them(flats: bool) -> None:
    rng = np.random.default_rng(8)
    for _ in range(2):
        profile = random_profile(rng, flats=flats)
        contact = Contact(Geometry.of_surfaces(Scene().finger, profile), Stiffness.of_scene(Scene()))
        load = 10.0 ** rng.uniform(-1.5, 0.7)
        spectrum = solve_spectrum(contact, load, Demand(32, (0,), 1e-3))
        wanted = heights_by_quadrature(contact.geometry, PHASES[::8], contact.indentation(load))
        fine = replace(contact.geometry, segments=int(spectrum.solver.split()[1]))
        found = SegmentGrid.of_geometry(fine).solve(PHASES[::8], contact.indentation(load)).height
        extent = float(
            np.ptp(SegmentGrid.of_geometry(fine).solve(np.arange(64) / 64, contact.indentation(load)).height)
        )
        assert np.max(np.abs(found - wanted)) < 1e-3 * extent + 1e-12


def test_no_load_is_the_highest_point() -> None:
    _known, unknown = both()
    grid = SegmentGrid.of_geometry(unknown)
    dense = np.linspace(0.0, unknown.contact_length, 200001)
    ridges = unknown.ridge_amplitude * np.cos(2.0 * np.pi * dense / unknown.ridge_period)
    top = [float(np.max(unknown.texture(dense - phase * unknown.texture_period) - ridges)) for phase in PHASES]
    assert np.max(np.abs(grid.solve(PHASES, 0.0).height - top)) < 1e-3 * grid.height_scale
