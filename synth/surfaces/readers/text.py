"""Text (CSV, TXT, XYZ, ASC and others): a list of heights, x and heights, triples, or a grid.

Stage   SURFACES, from files.
Model   The numbers begin at the first line that has only numbers, or at the lines of missing points just before it. The
        lines above are the header (`text_header`). Later lines that begin with #, %, // or ! are comments. The names of
        the columns decide the layout; without names, their number does:
        1       heights along a line, one per line of the file
        2       x and height
        3       x, y and height: the points lie on a lattice, in any order, and some may be missing
        4 ...   a grid: a line of the file is a row along x; a file of one line holds heights along a line
        A file that states sizes or a number of columns is a grid, whatever their number.
        `number_forms` tells how the numbers are written, `text_encoding` the encoding.
Limits  A header has at most MOST_HEADER lines.
"""

from __future__ import annotations

import csv
import re
import warnings
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from itertools import chain, islice
from pathlib import Path
from typing import Any, NoReturn, TextIO

import numpy as np

from synth.surfaces.readers.column_names import column_of
from synth.surfaces.readers.header_end import LONGEST_HEADER, check_last
from synth.surfaces.readers.known_files import POINT_CLOUD, PROFILE_RECORD, is_json, mesh_as_text, refuse_known
from synth.surfaces.readers.number_forms import (
    COMMENT,
    COULD_BE_GROUPS,
    FOOTER,
    Form,
    NotANumber,
    form_of,
    is_missing,
    is_numbers,
    refuse_ambiguous,
)
from synth.surfaces.readers.surface_file import MOST_POINTS, SurfaceFile, refuse_file
from synth.surfaces.readers.text_blocks import EMPTY_CELLS, check_blocks
from synth.surfaces.readers.text_encoding import encoding_of, is_text
from synth.surfaces.readers.text_header import header_of
from synth.surfaces.readers.text_layout import surface_of_table

MOST_HEADER = 300  # lines before the numbers
MOST_ALIKE = 3  # lines of numbers of one length above the names of columns; more are points
WITH_UNIT = re.compile(r"[+-]?[0-9.,]+ ?(?:[mnuµμ]?m|in|mil)")
FEWEST_COUNTED = 4  # heights below a first number that counts them; a smaller number is as likely a height
SAMPLE = 100  # lines that decide how the numbers are written
OCTAVE = "# Created by Octave"
OTHER_PROGRAMS: tuple[bytes, ...] = (
    rb"\*File list",
    rb"\*Force file list",
    b"Wyko ASCII",
    b"aISO-1.0",
    b"bISO-1.0",
    b"aBCR-1.0",
    b"bBCR-1.0",
    b"# .PCD",
    b"fileformat",
    b"WSxM",
    b"[DataSet]",
    b"fileType",
    b"Gwyddion Simple Field",
    b"Gwyddion XYZ Field",
)
OTHER_PROGRAMS += (
    b"ply\n",
    b"ply\r",
    b"%PDF",
    b"%!PS",
    b"ISO-10303",
    b"<",
    b"ISO5436",
    b"ISO 5436",
    b"#?RADIANCE",
    b"#?RGBE",
    b"#usda",
    b"P7\n",
    b"PF\n",
)


def fits(head: bytes, _ending: str) -> bool:
    """Return whether the file begins with text that is not the header of a format of another program."""
    start = head.lstrip(b"\xef\xbb\xbf \r\n")
    is_other = (
        bool(POINT_CLOUD.search(start) or PROFILE_RECORD.match(start))
        or mesh_as_text(head)
        or is_json(start)
        or (start.startswith(b"solid") and b"facet" in head)
    )
    return is_text(head) and not start.startswith(OTHER_PROGRAMS) and not is_other


def read(path: Path, _ending: str) -> SurfaceFile:
    """Return the contents. Raises InvalidRequest."""
    codec, encoding = encoding_of(path)
    try:
        with path.open(encoding=codec) as file:
            header, sample = _beginning(file)
            if header and header[0].startswith(OCTAVE):
                header = _header_of_octave(path, codec)
            form = form_of(sample, header)
            check_last(header, sample, form)
            values = _at_once(chain(sample, file), form, path.stat().st_size)
        if values is None:
            values = _line_by_line(path, codec, form)
    except UnicodeError as error:
        refuse_file(f"text that is not whole in {encoding}", "text in one encoding", "Save it as UTF-8.", error)
    values, note = _without_count(values, sample, form)
    stated = header_of(header, form, values.shape[1])
    if len(values) > 1 and not {"x", "y"} & {one.role for one in stated.columns}:
        check_blocks(path, codec, values.shape[1], len(header))
    found = surface_of_table(values, form, stated, encoding)
    return replace(found, notes=(*found.notes, note)) if note else found


