"""Import: nothing is guessed, and what was found and done is reported in metres."""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from synth.errors import InvalidRequest
from synth.surfaces.measurement.import_options import read_options
from synth.surfaces.measurement.import_report import ImportedSurface
from synth.surfaces.measurement.importing import import_surface, levelled
from synth.surfaces.measurement.missing_points import filled, largest_whole_part
from synth.surfaces.measurement.relief_picture import relief_picture

RNG = np.random.default_rng(3)
GRID = RNG.normal(size=(6, 9))


def imported(path: Path, **options: Any) -> ImportedSurface:
    return import_surface(path, read_options(options))


def npy(folder: Path, values: Any) -> Path:
    path = folder / "scan.npy"
    np.save(path, np.asarray(values))
    return path


def test_report_of_a_sinusoid_in_closed_form(tmp_path: Path) -> None:
    x = np.arange(4000)
    path = npy(tmp_path, 20.0 * np.sin(2.0 * np.pi * x / 400))
    found = imported(path, unit="um", pixel="5 um")
    report = found.report
    assert report["kind"] == "profile" and report["points"] == [4000] and report["unit"] == "um"
    np.testing.assert_allclose(report["size"], [0.02])
    np.testing.assert_allclose(report["rq"], 20e-6 / np.sqrt(2.0), rtol=1e-12)
    np.testing.assert_allclose(report["ra"], 20e-6 * 2.0 / np.pi, rtol=1e-4)  # points of a period, not the integral
    np.testing.assert_allclose(report["peak_to_valley"], 40e-6, rtol=1e-9)
    np.testing.assert_allclose(report["rms_slope"], [2.0 * np.pi / 2e-3 * 20e-6 / np.sqrt(2.0)], rtol=3e-4)
    assert not any("tilted" in note for note in report["notes"])


def test_rq_and_ra_are_about_the_mean_of_a_surface_that_has_few_peaks(tmp_path: Path) -> None:
    """One point in four is 8 um high: the mean is 2 um, where the median is 0."""
    report = imported(npy(tmp_path, np.tile([0.0, 0.0, 0.0, 8.0], 100)), unit="um", pixel="5 um").report
    np.testing.assert_allclose([report["rq"], report["ra"]], [np.sqrt(12.0) * 1e-6, 3e-6], rtol=1e-12)


def test_the_kept_surface_is_about_its_mean_with_the_address_of_its_heights(tmp_path: Path) -> None:
    found = imported(npy(tmp_path, GRID + 100.0), unit="nm", pixel="5 um, 10 um")
    np.testing.assert_allclose(found.surface.heights, (GRID - GRID.mean()) * 1e-9, atol=1e-15)
    assert found.surface.spacing == (5e-6, 1e-5) and found.kind == "heightmap"
    again = imported(npy(tmp_path, GRID + 100.0), unit="nm", pixel=(5e-6))
    assert again.surface.address != found.surface.address


@pytest.mark.parametrize(
    ("options", "pointers"),
    [
        ({}, {"/pixel", "/unit"}),
        ({"unit": "um"}, {"/pixel"}),
        ({"unit": "um", "pixel": "5"}, {"/pixel"}),
        ({"unit": "furlong", "pixel": "5 kg", "level": "flat"}, {"/unit", "/pixel", "/level"}),
        ({"unit": "um", "pixel": "5 um", "height": "3 mm"}, {"/height"}),
        ({"unit": "um", "pixel": "1 um,1 um,1 um"}, {"/pixel"}),
        ({"unit": "um", "pixel": "5 um", "colour": "red"}, {"/colour"}),
        ({"unit": "um", "pixel": float("nan")}, {"/pixel"}),
    ],
)
def test_what_is_unknown_or_wrong_is_asked_for_all_at_once(
    tmp_path: Path, options: dict[str, Any], pointers: set[str]
) -> None:
    with pytest.raises(InvalidRequest) as refused:
        imported(npy(tmp_path, GRID), **options)
    assert {fault.pointer for fault in refused.value.faults} == pointers


