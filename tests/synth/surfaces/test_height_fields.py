"""Height fields: heights, bounds and rms values of dots and of maps, against sums over fine lattices."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from synth.errors import SceneError
from synth.scene.scene import parse_scene
from synth.scene.texture_registry import kinds
from synth.surfaces import profile_of
from synth.surfaces.dots import Dots
from synth.surfaces.height_field import HeightField
from synth.surfaces.measured_area import ENDS, MeasuredArea
from synth.surfaces.self_affine_area import SelfAffineArea
from synth.surfaces.surface_data import SurfaceData, remember
from synth.surfaces.weave import UP, Weave

SEEDS = range(4)


def random_dots(seed: int) -> Dots:
    random = np.random.default_rng([20, seed])
    period, rows = random.uniform(0.5e-3, 3e-3, 2)
    stagger = [0.0, 0.5, float(random.uniform(0.2, 0.8))][seed % 3]
    diameter = float(random.uniform(0.3, 0.95)) * min(period, rows)
    height = float(random.uniform(-50e-6, 50e-6))
    return Dots(period, rows, stagger, height, diameter, float(random.uniform(0.0, 0.8)) * diameter, 1.0)


def random_map(seed: int, ends: str) -> MeasuredArea:
    random = np.random.default_rng([21, seed])
    heights = random.normal(0.0, 10e-6, (int(random.integers(2, 9)), int(random.integers(2, 12)))).astype(np.float32)
    return MeasuredArea(SurfaceData(heights, (20e-6, 35e-6)), ends, 0.7)


def random_rough(seed: int) -> SelfAffineArea:
    random = np.random.default_rng([22, seed])
    period, across, hurst = random.uniform(1e-3, 2e-3), random.uniform(1e-3, 2e-3), float(random.uniform(0.0, 1.0))
    return SelfAffineArea(period, across, hurst, 10e-6, None, 0.9e-3, 0.1e-3, seed, 0.7, 1.0)


def random_weave(seed: int) -> Weave:
    random = np.random.default_rng([23, seed])
    period, across = random.uniform(0.5e-3, 3e-3, 2)
    height, width = (float(random.uniform(*ends)) for ends in ((10e-6, 300e-6), (0.3, 1.0)))
    return Weave(period, across, list(UP)[seed % len(UP)], height, width, 1.0)


def fields() -> list[HeightField]:
    maps = [random_map(seed, ends) for seed in SEEDS for ends in ENDS]
    return [*map(random_dots, SEEDS), *maps, *map(random_rough, SEEDS), *map(random_weave, SEEDS)]


def test_every_kind_over_an_area_has_a_field_here() -> None:
    assert {field.kind for field in fields()} == {kind.name for kind in kinds().values() if kind.of_area}


@pytest.mark.parametrize("number", range(len(fields())))
def test_a_field_keeps_its_mean_bounds_rms_and_periods(number: int) -> None:
    field = fields()[number]
    nx, ny = 1260, 630
    x = np.asarray((np.arange(nx) + 0.5) * (field.period / nx), np.float64)
    y = np.asarray((np.arange(ny) + 0.5) * (field.across / ny), np.float64)
    h = field.area(x, y)
    low, high, steepest, _curvature = field.bounds
    rough, scale = 3e-3, high - low
    assert abs(h.mean()) < 1e-3 * scale
    assert low - 1e-12 <= h.min() and h.max() <= high + 1e-12 and h.max() - h.min() > 0.9 * scale
    along = np.diff(h, axis=1) / (field.period / nx)
    assert np.abs(along).max() <= steepest * (1.0 + 1e-6) and np.abs(along).max() > 0.9 * steepest
    assert np.abs(np.diff(h, axis=0)).max() / (field.across / ny) <= field.slope_across * (1.0 + 1e-6)
    assert field.rms[0] == pytest.approx(h.std(), rel=rough)
    assert field.rms[1] == pytest.approx(math.sqrt(np.mean(along**2)), rel=4.0 * rough)
    assert np.allclose(field.area(x + field.period, y - 2.0 * field.across), h, rtol=0.0, atol=1e-6 * scale)
    assert np.array_equal(field.heights(x), field.area(x, np.zeros(1))[0])
    assert np.allclose(field.lattice(x, y), h, rtol=0.0, atol=1e-6 * scale)


@pytest.mark.parametrize("stagger", [0.0, 0.5])
def test_dots_stand_where_they_should(stagger: float) -> None:
    dots = Dots(2e-3, 1.5e-3, stagger, 40e-6, 1e-3, 0.4e-3)
    tops = dots.area(np.array([0.0, 2e-3, -4e-3]), np.array([0.0, 3e-3]))
    assert np.allclose(tops, dots.bounds.highest)
    moved = dots.area(np.array([0.0, 1e-3]), np.array([1.5e-3]))[0]
    assert np.allclose(moved[::-1] if stagger else moved, [dots.bounds.highest, dots.bounds.lowest])
    half = dots.area(np.array([0.35e-3]), np.zeros(1))[0, 0] - dots.bounds.lowest
    assert half == pytest.approx(20e-6)


def test_a_map_is_bilinear_and_its_mirror_has_no_steps() -> None:
    heights = np.array([[0.0, 1.0, 2.0], [4.0, 5.0, 9.0]], np.float32) * 1e-6
    field = MeasuredArea(SurfaceData(heights, (1e-4, 2e-4)), "mirror")
    assert field.period == pytest.approx(4e-4) and field.across == pytest.approx(4e-4)
    y = np.array([-1e-4, 0.0, 1e-4, 3e-4])  # the two rows stand at -0.1 and 0.1 mm
    found = field.area(np.array([0.0, 0.5e-4, 2e-4, 3e-4, 4e-4]), y) - field.area(np.zeros(1), np.array([-1e-4]))
    wanted = 1e-6 * np.array([[0, 0.5, 2, 1, 0], [2, 2.5, 5.5, 3, 2], [4, 4.5, 9, 5, 4], [0, 0.5, 2, 1, 0]])
    assert np.allclose(found, wanted, atol=1e-12)


@pytest.mark.parametrize(
    ("weave", "faces"), [("plain", 0.5), ("2/1 twill", 2 / 3), ("3/1 twill", 0.75), ("sateen", 0.2)]
)
def test_threads_cross_as_their_weave_says(weave: str, faces: float) -> None:
    cloth = Weave(5e-3, 4e-3, weave, 60e-6, 0.6)
    x, y = (np.asarray(np.arange(cloth.threads) * (one / cloth.threads), np.float64) for one in (5e-3, 4e-3))
    gaps = cloth.area(x + 0.5 * x[1], y + 0.5 * y[1])
    assert np.allclose(gaps, cloth.bounds.lowest), "no thread covers the middle between four crossings"
    assert np.allclose(cloth.area(x, y), cloth.bounds.highest), "one of both threads is on top of a crossing"
    beside = cloth.area(x, y + 0.3 * y[1])  # at the side of the weft, where a warp thread on top is still high
    on_top = beside > cloth.bounds.lowest + 30e-6
    assert on_top.mean() == pytest.approx(faces)
    assert np.all(on_top.sum(axis=0) == on_top.sum(axis=0)[0]) and np.all(on_top.sum(axis=1) == on_top.sum(axis=1)[0])
    assert len(np.unique(on_top, axis=0)) == cloth.threads, "each weft thread has a pattern of its own"


@pytest.mark.parametrize(
    ("fields", "field", "words"),
    [
        ({"dot_diameter": "3 mm"}, "/texture/dot_diameter", "overlap"),
        ({"dot_diameter": "1 mm", "dot_top": "1 mm"}, "/texture/dot_top", "flank"),
        ({"dot_height": "2 mm"}, "/texture/dot_height", "1 mm"),
        ({"dot_diameter": "60 um", "dot_top": "59.9 um"}, "/texture/dot_height", "slope"),
        ({"stagger": 1.5}, "/texture/stagger", "1"),
        ({"amplitude": "10 um"}, "/texture/amplitude", "sinusoid"),
    ],
)
def test_dots_that_cannot_be_are_refused(fields: dict[str, Any], field: str, words: str) -> None:
    with pytest.raises(SceneError) as caught:
        parse_scene({"texture": {"kind": "dots", **fields}})
    fault = caught.value.faults[0]
    assert fault.pointer == field and words in fault.sentence()


def test_close_rows_may_be_staggered_more_tightly() -> None:
    scene = {"texture": {"kind": "dots", "period": "1 mm", "row_distance": "0.5 mm", "dot_diameter": "0.7 mm"}}
    with pytest.raises(SceneError, match="overlap"):
        parse_scene(scene)
    scene["texture"]["stagger"] = 0.5  # type: ignore[assignment]
    field = profile_of(parse_scene(scene))
    assert isinstance(field, Dots)
    h = field.area(np.linspace(0.0, 1e-3, 201), np.linspace(0.0, 1e-3, 201))
    assert h.max() == pytest.approx(field.bounds.highest, abs=1e-12)


MAP: dict[str, Any] = {"kind": "heightmap", "rows": [[0, "10 um", 0], ["20 um", 0, 0]], "spacing": "0.5 mm"}


def surface(heights: Any, spacing: tuple[float, ...] = (20e-6, 20e-6)) -> str:
    return remember(SurfaceData(np.asarray(heights, np.float32), spacing))


def test_a_map_in_a_scene_is_that_of_its_rows_and_reads_back() -> None:
    scene = parse_scene({"texture": {**MAP, "spacing_across": "0.25 mm", "phase": 0.0}})
    field = profile_of(scene)
    assert isinstance(field, MeasuredArea) and field.ends == "mirror"
    assert field.period == pytest.approx(2e-3) and field.across == pytest.approx(0.5e-3)
    corner = field.area(np.array([0.0, 0.5e-3]), np.array([-0.125e-3]))[0]
    assert np.diff(corner)[0] == pytest.approx(10e-6)
    assert parse_scene(scene.document()) == scene


def test_a_surface_is_named_by_its_content_and_brings_its_spacing() -> None:
    heights = np.random.default_rng(4).normal(0.0, 5e-6, (8, 8))
    address = surface(heights)
    scene = parse_scene({"texture": {"kind": "heightmap", "surface": address, "ends": "join"}})
    document = scene.document()["texture"]
    assert document["surface"] == address and "spacing" not in document and "rows" not in document
    assert parse_scene(scene.document()) == scene
    assert profile_of(scene).period == pytest.approx(160e-6)
    assert surface(heights) == address != surface(heights, (20e-6, 21e-6))


def test_a_profile_may_be_a_surface_and_may_be_mirrored() -> None:
    line = surface(np.linspace(0.0, 50e-6, 6), (100e-6,))
    with pytest.raises(SceneError, match="mirror"):
        parse_scene({"texture": {"kind": "profile", "heights": [0, 1e-4, 2e-4, 3e-4], "spacing": "10 um"}})
    field = profile_of(parse_scene({"texture": {"kind": "profile", "surface": line, "ends": "mirror", "phase": 0.0}}))
    assert field.period == pytest.approx(1e-3)
    found = field.heights(np.array([0.0, 0.25e-3, 0.5e-3, 0.75e-3, 1e-3]))
    assert np.allclose(found - found[0], [0.0, 25e-6, 50e-6, 25e-6, 0.0], atol=1e-9)


@pytest.mark.parametrize(
    ("texture", "field", "words"),
    [
        ({"kind": "heightmap"}, "rows", "import"),
        ({"kind": "heightmap", "surface": "0" * 64}, "surface", "known"),
        ({"kind": "heightmap", "surface": "../map"}, "surface", "64 hexadecimal"),
        ({**MAP, "surface": "0" * 64}, "rows", "own heights"),
        ({**MAP, "rows": [[0, 0], [0]]}, "rows", "2 rows of 1 and 2"),
        ({**MAP, "rows": [[0, "5 cm"], [0, 0]]}, "rows/0/1", "10 mm"),
        ({**MAP, "rows": [[0, math.nan], [0, 0]]}, "rows/0/1", "10 mm"),
        ({**MAP, "rows": [[0], [0]]}, "rows", "2 or more rows"),
        ({**MAP, "rows": "map.npy"}, "rows", "Write rows"),
        ({**MAP, "rows": [[0, "1 mm"], [0, 0]], "spacing": "1 um"}, "rows", "steepest slope"),
        ({**MAP, "spacing": "100 mm", "rows": [[0.0] * 20] * 2}, "spacing", "periods"),
        ({**MAP, "ends": "stop"}, "ends", "join"),
        ({**MAP, "amplitude": "1 um"}, "amplitude", "sinusoid"),
    ],
)
def test_maps_that_cannot_be_are_refused(texture: dict[str, Any], field: str, words: str) -> None:
    with pytest.raises(SceneError) as caught:
        parse_scene({"texture": texture})
    told = [fault for fault in caught.value.faults if fault.pointer == f"/texture/{field}"]
    assert told and any(words in fault.sentence() for fault in told), caught.value.faults


@pytest.mark.parametrize("weave", ["plain", "2/1 twill", "3/1 twill", "sateen"])
@pytest.mark.parametrize("width", [1.0, 0.77, 0.2])
def test_the_moments_of_a_weave_are_exact(weave: str, width: float) -> None:
    """Heights and two-sided slopes at places that are no multiples of a thread: a crease is missed by few of them."""
    field = Weave(0.9e-3, 1.4e-3, weave, 50e-6, width, 0.3)
    count, step = 401 * field.threads, 1e-10
    x = (np.arange(count) + 0.382) / count * field.period
    y = np.arange(count // 2) / (count // 2) * field.across
    heights = field.area(x, y)
    slopes = (field.area(x + step, y) - field.area(x - step, y)) / (2.0 * step)
    assert abs(np.mean(heights)) <= 1e-5 * field.height
    found = math.sqrt(float(np.mean(heights**2))), math.sqrt(float(np.mean(slopes**2)))
    assert field.rms == pytest.approx(found, rel=1e-4)
