"""Lines of a text file that cannot be read: they are refused with their words, and never lost as a header."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from synth.errors import InvalidRequest
from synth.surfaces.readers.file_formats import read_surface_file
from synth.surfaces.readers.surface_file import SurfaceFile

HEADERS = ["", "Instrument A\n", "Instrument A\n40\n#\n", "6 8 1 2\n40\nInstrument A\n"]
ROWS, COLUMNS, POINTS = 8, 6, 40


def contents(folder: Path, text: str) -> SurfaceFile:
    path = folder / "scan.txt"
    path.write_text(text)
    return read_surface_file(path)


def map_of(unreadable: dict[int, str], separator: str = " ") -> str:
    """Return a list of x, y and height, with other heights at some lines."""
    height = [unreadable.get(line, f"{0.1 * (line * 7 % 5):.4f}") for line in range(ROWS * COLUMNS)]
    places = [(line % COLUMNS, line // COLUMNS) for line in range(ROWS * COLUMNS)]
    return "".join(f"{x}{separator}{y}{separator}{z}\n" for (x, y), z in zip(places, height, strict=True))


def profile_of(unreadable: dict[int, str]) -> str:
    return "".join(f"{0.5 * line} {unreadable.get(line, f'{0.1 * (line * 7 % 5):.4f}')}\n" for line in range(POINTS))


@pytest.mark.parametrize("header", HEADERS)
@pytest.mark.parametrize("words", ["No signal", "out", "# 3 of 4"])
def test_a_point_with_other_words_for_its_height_is_refused(tmp_path: Path, header: str, words: str) -> None:
    with pytest.raises(InvalidRequest, match=f"'5 6 {words}'"):
        contents(tmp_path, header + map_of({41: words}))
    with pytest.raises(InvalidRequest, match=f"'15.5 {words}'"):
        contents(tmp_path, header + profile_of({31: words}))


@pytest.mark.parametrize("header", HEADERS)
@pytest.mark.parametrize("first", [1, COLUMNS, 20])
def test_first_points_with_other_words_for_their_heights_are_refused(tmp_path: Path, header: str, first: int) -> None:
    for text in (map_of(dict.fromkeys(range(first), "No signal")), profile_of(dict.fromkeys(range(first), "out"))):
        with pytest.raises(InvalidRequest, match=r"file: got (the )?line"):
            contents(tmp_path, header + text)


@pytest.mark.parametrize("line", ["1;2;out;4", "out;2;out;4", "1;out;out;4"])
def test_a_first_line_of_a_grid_with_words_is_refused(tmp_path: Path, line: str) -> None:
    with pytest.raises(InvalidRequest, match=f"'{line}'"):
        contents(tmp_path, f"Instrument A\n{line}\n5;6;7;8\n9;8;7;6\n")


@pytest.mark.parametrize("above", ["40 points", "6 8 points", "1 um", "2 2", "512"])
def test_a_line_above_the_numbers_that_is_no_point_is_header(tmp_path: Path, above: str) -> None:
    assert contents(tmp_path, f"Instrument A\n{above}\n{map_of({})}").heights.shape == (ROWS, COLUMNS)


def test_a_block_of_points_above_a_line_of_words_is_not_header(tmp_path: Path) -> None:
    with pytest.raises(InvalidRequest, match="file: got line 7 of the numbers"):
        contents(tmp_path, "1 2 3\n" * 6 + "second map\n" + "1 2 3 4\n" * 5)


def test_a_first_point_without_its_height_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidRequest, match="'0 0'"):
        contents(tmp_path, map_of({0: ""}).replace("0 0 \n", "0 0\n"))


WORDS = ["No Data", "No signal", "out of range", "bad", "x", "#N/A", "5 um", "-", "error 17", "NoData", "end"]
ABOVE = [
    "",
    "A\n",
    "A\n40\n#\n",
    "3\n4\nA b\n",
    "40\n",
    "Width 3 um\nx z\n",
    "#\n40\n50\nA\n",
    "1 2 3 4 5 6 7 8 9\nx y z\n",
]


@pytest.mark.parametrize("kind", ["map", "profile", "grid"])
def test_of_random_files_every_point_is_read_or_the_file_is_refused(tmp_path: Path, kind: str) -> None:
    """Two cells at most are words; each is in the first three lines with a chance of one half or more."""
    random, read = np.random.default_rng(7), 0
    for _file in range(300):
        across, down = random.integers(4, 9, 2)
        heights = [f"{height:.3f}" for height in random.normal(size=across * down)]
        rows = [[f"{n % across}", f"{n // across}", height] for n, height in enumerate(heights)]
        if kind == "profile":
            rows = [[f"{0.5 * n}", height] for n, height in enumerate(heights)]
        elif kind == "grid":
            rows = [heights[n : n + across] for n in range(0, len(heights), across)]
        word, separator = random.choice(WORDS), random.choice([" ", "\t", ";", ", "])
        for _cell in range(random.integers(3)):
            row = rows[random.integers(3 if random.random() < 0.5 else len(rows))]
            row[random.integers(len(row)) if kind == "grid" else -1] = word
        try:
            found = contents(tmp_path, random.choice(ABOVE) + "\n".join(map(separator.join, rows)))
        except InvalidRequest:
            continue
        assert found.heights.size == len(heights)
        read += 1
    assert read > 100


@pytest.mark.parametrize("line", ["0.69x2", "0.6 12 ", "0.6.912", "0.6912 um", "-.5?"])
def test_a_first_height_that_cannot_be_read_is_refused(tmp_path: Path, line: str) -> None:
    with pytest.raises(InvalidRequest, match=r"just above the first line of numbers"):
        contents(tmp_path, f"TAYLOR HOBSON\nUnits: um\n{line}\n" + "1.2\n1.3\n1.25\n1.1\n" * 8)


@pytest.mark.parametrize(
    "above", ["05.01.2026", "5,1,26", "12:30", "40 points", "Spacing 0.01 mm", "2026-01-05", ".--"]
)
def test_a_line_above_a_list_of_heights_that_is_no_height_is_header(tmp_path: Path, above: str) -> None:
    assert contents(tmp_path, f"Profile\n{above}\n" + "1.2\n1.3\n1.25\n1.1\n" * 8).heights.size == 32
