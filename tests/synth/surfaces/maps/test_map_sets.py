"""Sets of maps of known surfaces: size, heights and slopes are right; what is missing or wrong is asked for."""

from __future__ import annotations

import io
import sys
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from synth.errors import InvalidRequest
from synth.surfaces.measurement.import_options import read_options
from synth.surfaces.measurement.import_report import ImportedSurface
from synth.surfaces.measurement.importing import import_surface
from synth.surfaces.readers.map_names import named
from tests.synth.surfaces.maps.map_sets import (
    CASES,
    PIXEL,
    SIDE,
    WIDTH,
    Array,
    Case,
    displacement,
    file_of,
    grey,
    made,
    normals,
    slopes,
    surface,
)


def imported(path: Path, **options: Any) -> ImportedSurface:
    return import_surface(path, read_options({"width": WIDTH, **options}))


def refused(path: Path, **options: Any) -> str:
    with pytest.raises(InvalidRequest) as found:
        imported(path, **options)
    return str(found.value)


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


@pytest.mark.parametrize("number", range(len(CASES)), ids=list(CASES))
def test_a_set_has_the_size_heights_and_slopes_of_its_surface(number: int, tmp_path: Path) -> None:
    case, heights = list(CASES.values())[number], surface(number)
    options = {} if case.green else {"height": 2.0 * float(np.max(np.abs(heights))) / 0.95}
    found = imported(made(case, heights, tmp_path), **options)
    report = found.report
    assert report["size"] == pytest.approx([WIDTH, WIDTH]) and report["points"] == [SIDE, SIDE]
    assert rms(found.heights - heights) < case.error * rms(heights)
    for one, own in zip(slopes(found.heights, PIXEL), slopes(heights, PIXEL), strict=True):
        assert rms(one) == pytest.approx(rms(own), rel=case.slope)
    assert report["maps"]["green"] == case.green
    assert (report["residual"] is None) == (case.residual is None)
    if case.residual is not None:
        assert 0.0 <= report["residual"] < case.residual
        assert any("% of the normals' slopes" in note for note in report["notes"])
    read = {
        report["maps"][role] for role in ("displacement", "normal", "roughness", "packed") if role in report["maps"]
    }
    assert read | set(report["maps"]["left_out"]) == set(case.files(heights))


def test_the_residual_is_the_part_of_the_slopes_that_the_displacement_does_not_have(tmp_path: Path) -> None:
    """Normals of a surface and of a second one, of 0.3 of its slopes: that part remains."""
    one, two = surface(1), surface(2)
    two *= 0.3 * rms(slopes(one, PIXEL)[0]) / rms(slopes(two, PIXEL)[0])
    files = {
        "a_disp.tif": file_of(displacement(one, 16), "tif"),
        "a_nor_gl.tif": file_of(normals(one + two, PIXEL, "up", 16), "tif"),
    }
    found = imported(made(Case(lambda _: files, False), one, tmp_path))
    assert found.report["residual"] == pytest.approx(0.3 / np.sqrt(1.09), abs=0.03)
    assert np.vdot(found.heights, one) / np.vdot(one, one) == pytest.approx(1.0, abs=0.04)


@pytest.mark.parametrize("middle", [0.5, 0.1, 0.9])
def test_the_grey_of_the_mean_is_an_offset_only(middle: float, tmp_path: Path) -> None:
    heights = surface(3)
    files = {
        "a_disp.png": file_of(displacement(heights, 16, middle), "png"),
        "a_nor_gl.tif": file_of(normals(heights, PIXEL, "up", 16), "tif"),
    }
    found = imported(made(Case(lambda _: files, True), heights, tmp_path))
    assert rms(found.heights - heights) < 1e-3 * rms(heights)


def test_normals_alone_are_integrated_as_those_of_a_single_file(tmp_path: Path) -> None:
    heights = surface(4)
    content = file_of(normals(heights, PIXEL, "up", 8), "png")
    single = tmp_path / "some.png"
    single.write_bytes(content)
    alone = import_surface(single, read_options({"pixel": PIXEL}))
    folder = made(Case(lambda _: {"wall_nor_gl.png": content}, False), heights, tmp_path)
    np.testing.assert_allclose(imported(folder).heights, alone.heights, atol=1e-12)


def test_a_name_with_the_wrong_direction_of_green_is_told(tmp_path: Path) -> None:
    heights = surface(5)
    files = {"wall_nor_gl.tif": file_of(normals(heights, PIXEL, "down", 16), "tif")}
    notes = imported(made(Case(lambda _: files, False), heights, tmp_path)).report["notes"]
    assert any("the name of the normal map may be wrong" in note for note in notes)


