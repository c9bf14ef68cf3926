"""Names of columns that could change what the numbers mean are refused, or shown until the user confirms the unit."""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from synth.errors import InvalidRequest
from synth.surfaces.measurement.import_options import read_options
from synth.surfaces.measurement.import_report import ImportedSurface
from synth.surfaces.measurement.importing import import_surface

COUNT = 23
X = [0.05 * place for place in range(COUNT)]  # mm
Z = [round(7.5 * math.sin(0.6 * place) + 0.1 * place, 3) for place in range(COUNT)]  # um


def imported(folder: Path, header: str, rows: Iterable[str] | None = None, **options: Any) -> ImportedSurface:
    """Return the surface of a file with `header` above its rows; by default x and heights, with tabs."""
    written = [f"{x:.2f}\t{z:.3f}" for x, z in zip(X, Z, strict=True)] if rows is None else rows
    path = folder / "scan.txt"
    path.write_text("\n".join([*header.splitlines(), *written]) + "\n", encoding="utf-8")
    return import_surface(path, read_options(options))


def refusal(folder: Path, header: str, rows: Iterable[str] | None = None, **options: Any) -> str:
    with pytest.raises(InvalidRequest) as refused:
        imported(folder, header, rows, **options)
    return str(refused.value)


def check_heights(found: ImportedSurface, unit: float = 1e-6, heights: Iterable[float] = Z) -> None:
    values = np.array(list(heights))
    np.testing.assert_allclose(found.heights, unit * (values - values.mean()), rtol=0.0, atol=1e-9 * unit)


@pytest.mark.parametrize(
    "header",
    [
        'Travel mm\tHeight µ"',
        'Travel (mm)\tHeight {μ"}',
        "Travel (mm)\tHeight (u″)",
        "Travel [mm]\tHeight [µ'']",
        'Travel (mm)\tHeight/u"',
        '"Travel (mm)"\t"Height (µ"")"',
        'Travel\tHeight\nmm\tµ"',
        'Distance unit: mm\nHeight unit: µ"',
        'Travel (mm)\tHeight (µ")\n# a note below the names',
    ],
)
def test_a_sign_of_inches_behind_micro_is_a_micro_inch(tmp_path: Path, header: str) -> None:
    found = imported(tmp_path, header)
    check_heights(found, 25.4e-9)
    np.testing.assert_allclose(found.spacing, [50e-6])


def test_a_numbered_name_of_x_is_no_factor(tmp_path: Path) -> None:
    for header in ("C1 X (mm)\tC2 Z (um)", "1: X mm\t2: Z um"):
        check_heights(imported(tmp_path, header))


def test_quotes_round_a_cell_are_no_inches(tmp_path: Path) -> None:
    check_heights(imported(tmp_path, '"Travel mm"\t"Height µ"'))
    check_heights(imported(tmp_path, 'Travel (")\tHeight (mil)'), 25.4e-6)


@pytest.mark.parametrize(
    ("cell", "shown"),
    [
        ("\u2212Height (um)", "\u2212"),
        ("\u2013 Height [um]", "\u2013"),
        ("(\u2212Height) um", "\u2212"),
        ("Height [um] (\u2212)", "\u2212"),
        ("Height um, down", "down"),
        ("Down height (um)", "Down"),
        ("Raw height (negative) (um)", "negative"),
        ("neg. height_um", "neg"),
        ("Profile 3/8 um", "3/8"),
        ("Profile 2.5e-7 m", "2.5e-7"),
        ("Profile E-9 m", "E-9"),
        ("Profile (um) 250", "250"),
        ("Profile um (stretched 40x)", "40x"),
        ("Profile \u00d74 um", "\u00d74"),
        ("Profile 50 x (um)", "50 x"),
        ("Profile 0,5 [um]", "0,5"),
        ("Profile [um] ^2", "^2"),
        ("Profile 1:500 (um)", "1:500"),
        ("Height \u2193 [um]", "\u2193"),
        ("\u25bcHeight (um)", "\u25bc"),
    ],
)
def test_a_sign_or_a_number_beside_a_unit_is_refused_and_shown(tmp_path: Path, cell: str, shown: str) -> None:
    for options in ({}, {"unit": "mm, um"}):
        message = refusal(tmp_path, f"Travel (mm)\t{cell}", **options)
        assert shown in message and (cell in message or repr(cell) in message)
    assert refusal(tmp_path, "Travel 5E-4 m\tHeight um")  # nor beside x