def _header_of_octave(path: Path, codec: str) -> list[str]:
    """Return no line: the sizes that Octave writes above any matrix make no grid of it. Refuse several variables."""
    with path.open(encoding=codec) as file:
        names = [line.partition(":")[2].strip() for line in file if line.startswith("# name:")]
    if len(names) > 1:
        found = f"{len(names)} variables of Octave: {', '.join(names)[:80]}"
        refuse_file(found, "one matrix or column", "Save the heights alone: save -text scan.txt z")
    return []


def _without_count(values: np.ndarray[Any, Any], sample: list[str], form: Form) -> tuple[np.ndarray[Any, Any], str]:
    """Return the numbers without a first one that counts the others in one column, and a note about the first, or "".

    A first number with other decimals than all that follow stays, with a note.
    """
    others, columns = len(values) - 1, values.shape[1]
    if columns != 1 or others < FEWEST_COUNTED or np.isnan(values[0, 0]):
        return values, ""
    first, *rest = (form.row(line)[0] for line in sample if is_numbers(line))
    if first.isdigit() and values[0, 0] == others:
        return values[1:], f"The first number, {first}, is how many follow, and was not read as a height"
    if len({_decimals(number) for number in rest}) == 1 and _decimals(first) != _decimals(rest[0]):
        is_read = f"The first number, {first}, has other decimals than those below, and was read as a height"
        return values, f"{is_read}: if it is a spacing or a count, remove its line"
    return values, ""


def _decimals(number: str) -> int:
    return len(number.lower().partition("e")[0].partition(".")[2])


def _beginning(file: TextIO) -> tuple[list[str], list[str]]:
    """Return the lines of the header, and the first lines of the numbers.

    Lines of numbers with another number of cells than the lines that follow, such as the number of points, are header.
    """
    header, first = _header(file)
    sample = [*first, *islice(_rows(file), SAMPLE - len(first))]
    if below := _names_below(sample, header):
        header, sample = [*header, *(line[:LONGEST_HEADER] for line in sample[:below])], sample[below:]
    for _ in range(3):
        if len(sample) < 4 or is_missing(sample[0]):
            break
        form = form_of(sample[1:], header)
        counts = [_count(form, line) for line in sample]
        if counts[0] == counts[1] or len(set(counts[1:]) - {0}) > 1 or counts[1] == 0:
            break
        header.append(sample.pop(0)[:LONGEST_HEADER])
    return header, sample


def _names_below(sample: list[str], header: list[str]) -> int:
    """Return the number of lines of `sample` that belong to the header: values alone, and then the names of columns.

    Such a line of names divides lines of numbers with different numbers of cells; any other is a fault, and remains.
    Lines above it that are as long as one below it, or more than MOST_ALIKE of one length, are points.
    """
    place = next((place for place, line in enumerate(sample) if not is_numbers(line) and not is_missing(line)), 0)
    if not 0 < place < len(sample) - 1 or not is_numbers(sample[place + 1]):
        return 0
    form = form_of(sample[place + 1 :], header)
    above = Counter(_count(form, line) for line in sample[:place])
    below = {_count(form, line) for line in sample[place + 1 :]} - {0}
    return 0 if above.keys() & below or max(above.values()) > MOST_ALIKE else place + 1


def _count(form: Form, line: str) -> int:
    try:
        return len(form.row(line))
    except (NotANumber, csv.Error):
        return 0


def _header(file: TextIO) -> tuple[list[str], list[str]]:
    """Return the header, and the first lines of the numbers: lines of missing points, then one with a number."""
    header: list[str] = []
    missing: list[str] = []
    for line in file:
        if not line.strip():
            continue
        if is_numbers(line):
            return header, [*missing, line]
        if is_missing(line):
            missing.append(line)
        else:
            header += [*missing, line[:LONGEST_HEADER].strip("\r\n\ufeff ")]
            missing = []
        if len(header) > MOST_HEADER:
            break
    refuse_known("\n".join(header).encode(), "", None)
    cells = [cell for line in header for cell in re.split(r"[\t;|]+| {2,}", line)]
    if cell := next(filter(COULD_BE_GROUPS.fullmatch, cells), None):
        refuse_ambiguous(cell)
    if cell := next(filter(WITH_UNIT.fullmatch, cells), None) if len(header) > 3 else None:
        hint = "Write the units once, in a line above: x [mm]; z [um]."
        refuse_file(f"cells such as {cell[:40]!r}", "numbers without their units", hint)
    for separator in ("\t", ";", ",", "|"):
        rows = [line.split(separator) for line in header[-SAMPLE:]]
        alike = [row for row in rows if len(row) == len(rows[-1]) > 1]
        numbers = [row for row in alike if any(map(is_numbers, row)) and not all(map(is_numbers, filter(None, row)))]
        if len(numbers) > 2:
            word = next(cell for cell in numbers[-1] if cell.strip() and not is_numbers(cell)).strip()
            refuse_file(
                f"a column of words or dates, such as {word[:30]!r}", "columns of numbers", "Remove the column."
            )
    refuse_file(f"no numbers in the first {MOST_HEADER} lines", "a text file of numbers", "Is this the right file?")