def test_a_part_is_the_square_in_the_middle_with_mirrored_ends(tmp_path: Path) -> None:
    case, heights = CASES["Poliigon, 16 bits, folder"], surface(6)
    path = made(case, heights, tmp_path)
    whole, part = imported(path), imported(path, part="20 mm")
    middle = whole.heights[96:160, 96:160]
    np.testing.assert_allclose(part.heights, middle - middle.mean(), atol=1e-12)
    assert part.report["texture"]["ends"] == "mirror" and whole.report["texture"]["ends"] == "join"


def test_a_height_that_is_given_replaces_that_of_the_normals(tmp_path: Path) -> None:
    case, heights = CASES["Poly Haven, folder"], surface(7)
    found = imported(made(case, heights, tmp_path), height="3 mm")
    assert found.report["peak_to_valley"] == pytest.approx(
        3e-3 * 0.95 * np.ptp(heights) / (2 * abs(heights).max()), 1e-3
    )


def test_names_of_the_libraries() -> None:
    """Any case, any resolution, any separator; what is no map is none."""
    roles = {
        "rock_wall_disp_2k.png": ("displacement", ""),
        "Rock-Wall-Displacement-4K.TIF": ("displacement", ""),
        "Concrete012_4K-JPG_NormalDX.jpg": ("normal", "down"),
        "rock_wall_nor_gl_8k.exr": ("normal", "up"),
        "tex/Poliigon_Wall_8060_Normal.png": ("normal", ""),
        "wall_rough.jpg": ("roughness", ""),
        "wall_arm_1k.png": ("packed", ""),
        "Wall001_GLOSS_3K.jpg": ("roughness", ""),
        "Wall001_NRM16_3K.tif": ("normal", ""),
    }
    for name, expected in roles.items():
        found = named(name)
        assert found is not None and (found.role, found.green) == expected
    others = (
        "wall_diff.png Concrete012.png wall_disp.txt wall_metal.png Alarm.png wall_ao.png tough.png Wall_Preview.jpg"
    )
    assert not any(map(named, others.split()))


def files_of(**changed: bytes | None) -> dict[str, bytes]:
    """Return the files of a small set, some of them changed or left out; "." of a name is written "__"."""
    heights = surface(0, side=32)
    files: dict[str, bytes | None] = {
        "a_disp.png": file_of(displacement(heights, 16), "png"),
        "a_nor_gl.png": file_of(normals(heights, PIXEL, "up", 8), "png"),
        **{name.replace("__", "."): content for name, content in changed.items()},
    }
    return {name: content for name, content in files.items() if content is not None}


NOISE = np.random.default_rng(1).integers(0, 255, (32, 32, 3)).astype(np.uint8)
REFUSALS: list[tuple[dict[str, bytes | None], dict[str, Any], str]] = [
    ({}, {"width": None}, "width: got nothing; allowed: a length: no map states its size"),
    ({}, {"pixel": "1 mm"}, "width: got width and pixel"),
    ({}, {"width": "11 m"}, "100 um to 10 m"),
    ({}, {"slope": 0.1, "hurst": 0.5}, "slope or hurst, not both"),
    ({}, {"hurst": 1.5}, "hurst: got 1.5; allowed: 0 to 1"),
    ({}, {"unit": "um"}, "unit: got"),
    ({}, {"part": "1 m"}, "part: got 1 m; allowed: 5 mm to 80 mm"),
    ({}, {"slope": 4.0}, "the smoothest and the roughest self-affine waves (Hurst exponents 1 and 0)"),
    ({}, {"hurst": 0.5, "shortest": "1 um"}, "shortest: got 1 um"),
    (
        {"a_nor_gl__png": None},
        {},
        "height: got nothing; allowed: a length: a displacement map has no height of its own",
    ),
    ({"a_disp__png": None}, {"height": "1 mm"}, "height: got a length; allowed: nothing: the set has no displacement"),
    (
        {"a_disp__png": None, "a_nor_gl__png": None, "a_diff__png": b"-"},
        {},
        " with 'a_diff.png'; allowed: a set with a displacement map or a normal map",
    ),
    ({"a_disp__png": None, "a_disp__exr": b"\x76\x2f\x31\x01" + bytes(99)}, {}, "a_disp.exr': a picture (OpenEXR)"),
    ({"a_disp__png": file_of(NOISE, "png")}, {}, "a_disp.png': a picture in colour"),
    ({"a_nor_gl__png": file_of(grey(0.5), "png")}, {}, "allowed: a normal map"),
    ({"a_disp__png": file_of(grey(0.5), "png")}, {}, "a displacement map and a normal map of 256 x 256 and 32 x 32"),
    ({"a_disp__png": file_of(displacement(surface(9, side=32), 16), "png")}, {}, "that contradict each other"),
    ({"a_rough__png": file_of(NOISE, "png")}, {}, "a_rough.png"),
    ({"b_disp_4k__png": b"-"}, {}, "2 displacement maps: 'a_disp.png', 'b_disp_4k.png'; allowed: one map of each kind"),
]