@pytest.mark.parametrize("step", [1e-20, 1e9])
def test_a_spacing_that_nothing_has_is_refused(tmp_path: Path, step: float) -> None:
    path = tmp_path / "scan.csv"
    path.write_text(f"0 1\n{step} 2\n{2 * step} 3\n")
    with pytest.raises(InvalidRequest, match=re.escape(f"a spacing of {step:g} m")):
        imported(path, unit="m")


def test_a_displacement_map_has_no_height_until_one_is_given(tmp_path: Path) -> None:
    path = tmp_path / "map.png"
    Image.fromarray(np.array([[0, 65535], [32768, 0]], np.uint16)).save(path)
    with pytest.raises(InvalidRequest, match="no height of its own"):
        imported(path, pixel="5 um")
    assert imported(path, pixel="5 um", height="120 um").report["peak_to_valley"] == pytest.approx(120e-6)
    assert imported(path, pixel="5 um", unit="nm").report["peak_to_valley"] == pytest.approx(65535e-9)
    with pytest.raises(InvalidRequest, match="Leave out height or unit"):
        imported(path, pixel="5 um", unit="nm", height="120 um")


def test_what_the_file_states_is_not_replaced(tmp_path: Path) -> None:
    path = tmp_path / "scan.csv"
    path.write_text("0 1\n1 2\n2 4\n")
    with pytest.raises(InvalidRequest, match="the file states it"):
        imported(path, unit="um", pixel="5 um")
    tagged = tmp_path / "map.png"
    Image.fromarray(np.zeros((3, 3), np.uint16)).save(tagged, dpi=(5080, 5080))
    found = imported(tagged, pixel="7 um", height="1 mm")
    assert found.spacing == (7e-6, 7e-6) and any("resolution tag" in note for note in found.report["notes"])


def test_a_surface_that_scenes_refuse_is_told_in_the_report(tmp_path: Path) -> None:
    steep = npy(tmp_path, np.tile([0.0, 30.0], 40))
    notes = imported(steep, unit="um", pixel="1 um").report["notes"]
    assert any("A scene refuses it: slopes of 20 at most" in note for note in notes)
    assert not imported(steep, unit="um", pixel="100 um").report["notes"]


def test_missing_points_are_refused_filled_or_cropped(tmp_path: Path) -> None:
    plane = np.add.outer(2.0 * np.arange(8.0), 3.0 * np.arange(10.0))
    holed = plane.copy()
    holed[3, 4:6] = np.nan
    path = npy(tmp_path, holed)
    with pytest.raises(InvalidRequest, match=r"2 missing points \(2.5 %\)"):
        imported(path, unit="um", pixel="5 um")
    full = imported(path, unit="um", pixel="5 um", missing="fill")
    np.testing.assert_allclose(full.heights, (plane - plane.mean()) * 1e-6, atol=1e-18)
    assert full.report["missing"] == {"points": 2, "rule": "fill"}
    cut = imported(path, unit="um", pixel="5 um", missing="crop")
    np.testing.assert_allclose(np.diff(cut.heights, axis=1), 3e-6)
    assert cut.report["points"] == [10, 4]


def test_of_two_lines_over_a_gap_the_shorter_one_counts_more() -> None:
    heights, missing = np.ones((3, 11)), np.zeros((3, 11), bool)
    heights[1], missing[1, 1:-1] = 0.0, True  # a scratch: 10 steps from end to end at 0, 2 steps across at 1
    assert filled(heights, missing, (1.0, 1.0))[1] == pytest.approx([0.0, *[5.0 / 6.0] * 9, 0.0])
    assert filled(heights, missing, (1.0, 10.0))[1] == pytest.approx([0.0, *[1.0 / 3.0] * 9, 0.0])
    assert filled(heights.T, missing.T, (10.0, 1.0))[:, 1] == pytest.approx([0.0, *[1.0 / 3.0] * 9, 0.0])


def test_a_gap_is_filled_by_the_distances_of_the_file(tmp_path: Path) -> None:
    scratch = np.ones((3, 11))
    scratch[1], scratch[1, 1:-1] = 0.0, np.nan
    full = imported(npy(tmp_path, scratch), unit="um", pixel="1 um, 10 um", missing="fill")
    assert full.heights[1, 5] - full.heights[1, 0] == pytest.approx(1e-6 / 3.0)  # 10 um along the row, 20 um across it