@pytest.mark.parametrize(
    "cell", ["Height zqvornt (um)", "Height (um) zqvornt", "Height (zqvornt) (um)", "Height (um, zqvornt)",
             "zqvornt_height_um", "Height um (zqvornt)", "Zqvornt height in um"]
)  # fmt: skip
def test_an_unknown_word_beside_heights_has_to_be_confirmed(tmp_path: Path, cell: str) -> None:
    message = refusal(tmp_path, f"Travel (mm)\t{cell}")
    assert "qvornt" in message and 'unit = "mm, um"' in message
    found = imported(tmp_path, f"Travel (mm)\t{cell}", unit="mm, um")
    check_heights(found)
    assert any("qvornt" in note and "upwards" in note for note in found.report["notes"])
    assert "the file states it" in refusal(tmp_path, f"Travel (mm)\t{cell}", unit="mm, nm")


def test_the_message_has_the_units_that_confirm_the_heights(tmp_path: Path) -> None:
    for names, units in (
        ("Travel (um)\tHeight odd (micron)", '"um"'),
        ("Travel\tHeight odd (nm)", '"mm, nm"'),
        ("Travel (inch)\tHeight odd (um)", '"inch, um"'),
        ("Travel (mm)\tHeight odd (mil)", "z [mil]"),
    ):
        assert units in refusal(tmp_path, names)
        if units.startswith('"'):
            imported(tmp_path, names, unit=units.strip('"'))


def test_a_word_far_above_the_numbers_gives_no_unit(tmp_path: Path) -> None:
    labels = "Figure: Travel (mm)\nFigure: {} (um){}\nfirst\tsecond"
    check_heights(imported(tmp_path, labels.format("Height", "")))
    for before, behind in (("Height zqvornt", ""), ("Height", " zqvornt"), ("-Height", "")):
        assert "unit" in refusal(tmp_path, labels.format(before, behind))


@pytest.mark.parametrize(
    "cell",
    ["Line 12 height (um)", "Z3 [um]", "Surface profile, unfiltered (um)", "Mean height um", "Roughness #4 (um)",
     "Height (um), tip 2 um", "Height [um] cut-off 0.25 mm", "R-profile [um]", "Höhe7_um", "Высота профиля, мкм",
     "Height – levelled (um)", "3D height (um)", "Profile ISO 4287 (um)", "Z/um", "2: Height (um)", "(2) Height [um]",
     "C2 Height (um)"],
)  # fmt: skip
def test_usual_words_and_numbers_of_names_are_read_without_a_note(tmp_path: Path, cell: str) -> None:
    found = imported(tmp_path, f"Travel (mm)\t{cell}")
    check_heights(found)
    assert not [note for note in found.report["notes"] if "scene" not in note]


@pytest.mark.parametrize(
    "header", ["Z [um]\tFoo [mm]", "Wysokość [um]\tDroga [mm]", "높이 [um]\t거리 [mm]", "高度(μm)\t距离(mm)"]
)
def test_heights_in_the_first_column_are_told_by_their_name(tmp_path: Path, header: str) -> None:
    path = tmp_path / "turned.txt"
    path.write_text(header + "\n" + "".join(f"{0.1 * i}\t{0.25 * i}\n" for i in range(8)), encoding="utf-8")
    found = import_surface(path, read_options({}))
    np.testing.assert_allclose(found.heights, np.arange(8) * 1e-7 - 3.5e-7, atol=1e-15)
    np.testing.assert_allclose(found.spacing, [2.5e-4])


@pytest.mark.parametrize(
    "header",
    ["Profillänge [mm]\tRauheit [um]", "Profile length (mm)\tDeviation (um)", "Raw position (mm)\tSignal (um)",
     "Depth of scan [mm]\tForce line [um]"],
)  # fmt: skip
def test_an_x_whose_name_has_a_word_of_heights_is_x(tmp_path: Path, header: str) -> None:
    check_heights(imported(tmp_path, header, unit="mm, um"))


@pytest.mark.parametrize("header", ["Profile length (mm)\tDeviation (mm)", "Profile X (mm)\tDeviation (um)"])
def test_a_length_of_a_profile_is_x_beside_heights_that_rise(tmp_path: Path, header: str) -> None:
    rows = [f"{x:.2f}\t{0.1 * place:.1f}" for place, x in enumerate(X)]
    unit = 1e-3 if header.endswith("(mm)") else 1e-6
    check_heights(imported(tmp_path, header, rows), unit, 0.1 * np.arange(COUNT))


def test_heights_before_two_unknown_columns_are_refused(tmp_path: Path) -> None:
    rows = [f"{x}\t{z}\t1" for x, z in zip(X, Z, strict=True)]
    assert "no column of x" in refusal(tmp_path, "Foo (mm)\tZ (um)\tBar", rows)


@pytest.mark.parametrize(
    "name",
    ["Depth", "Groove depth", "Rautiefe", "Profondeur", "Profundidad", "Profondità", "Глубина", "z_depth", "Nap"],
)
def test_a_name_that_may_be_of_depths_gets_a_note(tmp_path: Path, name: str) -> None:
    found = imported(tmp_path, f"Travel (mm)\t{name} (um)", **({"unit": "mm, um"} if name[0] == "G" else {}))
    assert any(name in note and "depths" in note for note in found.report["notes"])


