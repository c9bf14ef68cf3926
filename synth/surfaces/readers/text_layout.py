"""The table of numbers of a text file, with what its header states, as a surface.

Stage   SURFACES, from files.
Model   The roles of the columns come from their names (`column_names.Column.role`), else from their number. A grid may
        have the coordinates of its columns in its first row, and those of its rows in its first column. Where the file
        states which way y goes, the row of the least y becomes the first.
Limits  One column of heights is read; others are named in a note.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from synth.surfaces.readers.column_names import Column, is_height
from synth.surfaces.readers.lattice import profile_of_pairs, surface_of_triples
from synth.surfaces.readers.number_forms import SEPARATORS, Form
from synth.surfaces.readers.surface_file import UNITS, UNSTATED, SurfaceFile, check_shape, finite_heights, refuse_file
from synth.surfaces.readers.table_checks import (
    UPWARDS,
    are_traces,
    ascending,
    check_counts,
    check_lines,
    check_step,
    check_table,
    count_beside_step,
    counts_points,
    is_list_of_points,
    is_monotonic,
    numbered_places,
    stated_step,
    with_corner,
)
from synth.surfaces.readers.text_header import Header

HOW_TO_NAME = "Export x and heights in um, with the unit alone in brackets: x [um]; z [um]."
EQUAL = 1e-3  # relative difference of the steps of coordinates in the first row and column of a grid


def surface_of_table(values: np.ndarray[Any, Any], form: Form, header: Header, encoding: str) -> SurfaceFile:
    """Return the surface in `values`, float64 [rows, columns]. Raises InvalidRequest."""
    count = values.shape[1]
    said = form.says(count)
    lines = header.lines
    said += f", after {lines} lines of header" if lines > 1 else ", after a line of header" if lines else ""
    if (no_data := header.number("no data")) is not None:
        values = np.where(np.isclose(values, no_data, rtol=1e-6, atol=0.0), np.nan, values)
    if header.axis:
        values = np.vstack([header.axis, values])
        header, is_turned = with_corner(header)
        values = values.T if is_turned else values
    check_table(header, values.shape)
    roles = None if header.axis else _roles(header, values)
    found = _grid(values, header, said) if roles is None else _of_columns(values, roles, header, said)
    notes = found.notes
    reading = {
        "encoding": encoding,
        "separator": SEPARATORS[form.separator] if count > 1 else None,
        "decimal_sign": form.decimal,
        "header_lines": lines,
        "columns": _columns(roles, header, count) if roles is not None else [],
    }
    return replace(found, notes=notes, reading=reading)


def _columns(roles: tuple[str, ...], header: Header, count: int) -> list[dict[str, str | None]]:
    columns = header.columns or (Column(),) * count
    of_ordinate = None if "y" in roles else header.unit("unit y")
    units = {"x": header.unit("unit x"), "y": header.unit("unit x"), "height": header.unit("unit") or of_ordinate}
    everything = header.unit("unit of all")
    return [
        {"name": one.name, "read_as": role or "not read", "unit": one.unit or units.get(role) or everything}
        if role
        else {"name": one.name, "read_as": "not read", "unit": None}
        for one, role in zip(columns, roles, strict=True)
    ]


def _roles(header: Header, values: np.ndarray[Any, Any]) -> tuple[str, ...] | None:
    """Return what each column is: "x", "y", "height", or "" if it is not read; None for a grid."""
    rows, count = values.shape
    is_sized = "width" in header.values and "height" in header.values
    if header.number("columns") == count > 1 and header.number("rows") in (None, rows):
        is_sized = True
    named = [column.role for column in header.columns]
    if places := numbered_places(header.columns):
        return places
    if count > 1 and named[:1] == ["x"] and "y" not in named and np.all(np.isnan(values[:, 0])):
        return ("", "height", *("",) * (count - 2))  # LabVIEW names x where it writes none
    if is_sized and count > 1:
        return None
    if "x" in named and "height" not in named:
        with_unit = [place for place, one in enumerate(header.columns) if one.unit in UNITS and not one.role]
        if (
            not with_unit
            and count > 2
            and named[0] == "x"
            and is_monotonic(values[:, 0])
            and are_traces(header.columns)
        ):
            with_unit = [1]  # x [mm], scan 1, scan 2
        named = ["height" if place in with_unit[:1] else role for place, role in enumerate(named)]
    if "height" in named and {"x", "index"} & set(named):
        return _named(named)
    if count <= 3 and "x" in named and named.count("y") == 1 and "height" not in named and count == 2:
        return tuple("height" if role == "y" else role for role in named)
    if named.count("height") == count > 1 and not is_monotonic(values[:, 0]):
        return _named(named)
    if count == 2 and named[:1] == ["index"]:
        return "", "height"
    if "height" in named[:-1] and named.count("height") == 1 and count in (2, 3):  # not where places put the heights
        return _beside_heights(header, named, values)
    if rows == 1 and count > 3:
        return None
    if count > 3 and not named:
        check_lines(values)
    if count > 3 and not named and is_list_of_points(values):
        refuse_file(
            f"{count} columns, of which the first two are places",
            "columns with names, or a grid of heights",
            "Write the names in a line above, such as x;y;z;r;g;b.",
        )
    if count == 3 and not named and counts_points(values[:, 0]) and np.all(np.diff(values[:, 1]) > 0.0):
        return "", "x", "height"
    return {1: ("height",), 2: ("x", "height"), 3: ("x", "y", "height")}.get(count)


def _beside_heights(header: Header, named: list[str], values: np.ndarray[Any, Any]) -> tuple[str, ...]:
    """Return the roles of two columns of which the first has a name for heights. Raises InvalidRequest for three.

    The other one is x if it could be: it rises or falls, and its unit is not the smaller one. Else the first is:
    "Topography line [mm]; Deviation [um]".
    """
    if len(named) > 2:
        name = header.columns[named.index("height")].name[:60]
        refuse_file(
            f"heights in the column {name!r}, and no column of x",
            "x, y and heights",
            "Write the names x; y; z above them.",
        )
    if named[1] == "other":
        return "height", ""
    of_first, of_other = (UNITS.get(column.unit or "") for column in header.columns)
    is_finer = of_first is not None and of_other is not None and of_other < of_first
    return ("height", "x") if is_monotonic(values[:, 1]) and not is_finer else ("x", "height")


def _named(named: list[str]) -> tuple[str, ...]:
    """Return the roles of named columns: the first of each kind; others are not read."""
    kept: dict[str, int] = {role: named.index(role) for role in ("x", "y", "height") if role in named}
    return tuple(role if kept.get(role) == place else "" for place, role in enumerate(named))


def _of_columns(values: np.ndarray[Any, Any], roles: tuple[str, ...], header: Header, said: str) -> SurfaceFile:
    """Return a profile or a surface whose columns have `roles`."""
    columns = header.columns or (Column(),) * len(roles)
    for one, role in zip(columns, roles, strict=True):
        if role and one.of_else:
            allowed = "heights upwards without a factor" if one.doubt else "columns in a unit of length"
            refuse_file(one.doubt or f"a column {one.of_else[:60]!r}", allowed, HOW_TO_NAME)
    units = [one.unit for one in columns]
    if numbered_places(columns):
        units = [unit if role == "height" else "pixel" for unit, role in zip(units, roles, strict=True)]
    elif "x" not in roles:
        check_counts(values, columns)
        values = ascending(values, columns)
    of_ordinate = None if "y" in roles else header.unit("unit y")
    of_heights = units[roles.index("height")] or header.unit("unit") or of_ordinate or header.unit("unit of all")
    along = header.unit("unit x") or header.unit("unit of all")
    if "x" in roles:
        along = units[roles.index("x")] or along
        values = _in_unit_of_x(values, roles, units)
    of_heights = None if of_heights == "pixel" else of_heights
    notes = _notes(columns, roles)
    doubt = columns[roles.index("height")].doubt
    channel = header.values.get("channel", ("", ""))[1]
    if "x" not in roles:
        if values.size == 1:
            check_shape((1,))
        heights, missing = finite_heights(values[:, roles.index("height")])
        check_shape(heights.shape)
        layout = f"heights along a line{said}"
        spacing, unit = stated_step(header)
        unit = UNSTATED if unit is None and of_heights is not None else unit
        found = SurfaceFile("text", layout, heights, missing, of_heights, spacing and spacing[:1], unit)
        return replace(found, channel=channel, notes=notes, doubt=doubt)
    notes += count_beside_step(values[:, roles.index("x")], units[roles.index("x")], header)
    order = [roles.index(role) for role in ("x", "y", "height") if role in roles]
    chosen = values[:, order]
    number = {1: "one column", 2: "two columns", 3: "three columns"}.get(len(roles), f"{len(roles)} columns")
    if len(order) == 2:
        found = profile_of_pairs(chosen, f"x and height in {number}{said}", of_heights)
    else:
        found = surface_of_triples(chosen, f"x, y and height in {number}{said}", of_heights)
    if along == "pixel":
        found = replace(found, spacing=None, notes=(*found.notes, "Its x is in pixels"))
    else:
        unstated = UNSTATED if along is None and of_heights is not None else along
        found = replace(found, spacing_unit=unstated)
        check_step(found, header)
    return replace(found, channel=channel, notes=(*found.notes, *notes), doubt=doubt)


def _in_unit_of_x(
    values: np.ndarray[Any, Any], roles: tuple[str, ...], units: list[str | None]
) -> np.ndarray[Any, Any]:
    """Return the table with y in the unit of x. Raises InvalidRequest if one of them has no unit of length."""
    of_x, of_y = units[roles.index("x")], units[roles.index("y")] if "y" in roles else None
    if "y" not in roles or of_y == of_x or (of_y is None and of_x in UNITS):
        return values
    if of_x not in UNITS or of_y not in UNITS:
        refuse_file("x and y in two units", "one unit for x and y", "Write both in one unit.")
    scales = [UNITS[of_y] / UNITS[of_x] if role == "y" else 1.0 for role in roles]
    return np.asarray(values * scales)


def _notes(columns: tuple[Column, ...], roles: tuple[str, ...]) -> tuple[str, ...]:
    """Return notes about columns that were not read, and about a column of depths."""
    left = [one.name for one, role in zip(columns, roles, strict=True) if not role and one.name]
    notes: tuple[str, ...] = (f"Columns that were not read: {', '.join(left)[:120]}",) if left else ()
    if not all(roles) and not any(one.name for one in columns):
        notes += ("The first column counts the points, and was not read",)
    heights = columns[roles.index("height")]
    if heights.name and not is_height(heights.name) and (heights.unit or len(roles) > 1):
        of_else = f"The column {heights.name[:60]!r} was read as heights"
        notes += (f"{of_else}: if its numbers are depths, or count downwards, change their sign",)
    return notes


def _grid(values: np.ndarray[Any, Any], header: Header, said: str) -> SurfaceFile:
    """Return a table whose lines are rows along x."""
    unit = header.unit("unit") or header.unit("unit of all")
    channel = header.values.get("channel", ("", ""))[1]
    axes = _axes(values)
    counted = axes is not None and counts_points(values[0, 1:]) and counts_points(values[1:, 0])
    if header.axis and axes is None:
        refuse_file("x or y of a grid in unequal steps", "equal steps within 0.1 %", "Resample to equal steps first.")
    if axes is not None:
        is_down, is_back = values[2, 0] < values[1, 0], values[0, 2] < values[0, 1]
        values = values[1:, 1:]
        if not counted:
            values = values[:: -1 if is_down else 1, :: -1 if is_back else 1]
    elif UPWARDS in header.values:
        values = values[::-1]
    rows, columns = values.shape
    if rows == 1:
        heights, missing = finite_heights(values.reshape(-1))
        check_shape(heights.shape)
        spacing, along = _of_its_own(*_sized(header, 1, columns), unit)
        spacing = spacing and spacing[:1]
        return SurfaceFile(
            "text", f"heights along a line{said}", heights, missing, unit, spacing, along, channel=channel
        )
    check_shape(values.shape)
    heights, missing = finite_heights(values)
    layout = f"a grid of {rows} rows and {columns} columns{said}"
    layout += ", the last row of the file first" if UPWARDS in header.values else ""
    notes: tuple[str, ...] = ()
    if counted:
        notes, axes = ("The first row and the first column count the points, and were not read",), None
    elif axes is None and counts_points(values[0]):
        notes = ("Its first row is 0, 1, 2, ... or 1, 2, 3, ...: if it names the columns, remove it",)
    elif axes is None and _has_equal_steps(values[1:, 0]) and _has_equal_steps(values[0, 1:]):
        notes = ("Its first row and its first column have equal steps. If they are x and y, leave the corner empty",)
    elif axes is None and _has_equal_steps(values[:, 0]):
        notes = ("Its first column has equal steps. If it is x, name the columns in a line above the numbers",)
    if axes is not None:
        layout += ", with x in the first row and y in the first column"
        along = header.unit("unit x") or header.unit("unit of all")
        return SurfaceFile("text", layout, heights, missing, unit, axes, along, channel=channel)
    spacing, along = _of_its_own(*_sized(header, rows, columns), unit)
    return SurfaceFile("text", layout, heights, missing, unit, spacing, along, channel=channel, notes=notes)


def _of_its_own(
    spacing: tuple[float, ...] | None, along: str | None, unit: str | None
) -> tuple[tuple[float, ...] | None, str | None]:
    """Return a spacing and its unit: that of the heights is not meant for a spacing that states none."""
    return spacing, UNSTATED if spacing is not None and along is None and unit is not None else along


def _has_equal_steps(values: np.ndarray[Any, Any]) -> bool:
    steps = np.diff(values)
    return len(steps) > 1 and bool(steps[0]) and bool(np.all(np.abs(steps - steps[0]) <= EQUAL * abs(steps[0])))


def _axes(values: np.ndarray[Any, Any]) -> tuple[float, float] | None:
    """Return the distances of coordinates in the first row and column of a grid, whose corner is empty; or None."""
    if min(values.shape) < 3 or not np.isnan(values[0, 0]):
        return None
    steps = [np.diff(axis) for axis in (values[0, 1:], values[1:, 0])]
    if not all(np.all(np.isfinite(step)) and np.all(np.abs(step - step[0]) <= EQUAL * abs(step[0])) for step in steps):
        return None
    if any(step[0] == 0.0 for step in steps):
        return None
    return abs(float(np.mean(steps[0]))), abs(float(np.mean(steps[1])))


def _sized(header: Header, rows: int, columns: int) -> tuple[tuple[float, ...] | None, str | None]:
    """Return the spacing of a grid that the header states, by steps or by sizes, and its unit, or None twice.

    A unit of None beside a spacing: the file states none for it.
    """
    spacing, unit = stated_step(header)
    width, height = header.number("width"), header.number("height")
    if spacing is not None or not width or not height:
        return spacing, unit
    unit_x, unit_y = header.unit("width"), header.unit("height")
    if (width, height) == (columns, rows) and not unit_x and not unit_y:
        return None, None  # numbers of points
    named = unit_x or unit_y or header.unit("unit x") or header.unit("unit of all")
    along_y = height * (UNITS[unit_y] / UNITS[unit_x] if unit_x and unit_y else 1.0)
    return (width / columns, along_y / rows), named
