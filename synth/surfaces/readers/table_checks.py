"""Checks of a table of numbers against its header: corners of grids, numbers of rows, units that contradict.

Stage   SURFACES, from files.
Model   The corner of a grid names what is below it and what is beside it: "y [mm] \\ x [mm]" has y down and x across;
        with "x \\ y" the grid is turned. A unit in the corner is that of what it names. If two
        columns of a list of points number the rows and columns of a grid, the distance has to be given.
Limits  What contradicts is refused: the numbers of rows and columns, and the units of a column.
"""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np

from synth.surfaces.readers.column_names import COLUMN, ROW, Column, column_of
from synth.surfaces.readers.surface_file import UNITS, SurfaceFile, refuse_file, unit_named
from synth.surfaces.readers.text_header import Header

UPWARDS = "upwards"
"""Key of a header that states the lower left corner (Esri): its first line has the greatest y."""
AGREE = 0.02  # relative difference up to which a stated distance between points and that of the column of x agree
UNEQUAL = 0.5  # of a step, by which a count or a time may be off
SHORT_LINE = 4  # numbers; so few could be a small grid
LINES_OF_A_PROFILE = 3  # at most: x, y and height, each in one line


def with_corner(header: Header) -> tuple[Header, bool]:
    """Return a header with the units that the corner of its grid states, and whether x goes down and y across."""
    corner = header.corner.strip(" #%;'")
    parts = [part for part in re.split(r"\s*[\\\\|]\s*|(?<![\])])/(?![^\[(]*[\])])|(?<=[\])])\s*/\s*", corner) if part]
    if len(parts) > 1 and column_of(corner).unit and "[" not in corner and "(" not in corner:
        parts = [corner]  # Height/um
    named = [Column(unit=unit_named(part)) if unit_named(part) else column_of(part) for part in parts]
    if wrong := next((part for part, one in zip(parts, named, strict=True) if one.of_else or one.doubt), None):
        refuse_file(
            f"the corner {wrong[:60]!r} of a grid", "y [mm] \\ x [mm], or an empty corner", "Correct the corner."
        )
    units = {one.unit for one in named if one.unit}
    roles = [one.role for one in named]
    if not units:
        return header, roles[:2] == ["x", "y"]
    if len({UNITS.get(unit) for unit in units}) > 1:
        refuse_file(f"the corner {corner[:60]!r} with two units", "one unit for x and y", "Write both in one unit.")
    unit = units.pop()
    if unit == "pixel" or not any(roles):
        allowed = "a corner that says whether the unit is that of x and y or of the heights"
        refuse_file(f"the corner {corner[:60]!r}", allowed, "Write y [mm] \\ x [mm], or z [um].")
    key = "unit" if "height" in roles else "unit x"
    other = header.unit(key)
    if other is not None and UNITS[other] != UNITS[unit]:
        refuse_file(f"a corner in {unit} below a header with {other}", "one unit", "Remove the one that is wrong.")
    return replace(header, values=header.values | {key: ("", unit)}), roles[:2] == ["x", "y"]


def numbered_places(columns: tuple[Column, ...]) -> tuple[str, ...]:
    """Return the roles of columns of which two number the rows and columns of a grid; else an empty tuple."""
    roles = [_place(one) for one in columns]
    heights = [place for place, one in enumerate(columns) if one.role == "height" and not roles[place]]
    if len(columns) == LINES_OF_A_PROFILE and not heights:
        heights = [place for place, role in enumerate(roles) if not role]
    if sorted(filter(None, roles)) != ["x", "y"] or not heights:
        return ()
    return tuple("height" if place == heights[0] else role for place, role in enumerate(roles))


def _place(column: Column) -> str:
    """Return "x" for a column that numbers columns, "y" for rows, "" for any other. x and y alone are lengths."""
    name = column.name.strip().lower()
    if column.unit in UNITS or name in ("x", "y"):
        return ""
    return "y" if ROW.fullmatch(name) else "x" if COLUMN.fullmatch(name) else ""


def check_counts(values: np.ndarray[Any, Any], columns: tuple[Column, ...]) -> None:
    """Refuse heights along a line beside a column of counts or times that repeat, or that have gaps."""
    for place, one in enumerate(columns):
        if one.role != "index" or np.all(np.isnan(values[:, place])):
            continue  # LabVIEW names x where it writes none
        steps = np.diff(values[:, place])
        if len(np.unique(values[:, place])) < len(values):
            refuse_file(
                f"a column {one.name[:40]!r} whose numbers repeat",
                "a count or a time for each point of a line",
                "If it numbers the rows of a grid, name the columns row, column and z.",
            )
        if np.any(np.abs(steps - np.median(steps)) > UNEQUAL * np.abs(np.median(steps))):
            refuse_file(
                f"a column {one.name[:40]!r} in unequal steps",
                "a count or a time in equal steps",
                "Points are missing: write a line with nan for each, or remove the column.",
            )