@pytest.mark.parametrize("number", range(len(REFUSALS)))
@pytest.mark.parametrize("zipped", [False, True])
def test_what_is_missing_or_wrong_is_refused_in_words(number: int, zipped: bool, tmp_path: Path) -> None:
    changed, options, words = REFUSALS[number]
    files = files_of(**changed)
    path = made(Case(lambda _: files, zipped), grey(0.0), tmp_path)
    assert words in refused(path, **options)


def test_of_two_maps_of_a_kind_that_of_16_bits_and_roughness_win(tmp_path: Path) -> None:
    """Older sets of Poliigon."""
    heights = surface(6)
    files = {
        "W_DISP16_3K.tif": file_of(displacement(heights, 16), "tif"),
        "W_DISP_3K.jpg": file_of(displacement(heights, 8), "jpg"),
        "W_NRM16_3K.tif": file_of(normals(heights, PIXEL, "up", 16), "tif"),
        "W_NRM_3K.png": file_of(normals(heights, PIXEL, "up", 8), "png"),
        "W_GLOSS_3K.jpg": file_of(grey(0.4), "jpg"),
    }
    found = imported(made(Case(lambda _: files, False), heights, tmp_path))
    assert found.report["maps"]["left_out"] == ["W_DISP_3K.jpg", "W_NRM_3K.png"]
    assert rms(found.heights - heights) < 0.002 * rms(heights)
    assert found.report["synthetic"]["alpha"] == pytest.approx(0.36, abs=0.005)  # of roughness 0.6
    (tmp_path / "Wall" / "W_ROUGHNESS_3K.jpg").write_bytes(file_of(grey(0.5), "jpg"))
    report = imported(tmp_path / "Wall").report
    assert report["maps"]["roughness"] == "W_ROUGHNESS_3K.jpg" and "W_GLOSS_3K.jpg" in report["maps"]["left_out"]


def zipped(**files: bytes) -> bytes:
    written = io.BytesIO()
    with zipfile.ZipFile(written, "w") as packed:
        for name, content in files.items():
            packed.writestr(name.replace("__", "."), content)
    return written.getvalue()


ZIPS = {
    "empty": (
        zipped(),
        "a ZIP file without maps: it is empty; allowed: a ZIP file with maps, such as wall_",
    ),
    "without maps": (zipped(readme__txt=b"-"), "a ZIP file without maps: 'readme.txt'; allowed"),
    "in another": (zipped(wall__zip=zipped(a_disp__png=b"-")), "Unpack it, and import the ZIP file or the folder"),
    "cut off": (zipped(a_disp__png=bytes(9999))[:5000], "a damaged ZIP file, or a part of one; allowed: a whole file"),
}


@pytest.mark.parametrize("which", ZIPS)
def test_a_zip_file_that_is_no_set_is_named_without_the_reader_of_instruments(
    which: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    content, words = ZIPS[which]
    path = tmp_path / "wall.zip"
    path.write_bytes(content)
    monkeypatch.setitem(sys.modules, "SurfaceTopography.IO", None)
    assert words in refused(path)


def test_a_link_that_leads_nowhere_is_named(tmp_path: Path) -> None:
    folder = made(CASES["Poly Haven, displacement"], surface(1), tmp_path)
    (folder / "notes.txt").symlink_to("nothing.txt")
    assert imported(folder, height="1 mm").report["points"] == [SIDE, SIDE]
    (folder / "wall_rough_2k.png").symlink_to("wall_rough_2k.png")
    assert "the link 'wall_rough_2k.png', which leads to no file" in refused(folder, height="1 mm")


def test_text_that_is_named_as_a_picture_is_no_picture(tmp_path: Path) -> None:
    files = files_of(a_disp__png=b"hello")
    folder = made(Case(lambda _: files, False), grey(0.0), tmp_path)
    assert "'a_disp.png': no PNG, although its name ends so, but text: no numbers" in refused(folder)


def test_other_files_do_not_have_the_options_of_sets(tmp_path: Path) -> None:
    path = tmp_path / "scan.npy"
    np.save(path, np.ones((4, 4)))
    assert "width: got a value; allowed: nothing: only sets of maps have it" in refused(path)


def test_a_packed_map_gives_the_roughness_of_its_green_channel(tmp_path: Path) -> None:
    heights, found = surface(8), []
    for name in ("Poly Haven, folder", "Poly Haven, packed, ZIP"):
        folder = tmp_path / name
        folder.mkdir()
        found.append(imported(made(replace(CASES[name]), heights, folder)).report["synthetic"])
    assert found[0]["alpha"] == pytest.approx(0.36, abs=1e-3) and found[0]["alpha"] == found[1]["alpha"]
