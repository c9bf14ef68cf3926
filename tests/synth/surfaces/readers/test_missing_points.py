"""Words for missing points in a text file: a point stays a point, wherever it stands and whatever divides the cells."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from synth.surfaces.readers.file_formats import read_surface_file
from synth.surfaces.readers.surface_file import SurfaceFile

ROWS, COLUMNS = 8, 6


def contents(folder: Path, text: str) -> SurfaceFile:
    path = folder / "scan.txt"
    path.write_text(text)
    return read_surface_file(path)


def map_of(unreadable: dict[int, str], separator: str = " ") -> str:
    """Return a list of x, y and height, with other heights at some lines."""
    height = [unreadable.get(line, f"{0.1 * (line * 7 % 5):.4f}") for line in range(ROWS * COLUMNS)]
    places = [(line % COLUMNS, line // COLUMNS) for line in range(ROWS * COLUMNS)]
    return "".join(f"{x}{separator}{y}{separator}{z}\n" for (x, y), z in zip(places, height, strict=True))


@pytest.mark.parametrize("word", ["#N/A", "#NV", "#VALUE!", "#DIV/0!"])
def test_a_row_that_begins_with_the_error_of_a_spreadsheet_is_no_comment(tmp_path: Path, word: str) -> None:
    found = contents(tmp_path, f"1;2;3;4\n{word};6;7;8\n# 4 of 5\n9;8;7;6\n")
    np.testing.assert_array_equal(found.missing, [[0, 0, 0, 0], [1, 0, 0, 0], [0, 0, 0, 0]])


@pytest.mark.parametrize("header", ["", "Instrument A\n", "Instrument A\n40\n#\n", "40\nx y z\n"])
@pytest.mark.parametrize("lines", [(0,), (47,), range(20)])
@pytest.mark.parametrize("separator", [" ", "   ", "\t", ", "])
@pytest.mark.parametrize("words", ["No Data", "NO DATA"])
def test_no_data_is_a_missing_point(
    tmp_path: Path, header: str, lines: tuple[int, ...], separator: str, words: str
) -> None:
    found = contents(tmp_path, header + map_of(dict.fromkeys(lines, words), separator))
    missing = np.zeros(ROWS * COLUMNS, bool)
    missing[list(lines)] = True
    np.testing.assert_array_equal(found.missing, missing.reshape(ROWS, COLUMNS))


def test_no_data_in_a_grid_with_spaces_is_one_cell_of_it(tmp_path: Path) -> None:
    found = contents(tmp_path, "1 No Data 3 4\n5 6 No Data No Data\n9 8 7 6\n")
    np.testing.assert_array_equal(found.missing, [[0, 1, 0, 0], [0, 0, 1, 1], [0, 0, 0, 0]])


@pytest.mark.parametrize("word", ["NA", "No Data", "BAD", "#N/A", "NaN", "null"])
@pytest.mark.parametrize("separator", [" ", ";", "\t"])
def test_a_first_row_of_missing_points_is_a_row(tmp_path: Path, word: str, separator: str) -> None:
    row = separator.join([word] * 4)
    numbers = "1 2 3 4\n5 6 7 8\n".replace(" ", separator)
    found = contents(tmp_path, f"Instrument A\n{row}\n{row}\n{numbers}")
    np.testing.assert_array_equal(found.missing.all(axis=1), [True, True, False, False])