def check_lines(values: np.ndarray[Any, Any]) -> None:
    """Refuse two or three long lines of which the first increases: x and heights that NumPy wrote as lines."""
    rows, count = values.shape
    if 2 <= rows <= LINES_OF_A_PROFILE and count > SHORT_LINE and np.all(np.diff(values[0]) > 0.0):
        refuse_file(
            f"{rows} lines of {count} numbers, of which the first increases",
            "one line for each point, or a grid of more rows",
            "If these are x and heights, transpose them: np.column_stack([x, z]).",
        )


def check_table(header: Header, shape: tuple[int, ...]) -> None:
    """Refuse a grid of other numbers of rows and columns, and units of columns, than the header states."""
    rows, columns = shape
    stated = header.number("rows"), header.number("columns")
    if columns > LINES_OF_A_PROFILE and not header.axis and None not in stated and stated != (rows, columns):
        refuse_file(
            f"{rows} rows of {columns} numbers, where the header states {stated[0]:g} rows and {stated[1]:g} columns",
            "a header and numbers that agree",
            "Turn the grid or correct the header.",
        )
    units = [(one.role, one.unit) for one in header.columns if one.unit in UNITS]
    for role, key in (("height", "unit"), ("x", "unit x")):
        of_header = header.unit(key)
        of_columns = [unit for named, unit in units if named == role]
        if of_header and of_columns and UNITS[of_header] not in {UNITS[unit or ""] for unit in of_columns}:
            _refuse_units(of_header, of_columns[0])
    of_all = header.unit("unit of all")
    others = [unit for role, unit in units if role == "height" and of_all and UNITS[unit or ""] != UNITS[of_all]]
    if of_all and others:
        _refuse_units(of_all, others[0])


def _refuse_units(of_header: str, of_column: str | None) -> None:
    refuse_file(
        f"a header with the unit {of_header}, and a column in {of_column}", "one unit", "Remove the one that is wrong."
    )


def is_monotonic(column: np.ndarray[Any, Any]) -> bool:
    """Return whether the numbers of a column rise or fall at every step."""
    steps = np.diff(column)
    return bool(np.all(steps > 0.0) or np.all(steps < 0.0))


def counts_points(column: np.ndarray[Any, Any]) -> bool:
    """Return whether the numbers of a column are 0, 1, 2, ... or 1, 2, 3, ..."""
    return column[0] in (0.0, 1.0) and len(column) > 2 and bool(np.all(np.diff(column) == 1.0))


def ascending(values: np.ndarray[Any, Any], columns: tuple[Column, ...]) -> np.ndarray[Any, Any]:
    """Return the rows in the order in which a column counts them up."""
    index = next((place for place, one in enumerate(columns) if one.role == "index"), None)
    return values[::-1] if index is not None and np.all(np.diff(values[:, index]) < 0.0) else values


def is_list_of_points(values: np.ndarray[Any, Any]) -> bool:
    """Return whether the first two columns are every place of a lattice, once."""
    across, along = (len(np.unique(values[:, place])) for place in (0, 1))
    if min(across, along) < 2 or across * along != len(values) or len(values) < 9:
        return False
    return len(np.unique(values[:, :2], axis=0)) == len(values)


def are_traces(columns: tuple[Column, ...]) -> bool:
    """Return whether all columns but the first have one name with different numbers or letters: scan 1, scan 2."""
    words = {re.sub(r"[\s_#.-]*(?:[0-9]+|\b[a-z])$", "", one.name.strip().lower()) for one in columns[1:]}
    return len(words) == 1 and len({one.name for one in columns[1:]}) == len(columns) - 1


def stated_step(header: Header) -> tuple[tuple[float, ...] | None, str | None]:
    """Return the distances between points that the header states, along x and y, and their unit, or None twice.

    A unit of None beside a distance: the file states none for it.
    """
    key = next((key for key in ("step x", "step") if header.number(key)), None)
    if key is None:
        return None, None
    unit = header.unit(key) or header.unit("unit x") or header.unit("unit of all")
    along_x = float(header.number(key) or 0.0)
    along_y = along_x
    if header.number("step y"):
        of_y = header.unit("step y") or unit
        along_y = float(header.number("step y") or 0.0) * (UNITS[of_y] / UNITS[unit] if of_y and unit else 1.0)
    return (along_x, along_y), unit


def check_step(found: SurfaceFile, header: Header) -> None:
    """Refuse a column of x whose steps are not those that the header states."""
    stated, unit = stated_step(header)
    if stated is None or found.spacing is None or unit is None or found.spacing_unit not in UNITS:
        return
    step, read = stated[0] * UNITS[unit], found.spacing[0] * UNITS[found.spacing_unit]
    if abs(step - read) > AGREE * read:
        refuse_file(
            f"x in steps of {read:g} m, where the header states {step:g} m",
            "a header and a column of x that agree",
            "Correct the unit of x or the header.",
        )


def count_beside_step(x: np.ndarray[Any, Any], unit: str | None, header: Header) -> tuple[str, ...]:
    """Return a note about x that may count the points, where the header states a distance between them."""
    stated, of_step = stated_step(header)
    if unit is not None or stated is None or of_step is None or not counts_points(x):
        return ()
    return (
        f"x is 0, 1, 2, ..., and the header states steps of {stated[0]:g} {of_step}: if it counts, remove the column",
    )
