"""Text files: the layout is told from the columns, and a file that can be read in two ways is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from synth.errors import InvalidRequest
from synth.surfaces.readers.file_formats import read_surface_file
from synth.surfaces.readers.surface_file import UNITS, UNSTATED, SurfaceFile


def contents(folder: Path, text: str, name: str = "scan.csv", encoding: str = "utf-8") -> SurfaceFile:
    path = folder / name
    path.write_text(text, encoding)
    return read_surface_file(path)


@pytest.mark.parametrize(
    ("text", "heights", "spacing"),
    [
        ("1.5\n2.5\n-3e-1\n", [1.5, 2.5, -0.3], None),
        ("x;z\n0,0;1,5\n0,5;2,5\n1,0;3,5\n", [1.5, 2.5, 3.5], (0.5,)),
        ("0\t10\n2\t20\n4\t30\n", [10, 20, 30], (2.0,)),
        ("1, 2, 3, 4\n5, 6, 7, 8\n", [[1, 2, 3, 4], [5, 6, 7, 8]], None),
        ("1.0,2.0,3.0,4.0\n5.0,6.0,7.0,8.0\n", [[1, 2, 3, 4], [5, 6, 7, 8]], None),
        ("1,0 2,0 3,0 4,5\n5 6 7 8\n", [[1, 2, 3, 4.5], [5, 6, 7, 8]], None),
        ("1;2;3;4;\n5;6;7;8;\n", [[1, 2, 3, 4], [5, 6, 7, 8]], None),
        ("1 2 3 4 5\n", [1, 2, 3, 4, 5], None),
    ],
)
def test_the_number_of_columns_tells_the_layout(
    tmp_path: Path, text: str, heights: list[float], spacing: tuple[float, ...] | None
) -> None:
    found = contents(tmp_path, text)
    np.testing.assert_array_equal(found.heights, heights)
    assert found.spacing == spacing and found.unit is None and not found.missing.any()


def test_the_layout_is_said(tmp_path: Path) -> None:
    found = contents(tmp_path, "x;z\n0,0;1,5\n0,5;2,5\n")
    assert found.layout == (
        "x and height in two columns, separated by semicolons, with decimal commas, after a line of header"
    )


def test_triples_in_any_order_are_a_grid_with_missing_points(tmp_path: Path) -> None:
    rows = ["0 0 1", "0.2 0 2", "0.4 0 3", "0 0.5 4", "0.4 0.5 6"]
    found = contents(tmp_path, "\n".join(reversed(rows)))
    np.testing.assert_array_equal(found.heights, [[1, 2, 3], [4, 0, 6]])
    np.testing.assert_array_equal(found.missing, [[False] * 3, [False, True, False]])
    np.testing.assert_allclose(found.spacing or (), (0.2, 0.5))


def test_empty_cells_and_words_for_missing_points(tmp_path: Path) -> None:
    found = contents(tmp_path, "1;;3;NaN\n5;---;7;8\n9;10;BAD;***\n")
    np.testing.assert_array_equal(found.missing, [[0, 1, 0, 1], [0, 1, 0, 0], [0, 0, 1, 1]])


@pytest.mark.parametrize("first", ["nan", "nan;NaN;nan;nan"])
def test_points_that_are_missing_at_the_beginning_are_points(tmp_path: Path, first: str) -> None:
    numbers = "1" + first[3:].lower().replace("nan", "2")
    found = contents(tmp_path, f"height\n----\n{first}\n{first}\n{numbers}\n{numbers}\n")
    np.testing.assert_array_equal(found.missing.reshape(4, -1).all(axis=1), [True, True, False, False])
    assert "2 lines of header" in found.layout


def test_the_value_that_an_esri_grid_states_for_no_data_is_a_missing_point(tmp_path: Path) -> None:
    header = "ncols 4\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 10\n"
    grid = "1 2 -9999 4\n5 6 7 8\n"
    found = contents(tmp_path, f"{header}NODATA_value -9999\n{grid}", "a.asc")
    assert found.missing.tolist() == [[False] * 4, [False, False, True, False]]  # the least y first
    assert found.heights.tolist() == [[5.0, 6.0, 7.0, 8.0], [1.0, 2.0, 0.0, 4.0]]
    assert not contents(tmp_path, header + grid, "a.asc").missing.any()


def test_comments_between_the_numbers_are_left_out(tmp_path: Path) -> None:
    np.testing.assert_array_equal(contents(tmp_path, "% made by hand\n1\n# half\n2\n3\n").heights, [1, 2, 3])


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "latin-1"])
def test_encodings(tmp_path: Path, encoding: str) -> None:
    found = contents(tmp_path, "Höhe µm\n1\n2\n", encoding=encoding)
    np.testing.assert_array_equal(found.heights, [1, 2])


def test_letters_of_code_pages_are_those_of_their_words(tmp_path: Path) -> None:
    for encoding in ("cp1250", "iso8859-2"):
        found = contents(tmp_path, "Vzdálenost [mm];Výška [um]\n0;1\n1;2\n", encoding=encoding)
        assert found.reading is not None and found.reading["columns"][1]["name"] == "Výška"


@pytest.mark.parametrize(
    "word", ["Μικρόμετρα", "μικρά", "микроны", "mikrometrów", "mícrons", "マイクロメーター", "마이크론", "微米"]
)
def test_units_are_read_in_words_of_many_languages(tmp_path: Path, word: str) -> None:
    found = contents(tmp_path, f"z [{word}]\n1\n2\n")
    assert found.unit is not None and UNITS[found.unit] == 1e-6


def test_the_header_of_gwyddion_states_sizes_and_units(tmp_path: Path) -> None:
    header = "# Channel: Topo\n# Width: 8.0 µm\n# Height: 0.004 mm\n# Value units: nm\n"
    found = contents(tmp_path, header + "1 2 3 4\n5 6 7 8\n")
    assert (found.unit, found.spacing_unit, found.channel) == ("nm", "µm", "Topo")
    np.testing.assert_allclose(found.spacing or (), (2.0, 2.0))


def test_the_unit_of_sizes_without_one_is_not_that_of_the_heights(tmp_path: Path) -> None:
    found = contents(tmp_path, "# x-length = 8\n# y-length = 4\n# z-unit = nm\n1 2 3 4\n5 6 7 8\n", "a.asc")
    assert (found.unit, found.spacing_unit, found.spacing) == ("nm", UNSTATED, (2.0, 2.0))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("1,5\n2,5\n", "a comma for the point or between two columns"),
        ("1 2 3 4\n1 2 3\n", "line 2 of the numbers has 3 columns, and the first has 4"),
        ("1\n2\nthree\n", "'three'"),
        ("0 0 1\n0.1 0.7 1\n0.35 0.2 1\n0.9 0.4 2\n", "steps of x"),
        ("0 0 1\n0 0 2\n1 0 1\n1 1 1\n0 1 1\n", "2 points at one place"),
        ("nothing here\n" * 3, "no numbers"),
        ("1\n", "at least 2 points"),
        ("1\n-1e300\n", "a height of 1e+300"),
        ("-1e308 1\n0 1\n1e308 1\n", "a value of x of 1e+308"),
        ("0 0 1\n1000 0 1\n1000 1000 1\n1 1 1\n", "4 points on 1001 x 1001 places"),
    ],
)
def test_what_cannot_be_read_is_refused_with_its_place(tmp_path: Path, text: str, says: str) -> None:
    with pytest.raises(InvalidRequest, match="file: got") as refused:
        contents(tmp_path, text)
    assert says in str(refused.value)
