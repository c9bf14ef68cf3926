"""Maps that are continued below their pixel: the spectrum meets the map's own, and the slope is what was asked."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from synth.errors import InvalidRequest, SceneError
from synth.scene.scene import parse_scene
from synth.surfaces import profile_of
from synth.surfaces.continued import Continuation, synthetic_slope
from synth.surfaces.measured_area import MeasuredArea
from synth.surfaces.measurement.import_options import read_options
from synth.surfaces.measurement.import_report import ImportedSurface
from synth.surfaces.measurement.importing import import_surface
from synth.surfaces.surface_data import SurfaceData, remember
from tests.few import few
from tests.synth.surfaces.maps.map_sets import CASES, PIXEL, SIDE, WIDTH, Array, displacement, file_of, made, surface

SEEDS = range(10)
SHORTEST = 160e-6  # m
FINER = math.ceil(2.0 * PIXEL / SHORTEST)


def imported(seed: int, folder: Path, **options: Any) -> ImportedSurface:
    path = made(CASES["Poliigon, 16 bits, folder"], surface(seed, 0.5 + 0.05 * seed), folder)
    return import_surface(path, read_options({"width": WIDTH, "shortest": SHORTEST, **options}))


def area_of(found: ImportedSurface, **changes: Any) -> MeasuredArea:
    texture = {
        "kind": "heightmap",
        "surface": remember(found.surface),
        "phase": 0.0,
        **found.report["texture"],
        **changes,
    }
    area = profile_of(parse_scene({"texture": texture}))
    assert isinstance(area, MeasuredArea)
    return area


def on_points(area: MeasuredArea) -> Array:
    """Return the heights of one period at the points of the finer grid."""
    places = np.arange(SIDE * FINER, dtype=np.float64) * (PIXEL / FINER)
    return area.area(places, np.asarray(places - 0.5 * (WIDTH - PIXEL / FINER)))


def powers(heights: Array, step: float) -> tuple[Array, Array, Array]:
    """Return the power of each wave, and its wave numbers along x and y in those of the pixel of the map."""
    along, across = (np.fft.fftfreq(count, step) * 2.0 * PIXEL for count in heights.shape[::-1])
    power = np.abs(np.fft.fft2(heights) / heights.size) ** 2
    return power, *np.meshgrid(along, across)


def at_pixel(power: Array, q: Array, low: float, high: float) -> float:
    """Return the power (dB) at q = 1 of a power law through the waves from `low` to `high`."""
    edges, held = np.geomspace(low, high, 7), (q >= low) & (q < high)
    band = np.searchsorted(edges, q[held], "right")
    counts = np.maximum(np.bincount(band), 1)
    levels, places = (np.bincount(band, of) / counts for of in (power[held], np.log(q[held])))
    return float(10.0 / math.log(10.0) * np.polyfit(places[1:7], np.log(levels[1:7]), 1)[1])


def synthetic_only(area: MeasuredArea) -> Array:
    """Return the synthetic waves alone, m, at the points of the finer grid: those that the map cannot hold."""
    heights = on_points(area)
    _power, x, y = powers(heights, PIXEL / FINER)
    beyond = np.maximum(np.abs(x), np.abs(y)) > 1.0 + 1e-6
    return np.fft.ifft2(np.fft.fft2(heights) * beyond).real


@pytest.mark.parametrize("seed", few(SEEDS, 3))
def test_the_continued_spectrum_meets_that_of_the_map_at_the_wave_number_of_its_pixel(
    seed: int, tmp_path: Path
) -> None:
    found = imported(seed, tmp_path, hurst=0.3 + 0.07 * seed)
    power, x, y = powers(found.heights, PIXEL)
    own = at_pixel(power, np.hypot(x, y), 0.5, 1.0)
    power, x, y = powers(on_points(area_of(found, synthetic_seed=seed)), PIXEL / FINER)
    outside = np.maximum(np.abs(x), np.abs(y)) > 1.0 + 1e-6
    assert at_pixel(power[outside], np.hypot(x, y)[outside], 1.0, 3.0) == pytest.approx(own, abs=1.0)


@pytest.mark.parametrize("seed", few(SEEDS, 3))
def test_the_rms_slope_is_what_was_asked(seed: int, tmp_path: Path) -> None:
    """That of the surface as it is touched, bilinear between its points, sampled between them."""
    with pytest.raises(InvalidRequest) as refused:
        imported(seed, tmp_path, slope=4.99)
    low, high = (float(one) for one in str(refused.value).split("allowed: ")[1].split(" for ")[0].split(" to "))
    asked = low + (0.2 + 0.06 * seed) * (high - low)
    found = imported(seed, tmp_path, slope=asked)
    assert found.report["synthetic"]["rms_slope"] == pytest.approx(asked, rel=2e-3)
    area = area_of(found, synthetic_seed=seed)
    alone = MeasuredArea(SurfaceData(synthetic_only(area).astype(np.float32), area.data.spacing), "join")
    step, count = alone.data.spacing[0], 4 * len(alone.data.heights)
    x, y = (np.asarray(one) for one in (np.arange(count) * (step / 4.0), (np.arange(400) + 0.37) * (WIDTH / 400)))
    along, across = np.diff(alone.area(x, y), axis=1), np.diff(alone.area(y, x), axis=0)
    slope = math.sqrt(0.5 * (np.mean(along**2) + np.mean(across**2))) / (step / 4.0)
    assert slope == pytest.approx(asked, rel=0.05)


@pytest.mark.parametrize("ends", ["join", "mirror"])
def test_the_waves_of_the_map_stay_as_they_are(ends: str, tmp_path: Path) -> None:
    """Without its synthetic waves the finer grid is the map at each of its points, at the same place."""
    found = imported(1, tmp_path, hurst=0.6, **({} if ends == "join" else {"part": "60 mm"}))
    area, own = area_of(found), area_of(found, synthetic_hurst=None, synthetic_shortest=None, synthetic_seed=None)
    assert area.period == pytest.approx(own.period) and area.across == pytest.approx(own.across)
    heights = area.data.heights.astype(float)
    x, y = (np.fft.fftfreq(count, area.data.spacing[0]) * 2.0 * PIXEL for count in heights.shape[::-1])
    inside = np.maximum(np.abs(x), np.abs(y)[:, np.newaxis]) <= 1.0 + 1e-6
    alone = np.fft.ifft2(np.fft.fft2(heights) * inside).real.astype(np.float32)
    smooth = MeasuredArea(SurfaceData(alone, area.data.spacing), "join")
    places = np.arange(40, dtype=np.float64) * PIXEL
    rows = np.asarray(places - 0.5 * (own.data.heights.shape[0] - 1) * PIXEL)
    across = np.abs(smooth.area(places, rows) - own.area(places, rows))
    assert np.max(across) < 0.01 * own.rms[0]


SERIES: dict[str, Callable[[Array], Array]] = {
    "self-affine": lambda q: np.ones(q.shape),
    "nothing above 0.9": lambda q: q <= 0.9,
    "nothing above 0.5": lambda q: q <= 0.5,
    "gently blurred": lambda q: np.exp(-0.5 * q**2),
    "blurred": lambda q: np.exp(-1.5 * q**2),
    "strongly blurred": lambda q: np.exp(-4.0 * q**2),
}
"""Factors of the waves of a map by their wave numbers, in those of its pixel."""


def filtered(seed: int, factor: Callable[[Array], Array]) -> Array:
    """Return a map of 512 x 512 points whose waves have a factor, m."""
    heights = surface(seed, 0.5 + 0.1 * seed, side=512)
    q = 2.0 * np.hypot(np.fft.fftfreq(512), np.fft.fftfreq(512)[:, np.newaxis])
    return np.fft.ifft2(np.fft.fft2(heights) * factor(q)).real


@pytest.mark.parametrize("case", few(itertools.product(SERIES, range(4)), 1), ids=str)
def test_whole_part_and_mirrored_part_of_a_map_go_on_alike(case: tuple[str, int]) -> None:
    """Also where the finest waves of the map are absent, and mirroring puts others in their place."""
    kind, seed = case
    heights = filtered(seed, SERIES[kind]).astype(np.float32)
    middle = heights[194:319, 194:319]
    slopes = [
        synthetic_slope(SurfaceData(of, (PIXEL, PIXEL)), ends, Continuation(0.6))
        for of, ends in (
            (heights, "join"),
            (heights, "mirror"),
            (heights[128:384, 128:384], "mirror"),
            (middle, "mirror"),
        )
    ]
    assert 20.0 * np.log10(np.max(slopes) / np.min(slopes)) < 1.5


@pytest.mark.parametrize("limit", [0.9, 0.5])
def test_a_map_without_its_finest_waves_goes_on_as_the_whole_one_does(limit: float) -> None:
    """Within 3 dB: the law of its other waves reaches over the gap."""
    whole, cut = (
        synthetic_slope(SurfaceData(filtered(2, of).astype(np.float32), (PIXEL, PIXEL)), "join", Continuation(0.6))
        for of in (SERIES["self-affine"], SERIES[f"nothing above {limit}"])
    )
    assert abs(20.0 * np.log10(cut / whole)) < 3.0


def test_a_grating_gets_no_law_of_random_waves() -> None:
    place = np.arange(240) * 2.0 * np.pi / 12.0
    heights = 1e-4 * (np.sin(place) + np.cos(place)[:, np.newaxis])
    data = SurfaceData(heights.astype(np.float32), (PIXEL, PIXEL))
    assert synthetic_slope(data, "join", Continuation(0.6)) < 1e-6


def test_an_enlarged_map_is_told(tmp_path: Path) -> None:
    enlarged = Image.fromarray(surface(3).astype(np.float32)).resize((2 * SIDE, 2 * SIDE), Image.Resampling.BICUBIC)
    for name, heights, words in (("one", surface(3), None), ("two", np.asarray(enlarged, np.float64), "enlarged")):
        folder = tmp_path / name
        folder.mkdir()
        (folder / "a_disp.tif").write_bytes(file_of(displacement(heights, 16), "tif"))
        notes = import_surface(folder, read_options({"width": WIDTH, "height": "1 mm", "hurst": 0.6})).report["notes"]
        assert any("hardly any waves from" in one for one in notes) == (words is not None)


def test_the_same_seed_gives_the_same_surface_without_a_seam(tmp_path: Path) -> None:
    found = imported(2, tmp_path, hurst=0.5)
    one, two = on_points(area_of(found)), on_points(area_of(found, synthetic_seed=1))
    assert np.array_equal(one, on_points(area_of(found, synthetic_seed=0))) and not np.allclose(one, two)
    for axis in (0, 1):
        steps = np.sqrt(np.mean(np.diff(one, axis=axis, append=np.take(one, [0], axis)) ** 2, axis=1 - axis))
        assert steps[-1] < 1.3 * np.mean(steps) and steps[-1] > 0.7 * np.mean(steps)


def test_roughness_gives_the_slope_of_facets_from_the_pixel_down_to_a_micrometre(tmp_path: Path) -> None:
    """The sum of the squared slopes of a power law, wave by wave in rings, equals alpha^2 in two dimensions."""
    found = imported(3, tmp_path)
    waves = found.report["synthetic"]
    assert waves["source"] == "roughness map" and waves["alpha"] == pytest.approx(0.36, abs=1e-3)
    assert any("unverified default" in note and "upper bound" in note for note in found.report["notes"])
    power, x, y = powers(found.heights, PIXEL)
    level = 10.0 ** (0.1 * at_pixel(power, np.hypot(x, y), 0.5, 1.0))
    q = np.geomspace(math.pi / PIXEL, 2.0 * math.pi / 1e-6, 200_001)
    density = level * (q * PIXEL / math.pi) ** (-2.0 - 2.0 * waves["hurst"]) * (WIDTH / (2.0 * math.pi)) ** 2
    assert math.sqrt(np.trapezoid(density * q**2 * 2.0 * math.pi * q, q)) == pytest.approx(0.36, rel=0.02)


def test_what_the_user_gives_wins_over_the_roughness_map(tmp_path: Path) -> None:
    assert imported(4, tmp_path, hurst=0.9).report["synthetic"]["hurst"] == 0.9
    assert imported(4, tmp_path, slope=0).report["synthetic"] is None
    assert imported(4, tmp_path, slope=0).report["texture"] == {"ends": "join"}


def test_a_shortest_wave_that_the_map_itself_has_is_refused(tmp_path: Path) -> None:
    for shortest in ("1 mm", 2.0 * PIXEL):
        with pytest.raises(InvalidRequest, match=r"shortest: got .*; allowed: less than 625 um, two pixels"):
            imported(5, tmp_path, shortest=shortest)


def test_the_report_tells_the_slopes_that_can_be_asked(tmp_path: Path) -> None:
    (note,) = [one for one in imported(5, tmp_path).report["notes"] if "are synthetic" in one]
    for slope in note.split("it would be ")[1].removesuffix(" for this map").split(" to "):
        assert imported(5, tmp_path, slope=slope).report["synthetic"]["rms_slope"] == pytest.approx(float(slope), 0.01)


@pytest.mark.thorough
def test_a_surface_that_is_too_large_for_shorter_waves_tells_which_part_has_them(tmp_path: Path) -> None:
    path = made(CASES["Poliigon, 16 bits, folder"], surface(7), tmp_path)
    (note,) = [
        one for one in import_surface(path, read_options({"width": "1 m"})).report["notes"] if "too large" in one
    ]
    assert "to 60 um are missing" in note
    part = note.split("A part of ")[1].removesuffix(" has them")
    found = import_surface(path, read_options({"width": "1 m", "part": part})).report
    assert found["synthetic"]["shortest"] < 66e-6 and not any("too large" in one for one in found["notes"])


ROWS = [[0.0, 1e-5, 0.0, 4e-6], [2e-5, 0.0, 3e-6, 1e-6], [0.0, 0.0, 5e-6, 0.0]]


def test_a_scene_of_a_map_with_shorter_waves_is_that_of_the_map() -> None:
    fields = {"kind": "heightmap", "rows": ROWS, "ends": "join", "spacing": "20 um"}
    one, own = (profile_of(parse_scene({"texture": {**fields, **more}})) for more in ({"synthetic_hurst": 0.5}, {}))
    assert one.key == own.key


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"synthetic_hurst": 0.5, "spacing": "90 mm"}, "a shortest wave of 152.4 um at least for this map"),
        ({"synthetic_hurst": 1.5}, "0 to 1"),
    ],
)
def test_a_scene_refuses_waves_that_cannot_be(fields: dict[str, Any], words: str) -> None:
    with pytest.raises(SceneError) as refused:
        parse_scene({"texture": {"kind": "heightmap", "rows": ROWS, "ends": "join", **fields}})
    assert words in str(refused.value)