def _rows(file: TextIO) -> Iterator[str]:
    """Yield the lines that are no comments. Lines of separators alone count only if others follow."""
    held: list[str] = []
    for line in file:
        is_number = line[0] in "0123456789+-"
        if not is_number and EMPTY_CELLS.fullmatch(line):
            held.append(line)
        elif is_number or (line.strip() and not COMMENT.match(line)):
            yield from held
            held = []
            yield line


def _at_once(lines: Iterator[str], form: Form, size: int) -> np.ndarray[Any, Any] | None:
    """Return the numbers, or None if the lines have to be read one by one."""
    if not form.is_plain:
        return None
    first = next(lines)
    try:
        columns = len(form.row(first))
        delimiter = None if form.separator == " " else form.separator
        lines = chain([first], lines)
        return _numbers(_with_points(lines) if form.decimal == "," else lines, delimiter, columns, size)
    except UnicodeError:
        raise
    except ValueError:  # a comment, a missing point, or a fault: `_line_by_line` tells them apart
        return None


def _with_points(lines: Iterator[str]) -> Iterator[str]:
    for line in lines:
        if "." in line:
            raise NotANumber(line)
        yield line.replace(",", ".")


def _numbers(lines: Iterator[str], delimiter: str | None, columns: int, size: int) -> np.ndarray[Any, Any]:
    """Return the numbers, float64 [rows, columns]. Raises ValueError for a cell that is not a number.

    size: of the file in bytes. A number takes at least two bytes, so the size limits the number of rows. NumPy
        allocates memory for all rows at once.
    """
    of_a_point = columns if columns in (2, 3) else 1
    most = min(of_a_point * MOST_POINTS, size) // columns + 1
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        return np.loadtxt(lines, delimiter=delimiter, ndmin=2, max_rows=most, comments=None)


def _line_by_line(path: Path, codec: str, form: Form) -> np.ndarray[Any, Any]:
    """Return the numbers of a file with comments, quotes or missing points, or raise InvalidRequest for a fault."""
    with path.open(encoding=codec) as file:
        header, sample = _beginning(file)
        columns = _count(form, sample[0])
        named = [
            line for line in header[-1:] if _names_columns(line, form, columns)
        ]  # some programs repeat it on each page

        def rows() -> Iterator[str]:
            number = 0
            for line in chain(sample, _rows(file)):
                text = line.strip()
                if text not in named and not FOOTER.fullmatch(text):
                    number += 1
                    yield "\t".join(_checked(line, form, number, columns))

        return _numbers(rows(), "\t", max(1, columns), path.stat().st_size)


def _names_columns(line: str, form: Form, count: int) -> bool:
    """Return whether a line is no row of points: it has words or too few cells. One word alone has to be known."""
    columns = [column_of(cell) for cell in form.cells(line)]
    words = len(columns) > 1 and bool(re.search(r"[^\W\d_]", line)) and not is_missing(line)
    return words or len(columns) != count or any(one.unit or one.role for one in columns)


def _checked(line: str, form: Form, number: int, columns: int) -> list[str]:
    """Return the numbers of a line. Raises InvalidRequest for a cell that is no number, and for another length.

    columns: of the first line, or 0 if that line has a fault.
    """
    try:
        row = form.row(line)
    except (NotANumber, csv.Error) as error:
        _refuse_line(line, number, str(error))
    if columns and len(row) != columns:
        refuse_file(
            f"line {number} of the numbers has {len(row)} columns, and the first has {columns}",
            "lines of equal length",
            f"Correct the line {line.strip()[:60]!r}.",
        )
    return row


def _refuse_line(line: str, number: int, cell: str) -> NoReturn:
    if COULD_BE_GROUPS.fullmatch(cell):
        refuse_ambiguous(cell)
    text = line.strip()[:60]
    found = f"line {number} of the numbers, {text!r}" + (f", with {cell[:30]!r}" if cell != text else "")
    refuse_file(found, "numbers", "Correct the line, or remove it. A missing point is an empty cell, nan or ---.")
