"""The sampled solver: exact for its polygon, second order in the points, and bounded in iterations."""

from __future__ import annotations

import numpy as np
import pytest

from synth.contact.baseline import BrentqGrid
from synth.contact.exact import Grid
from synth.contact.geometry import Geometry
from synth.contact.phase_solver import PhaseSolver
from synth.contact.sampled import MOST_STEPS, SampledGrid
from synth.contact.stiffness import Stiffness
from tests.synth.engine_cases import random_document, scene_of

PHASES = np.arange(64) / 64


def grids(points: float, **sections: dict[str, object]) -> tuple[SampledGrid, BrentqGrid, Grid, float]:
    """Return the three solvers of a scene, and its indentation (m)."""
    scene = scene_of(**sections)
    geometry = Geometry.of_scene(scene)
    solvers = SampledGrid.of_geometry(geometry, points), BrentqGrid.of_geometry(geometry, points)
    return *solvers, Grid.of_geometry(geometry), Stiffness.of_scene(scene).indentation(scene.scan.load)


def polygon_area(heights: np.ndarray, z: float) -> float:
    """Return the mean of max(h - z, 0) over a polygon, by cutting every piece where it crosses z."""
    area = 0.0
    for p, q in zip(heights[:-1] - z, heights[1:] - z, strict=True):
        if p >= 0.0 and q >= 0.0:
            area += 0.5 * (p + q)
        elif p > 0.0 or q > 0.0:
            area += 0.5 * max(p, q) ** 2 / abs(p - q)
    return area / (len(heights) - 1)


@pytest.mark.parametrize("seed", range(12))
def test_the_area_above_z_is_that_of_the_polygon(seed: int) -> None:
    document = random_document(np.random.default_rng(seed), 48000)
    scene = scene_of(**{name: document[name] for name in ("finger", "texture", "scan")})
    geometry, pressed = Geometry.of_scene(scene), Stiffness.of_scene(scene).indentation(scene.scan.load)
    points = SampledGrid.of_geometry(geometry, 16)
    found = points.solve(PHASES, pressed)
    x = np.linspace(0.0, geometry.contact_length, points.cells + 1)
    for phase, z in zip(PHASES[::7], found.height[::7], strict=True):
        angle = 2.0 * np.pi * (x / geometry.texture_period - phase) + geometry.texture_phase
        heights = geometry.texture_amplitude * np.cos(angle)
        heights -= geometry.ridge_amplitude * np.cos(2.0 * np.pi * x / geometry.ridge_period)
        assert polygon_area(heights, z) == pytest.approx(pressed, abs=2e-12 * geometry.height_scale)


def test_twice_the_points_leave_a_quarter_of_the_error() -> None:
    errors = []
    for points in (32, 64, 128, 256):
        sampled, _baseline, exact, pressed = grids(points)
        errors.append(np.max(np.abs(sampled.solve(PHASES, pressed).height - exact.solve(PHASES, pressed).height)))
    assert np.array(errors[:-1]) / errors[1:] == pytest.approx([4.0] * 3, rel=0.15)


def test_the_baseline_comes_near_and_nearer() -> None:
    errors = []
    for points in (25, 100, 400):
        _sampled, baseline, exact, pressed = grids(points)
        height = exact.solve(PHASES[::8], pressed).height
        errors.append(np.max(np.abs(baseline.solve(PHASES[::8], pressed).height - height)))
    assert errors[0] > 8 * errors[1] > 64 * errors[2] > 0


@pytest.mark.parametrize("load", [0.0, 1e-9, 1e-3, 0.3, 30.0, 1e3])
@pytest.mark.parametrize("length", ["10 um", "0.2 mm", "10 mm"])
def test_any_load_is_solved_in_few_steps(load: float, length: str) -> None:
    sampled, _baseline, exact, pressed = grids(512, scan={"load": load}, finger={"contact_length": length})
    found, wanted = sampled.solve(PHASES, pressed), exact.solve(PHASES, pressed)
    assert found.iterations.max() < MOST_STEPS
    deep = 4e-15 * np.max(np.abs(wanted.height))
    assert np.max(np.abs(found.height - wanted.height)) <= 1e-3 * exact.height_scale + deep


def test_each_phase_may_have_its_own_load() -> None:
    solvers: list[PhaseSolver] = list(grids(32)[:3])
    pressed = np.linspace(0.0, 2e-6, 9)
    for solver in solvers:
        together = solver.solve(PHASES[:9], pressed).height
        apart = [solver.solve(PHASES[i : i + 1], float(pressed[i])).height[0] for i in range(9)]
        assert together == pytest.approx(apart, abs=1e-12 * 60e-6)