def test_points_outside_every_line_take_their_nearest_neighbour() -> None:
    heights = np.array([[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]])
    missing = np.array([[True, False, False], [False, False, True]])
    close_columns, close_rows = filled(heights, missing, (1.0, 10.0)), filled(heights, missing, (10.0, 1.0))
    assert (close_columns[0, 0], close_columns[1, 2]) == (1.0, 4.0)
    assert (close_rows[0, 0], close_rows[1, 2]) == (3.0, 2.0)
    with pytest.raises(InvalidRequest, match="missing points"):
        filled(heights, np.array([[True] * 3, [True, False, False]]), (1.0, 1.0))


def test_the_largest_rectangle_is_that_of_a_search_over_all() -> None:
    for _ in range(40):
        missing = RNG.random((6, 7)) < 0.3
        areas = [
            (bottom - top) * (right - left)
            for top in range(6)
            for bottom in range(top + 1, 7)
            for left in range(7)
            for right in range(left + 1, 8)
            if not missing[top:bottom, left:right].any()
        ]
        part = largest_whole_part(missing)
        assert not missing[part].any() and missing[part].size == max(areas)
    assert largest_whole_part(np.array([True, False, False, True, False])) == (slice(1, 3),)


def test_levelling_removes_exactly_its_form_and_leaves_the_rest() -> None:
    y, x = np.mgrid[:20, :30] * 1.0
    plane, bowl = 3.0 + 0.2 * x - 0.7 * y, 0.01 * x**2 + 0.02 * x * y - 0.05 * y**2
    missing = RNG.random(x.shape) < 0.2
    for form, level in ((plane, "tilt"), (plane + bowl, "curvature")):
        left = levelled(np.where(missing, 0.0, form), missing, level)
        assert np.max(np.abs(left)) < 1e-11
    left = levelled(plane + bowl, np.zeros(x.shape, bool), "tilt")
    matrix = np.stack([np.ones(x.size), x.ravel(), y.ravel()], axis=1)
    fit = matrix @ np.linalg.lstsq(matrix, (plane + bowl).ravel(), rcond=None)[0]
    np.testing.assert_allclose(left.ravel(), (plane + bowl).ravel() - fit, atol=1e-10)
    line = np.linspace(0.0, 5.0, 40) ** 2
    assert np.max(np.abs(levelled(line, np.zeros(40, bool), "curvature"))) < 1e-12


def test_a_tilt_is_mentioned_and_removed_on_request(tmp_path: Path) -> None:
    path = npy(tmp_path, np.linspace(0.0, 50.0, 300) + np.sin(np.arange(300.0)))
    assert any("rises by 50" in note for note in imported(path, unit="um", pixel="5 um").report["notes"])
    found = imported(path, unit="um", pixel="5 um", level="tilt")
    assert found.report["rq"] == pytest.approx(1e-6 / np.sqrt(2.0), rel=0.02) and not found.report["notes"]


@pytest.mark.parametrize("shape", [(700,), (1000, 30), (900, 1300), (2, 2), (40, 1200), (2, 5000), (3000, 2)])
def test_the_picture_is_a_png_of_a_bounded_size(shape: tuple[int, ...]) -> None:
    heights = RNG.normal(size=shape) * 1e-6
    with Image.open(io.BytesIO(relief_picture(heights, (5e-6,) * len(shape)))) as picture:
        picture.load()
        assert picture.format == "PNG" and max(picture.size) <= 480 and picture.mode == "L"


def test_light_comes_from_the_upper_left() -> None:
    y, x = np.mgrid[-40:40, -40:40] * 1e-6
    dome = -(x**2 + y**2)
    with Image.open(io.BytesIO(relief_picture(dome, (1e-6, 1e-6)))) as picture:
        shown = np.asarray(picture, np.float64)
    assert shown[:20, :20].mean() > shown[-20:, -20:].mean() + 50
