"""Text (CSV, TXT, XYZ, ASC): a list of heights, two columns, triples, or a grid.

Stage   SURFACES, from files.
Model   The numbers begin at the first line that contains only numbers, or at the lines of missing points just before
        it. The lines above are the header. Later lines that begin with # or % are comments. The number of columns
        decides the layout:
        1       heights along a line, one per line of the file
        2       x and height: the steps of x are equal
        3       x, y and height: the points lie on a lattice, in any order, and some may be missing
        4 ...   a grid: a line of the file is a row along x; a file of one line holds heights along a line
        The separator is the tab or the semicolon if there is one; else a comma, if one precedes a space or if numbers
        have points; else spaces; else a comma, if a line has several. A comma that is not the separator is a decimal
        comma. An empty cell, nan, ---, *** and BAD are missing points, and so is the NODATA_value that the header of an
        Esri grid states. The header may state sizes and unit, as Gwyddion and SPIP write them.
Source  Gwyddion user guide, export of raw data as text; SPIP's ASCII format.
Limits  Lines of one comma and no point, such as "1,5", can be read in two ways and are refused. Steps differ by 1 % at
        most. A header has at most MOST_HEADER lines.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain, islice
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from synth.surfaces.readers.lattice import profile_of_pairs, surface_of_triples
from synth.surfaces.readers.surface_file import (
    MOST_POINTS,
    UNITS,
    SurfaceFile,
    check_shape,
    finite_heights,
    refuse_file,
)

ENDINGS = (".csv", ".txt", ".tsv", ".dat", ".asc", ".xyz", ".prn", "")
OTHER_PROGRAMS = (b"Wyko ASCII",)  # text whose numbers need a factor from the header
MOST_HEADER = 300  # lines before the numbers
SAMPLE = 100  # lines that decide the separator
NUMBER = re.compile(r"[+-]?(?:[0-9]+(?:[.,][0-9]*)?|[.,][0-9]+)(?:[eE][+-]?[0-9]{1,4})?")
NO_HEIGHT = re.compile(r"(?i:nan|bad|[+-]?inf)|-{2,}|\*+")
MISSING_LINE = re.compile(r"(?i:nan)(?:[\s;,]+(?i:nan))*[;,]?")  # no hyphens: they divide header and numbers
COMMENT = ("#", "%")
SEPARATORS = {"\t": "tabs", ";": "semicolons", ",": "commas", " ": "spaces"}
_SIZE = r"\s*[:=]\s*([0-9.eE+-]+)\s*([^\W\d_]+|Å)?"
STATED = {
    "width": re.compile(rf"\b(?:Width|x-length){_SIZE}"),
    "height": re.compile(rf"\b(?:Height|y-length){_SIZE}"),
    "unit": re.compile(r"\b(?:Value units|z-unit)\s*[:=]\s*()(\S+)"),
    "channel": re.compile(r"\bChannel\s*[:=]\s*()(.+)"),
    "no data": re.compile(rf"(?i:\bNODATA_value)\s+()({NUMBER.pattern})"),
}


def fits(head: bytes, ending: str) -> bool:
    """Return whether the file has an ending of text and begins with text."""
    is_text = b"\0" not in head or head.startswith((b"\xff\xfe", b"\xfe\xff"))
    return ending in ENDINGS and is_text and not any(word in head[:100] for word in OTHER_PROGRAMS)


@dataclass(frozen=True, slots=True)
class _Form:
    """How the numbers are written.

    separator: a key of SEPARATORS.
    comma: whether commas are decimal.
    trailing: whether each line ends with a separator.
    """

    separator: str
    comma: bool
    trailing: bool

    @property
    def delimiter(self) -> str | None:
        """The separator for `str.split` and NumPy. None means any white space."""
        return None if self.separator == " " else self.separator

    def columns(self, line: str) -> int:
        """Return the number of columns of `line`."""
        return len(self.cells(line).split(self.delimiter))

    def cells(self, line: str) -> str:
        """Return `line` with the same separator, decimal points, and nan for missing points."""
        line = line.strip() if self.separator != "\t" else line.strip(" \r\n")
        if self.trailing:
            line = line.removesuffix(self.separator)
        if self.comma:
            line = line.replace(",", ".")
        parts = [part.strip() for part in line.split(self.delimiter)]
        return self.separator.join("nan" if not part or NO_HEIGHT.fullmatch(part) else part for part in parts)


def read(path: Path, _ending: str) -> SurfaceFile:
    """Return the contents. Raises InvalidRequest."""
    with path.open("rb") as file:
        mark = file.read(3)
    encoding = "utf-16" if mark[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
    try:
        return _read(path, encoding)
    except UnicodeDecodeError:
        return _read(path, "latin-1")


def _read(path: Path, encoding: str) -> SurfaceFile:
    with path.open(encoding=encoding) as file:
        header, first = _header(file)
        sample = [*first, *islice(_rows(file), SAMPLE - 1)]
        form = _form(sample)
        lines, size = chain(sample, file), path.stat().st_size
        try:
            values = _numbers(_with_points(lines) if form.comma else lines, form, form.columns(first[-1]), size)
        except UnicodeDecodeError:
            raise
        except ValueError:  # a comment, a missing point, or a fault: `_carefully` distinguishes them
            values = None
    if values is None:
        values = _carefully(path, encoding, form)
    return _surface(values, form, _stated(header), len(header))


def _carefully(path: Path, encoding: str, form: _Form) -> np.ndarray[Any, Any]:
    """Return the numbers of a file with comments or missing points. Raises InvalidRequest for its first fault."""
    with path.open(encoding=encoding) as file:
        _, first = _header(file)
        counted = _Counted(first, file, form)
        try:
            return _numbers(iter(counted), form, counted.columns, path.stat().st_size)
        except UnicodeDecodeError:
            raise
        except ValueError as error:
            counted.refuse(error)


def _with_points(lines: Iterator[str]) -> Iterator[str]:
    return (line.replace(",", ".") for line in lines)


class _Counted:
    """The lines of numbers, counted, so that an error can state the line number."""

    def __init__(self, first: list[str], file: Any, form: _Form) -> None:
        self._lines, self.form = chain(first, _rows(file)), form
        self.number, self.line = 0, ""
        self.columns = form.columns(first[-1])

    def __iter__(self) -> Iterator[str]:
        for line in self._lines:
            self.number, self.line = self.number + 1, line
            yield self.form.cells(line)

    def refuse(self, error: ValueError) -> NoReturn:
        """Raise InvalidRequest for the line that was read last."""
        found = self.form.columns(self.line)
        line = self.line.strip()[:60]
        if found != self.columns:
            refuse_file(
                f"line {self.number} of the numbers has {found} columns, and the first has {self.columns}",
                "lines of equal length",
                f"Correct the line {line!r}.",
            )
        refuse_file(f"{line!r}", "numbers", f"Correct the line ({' '.join(str(error).split())[:80]}).")


def _rows(file: Any) -> Iterator[str]:
    for line in file:
        if line.strip() and not line.lstrip().startswith(COMMENT):
            yield line


def _header(file: Any) -> tuple[list[str], list[str]]:
    """Return the header, and the first lines of the numbers: lines of missing points, then one with a number."""
    header: list[str] = []
    missing: list[str] = []
    for line in file:
        if _is_numbers(line):
            return header, [*missing, line]
        if MISSING_LINE.fullmatch(line.strip()):
            missing.append(line)
        elif line.strip():
            header += [*missing, line[:1000]]
            missing = []
        if len(header) > MOST_HEADER:
            break
    refuse_file(f"no numbers in the first {MOST_HEADER} lines", "a text file of numbers", "Is this the right file?")


def _is_numbers(line: str) -> bool:
    parts = [part for part in re.split(r"[\s;]+|,(?=\s)", line.strip()) if part]
    pieces = [piece for part in parts for piece in ([part] if NUMBER.fullmatch(part) else part.split(","))]
    found = [piece for piece in pieces if NUMBER.fullmatch(piece)]
    return bool(found) and all(NUMBER.fullmatch(piece) or NO_HEIGHT.fullmatch(piece) for piece in pieces if piece)


def _form(sample: list[str]) -> _Form:
    """Return how the lines of `sample` are written, by the rules in the docstring of the module."""
    text = "\n".join(line.strip(" \r\n") for line in sample)
    points, commas = "." in text, "," in text
    if "\t" in text or ";" in text:
        separator = "\t" if "\t" in text else ";"
    elif commas and (points or re.search(r",[ ]", text)):
        separator = ","
    elif any(" " in line for line in text.split("\n")):
        separator = " "
    elif any(line.count(",") > 1 for line in text.split("\n")):
        separator = ","
    elif commas:
        refuse_file(
            f"lines such as {sample[0].strip()[:40]!r}, with a comma for the point or between two columns",
            "numbers that can be read in one way",
            "Write 1.5 with a point, or 1;5 for two columns.",
        )
    else:
        separator = " "
    comma = commas and separator != "," and not points
    trailing = separator != " " and all(line.endswith(separator) for line in text.split("\n"))
    return _Form(separator, comma, trailing)


def _numbers(lines: Iterator[str], form: _Form, columns: int, size: int) -> np.ndarray[Any, Any]:
    """Return the numbers, float64 [rows, columns]. Raises ValueError for a cell that is not a number.

    size: of the file in bytes. A number takes at least two bytes, so the size limits the number of rows. NumPy
        allocates memory for all rows at once.
    """
    of_a_point = columns if columns in (2, 3) else 1
    most = min(of_a_point * MOST_POINTS, size) // columns + 1
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        return np.loadtxt(lines, delimiter=form.delimiter, ndmin=2, max_rows=most, comments=None)


def _stated(header: list[str]) -> dict[str, tuple[str, str]]:
    """Return what the header states: for each key of STATED that it has, the number and the unit or text."""
    found: dict[str, tuple[str, str]] = {}
    for line in header:
        for key, pattern in STATED.items():
            match = pattern.search(line)
            if match and key not in found:
                found[key] = match.group(1), (match.group(2) or "").strip()
    return found


def _surface(values: np.ndarray[Any, Any], form: _Form, stated: dict[str, tuple[str, str]], header: int) -> SurfaceFile:
    rows, columns = values.shape
    said = f", separated by {SEPARATORS[form.separator]}" if columns > 1 else ""
    said += ", with decimal commas" if form.comma else ""
    said += f", after {header} lines of header" if header > 1 else ", after a line of header" if header else ""
    unit = stated.get("unit", ("", ""))[1]
    known = unit if unit in UNITS else None
    if "no data" in stated:
        values = np.where(values == float(stated["no data"][1].replace(",", ".")), np.nan, values)
    channel = stated.get("channel", ("", ""))[1][:80]
    if columns == 2:
        return profile_of_pairs(values, f"x and height in two columns{said}", known)
    if columns == 3:
        return surface_of_triples(values, f"x, y and height in three columns{said}", known)
    if columns == 1 or rows == 1:
        heights, missing = finite_heights(values.reshape(-1))
        return SurfaceFile("text", f"heights along a line{said}", heights, missing, known, channel=channel)
    check_shape(values.shape)
    heights, missing = finite_heights(values)
    layout = f"a grid of {rows} rows and {columns} columns{said}"
    spacing, spacing_unit = _grid_spacing(stated, rows, columns)
    return SurfaceFile("text", layout, heights, missing, known, spacing, spacing_unit, channel=channel)


def _grid_spacing(
    stated: dict[str, tuple[str, str]], rows: int, columns: int
) -> tuple[tuple[float, float] | None, str | None]:
    """Return the spacing that a header states, and its unit, or None twice.

    A unit of None beside a spacing means the unit of the heights.
    """
    if "width" not in stated or "height" not in stated:
        return None, None
    (width, unit_x), (height, unit_y) = stated["width"], stated["height"]
    if not (NUMBER.fullmatch(width) and NUMBER.fullmatch(height)):
        return None, None
    named = unit_x or unit_y
    if (named and named not in UNITS) or (unit_y and unit_x != unit_y and unit_y not in UNITS):
        return None, None
    along_y = float(height) * (UNITS[unit_y] / UNITS[unit_x] if unit_x and unit_y else 1.0)
    return (float(width) / columns, along_y / rows), named or None
