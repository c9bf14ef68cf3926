"""The end of the header of a text file: its last line must not be a point that could not be read.

Stage   SURFACES, from files.
Model   In lists of x and height, and of x, y and height, a point has its coordinates one step before those of the first
        two points that are read, or the same words follow the coordinates in the two last lines of the header. Of a
        line of a grid at least half are numbers, and it is no corner with the x of the columns.
        In a list of heights it begins with a decimal fraction, and is no date.
Limits  A header whose last line is like that is refused: a few numbers too many are better than a point that is lost.
        Not told: one point alone at unequal steps, a line of a grid with more words than numbers, and a short one.
"""

from __future__ import annotations

import csv
import re

from synth.surfaces.readers.number_forms import Form, NotANumber
from synth.surfaces.readers.surface_file import refuse_file

LONGEST_HEADER = 1000  # characters of a line of the header that are looked at
MOST_COLUMNS_OF_POINTS = 3  # x, y and height
HEIGHT = re.compile(r"\s*[+-]?[0-9]*[.,][0-9]")
DATE = re.compile(r"\s*[0-9]{1,4}[.,][0-9]{1,2}[.,](?:[0-9]{2}|[0-9]{4})(?![0-9])")
WITHIN = 0.5  # of a step: permitted distance from the place before the first points


def check_last(header: list[str], sample: list[str], form: Form) -> None:
    """Refuse a header whose last line is a point. sample: the first lines of the numbers, in `form`."""
    columns = len(_numbers(form, sample[0]))
    if not header or not columns:
        return
    if columns == 1:
        is_point = bool(HEIGHT.match(header[-1])) and not DATE.match(header[-1])
    elif columns > MOST_COLUMNS_OF_POINTS:
        is_point = _is_line_of_grid(form, header[-1], columns)
    else:
        is_point = _is_next(form, [header[-1], *sample[:2]], columns - 1) or _are_alike(form, header[-2:], columns - 1)
    if is_point:
        hint = "Correct the line, or remove it. A missing point is an empty cell, nan or ---."
        refuse_file(f"the line {header[-1].strip()[:60]!r} just above the first line of numbers", "numbers", hint)


def _is_line_of_grid(form: Form, line: str, columns: int) -> bool:
    """Return whether at least half of a line of a grid are numbers, and not all of them x below a corner of words."""
    cells = _numbers(form, line)
    is_whole = len(cells) >= columns or len(line) > LONGEST_HEADER // 2
    has_words = None in cells[1:] or (None in cells and len(cells) > columns)
    return is_whole and has_words and 2 * (len(cells) - cells.count(None)) >= min(columns, len(cells))


def _is_next(form: Form, lines: list[str], coordinates: int) -> bool:
    """Return whether the coordinates of three lines follow each other in equal steps."""
    places = [_numbers(form, line)[:coordinates] for line in lines]
    known = [[number for number in place if number is not None] for place in places]
    if [len(place) for place in known] != [coordinates] * 3:
        return False
    return all(abs(a - 2.0 * b + c) <= WITHIN * abs(c - b) for a, b, c in zip(*known, strict=True))


def _are_alike(form: Form, lines: list[str], coordinates: int) -> bool:
    """Return whether two lines have numbers as coordinates, and then the same words."""
    rows = [_numbers(form, line) for line in lines]
    words = [form.cells(line)[coordinates:] for line in lines]
    has_places = all(len(row) > coordinates and None not in row[:coordinates] for row in rows)
    return len(lines) == 2 and has_places and words[0] == words[1]


def _numbers(form: Form, line: str) -> list[float | None]:
    """Return the cells of a line as numbers, None for a cell that is no number; none for a line without cells."""
    try:
        return [_number(form, cell) for cell in form.cells(line)]
    except csv.Error:
        return []


def _number(form: Form, cell: str) -> float | None:
    try:
        return float(form.number(cell))
    except NotANumber:
        return None