def test_a_header_that_takes_valleys_for_positive_is_refused(tmp_path: Path) -> None:
    for line in ("Grooves are positive", "Positive pits"):
        assert "downwards" in refusal(tmp_path, f"{line}\nTravel (mm)\tHeight (um)")
    check_heights(imported(tmp_path, "Hills are positive\nTravel (mm)\tHeight (um)"))


@pytest.mark.parametrize(
    "header",
    ["Travel (mm)\tForce (N)\tHeight (nm)", "No.;Travel (mm);Height (nm)", "Travel (mm) Width (um) Height (nm)",
     "Travel [mm]; Height [um]; Roughness [um]", "Travel (mm), Height (um), Waviness (um)"],
)  # fmt: skip
def test_more_names_than_columns_give_no_unit(tmp_path: Path, header: str) -> None:
    message = refusal(tmp_path, header)
    assert "3 names of columns" in message and "above 2 columns" in message
    heights = [str(z) for z in Z]
    assert "one column" in refusal(tmp_path, "Travel (mm)\tHeight (um)", heights, pixel="9 um")


@pytest.mark.parametrize(
    "header", ["X7 (mm)\tZ7 (um)\tX8 (mm)\tZ8 (um)", "Position1/mm\tHeight1/um\tPosition2/mm\tHeight2/um",
               "x_1 [mm]\tz_1 [um]\tx_2 [mm]\tz_2 [um]"]
)  # fmt: skip
def test_the_first_of_numbered_traces_is_read(tmp_path: Path, header: str) -> None:
    rows = [f"{x}\t{z}\t{2 * x}\t{5 - z}" for x, z in zip(X, Z, strict=True)]
    found = imported(tmp_path, header, rows)
    check_heights(found)
    assert found.report["spacing"] == pytest.approx([50e-6])
    assert any("not read" in note for note in found.report["notes"])


@pytest.mark.parametrize(
    ("separator", "header"),
    [
        (" ", '"Travel in mm" "Height in um"'),
        (" ", "Travel {mm} Height {um}"),
        (" ", "Travel <mm> Height <um>"),
        (" ", "Travel,mm Height,um"),
        (",", "Расстояние, мм,Высота, мкм"),
        (",", '"Расстояние, мм","Высота, мкм"'),
    ],
)
def test_names_with_spaces_and_commas_are_told_apart(tmp_path: Path, separator: str, header: str) -> None:
    found = imported(tmp_path, header, [f"{x}{separator}{z}" for x, z in zip(X, Z, strict=True)])
    check_heights(found)
    np.testing.assert_allclose(found.spacing, [50e-6])


def test_only_a_step_along_the_line_is_its_spacing(tmp_path: Path) -> None:
    heights = [f"{z:.3f}" for z in Z]
    for line in ("Line pitch: 30 um", "Track spacing = 30 um", "Thread step 30 um"):
        assert "pixel" in refusal(tmp_path, f"{line}\nHeight (um)", heights)
        both = imported(tmp_path, f"{line}, data spacing: 4 um\nHeight (um)", heights)
        np.testing.assert_allclose(both.spacing, [4e-6])


def test_a_first_number_that_counts_the_others_is_no_height(tmp_path: Path) -> None:
    heights, options = [f"{z:.3f}" for z in Z], {"unit": "um", "pixel": "4 um"}
    found = imported(tmp_path, "", [str(COUNT), *heights], **options)
    check_heights(found)
    assert any(f"{COUNT}, is how many follow" in note for note in found.report["notes"])
    other = imported(tmp_path, "", ["2.5", *heights], **options)
    check_heights(other, heights=[2.5, *Z])
    assert any("2.5, has other decimals" in note for note in other.report["notes"])
    alike = imported(tmp_path, "", ["2.500", *heights], **options)
    assert not any("first number" in note for note in alike.report["notes"])


@pytest.mark.parametrize("corner", ["Height, falling [um]", "\u2212Height [um]", "Height [um] x 50"])
def test_the_corner_of_a_grid_is_read_to_its_end(tmp_path: Path, corner: str) -> None:
    rows = [f"{y}\t{y}\t{2 * y}\t{y - 3}" for y in (0, 10, 20)]
    for name, is_read in ((corner, False), ("Height [um]", True)):
        header = "\t".join([name, "0", "5", "10"])
        if is_read:
            assert imported(tmp_path, header, rows, unit="um").heights.shape == (3, 3)
        else:
            assert repr(name) in refusal(tmp_path, header, rows, unit="um") or "factor" in refusal(
                tmp_path, header, rows
            )
