"""Put the named columns of a table of recorded points into the order of a point.

Stage: before 1 (SCENE): pandas and polars tables, structured NumPy arrays, and xarray.
Model: each name must be a known word for one part of a point, and the parts must make a whole point. The columns are
    then put in order by their names. Any other table with names is refused, because a load that is read as a position
    sounds plausible. A unit in a name, as in "load (N)" or "time_s", must be the SI unit.
Limits: columns that are only numbered have no names, and stay in their order.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from synth.scene.array_values import ArrayError, is_array, real_array

if TYPE_CHECKING:
    import numpy as np

WORDS = {
    "t": ("t", "time", "times", "timestamp", "timestamps", "seconds", "sec"),
    "x": ("x", "position", "pos", "place", "position x", "pos x", "x position", "x pos"),
    "y": ("y", "position y", "pos y", "y position", "y pos"),
    "direction": ("direction", "angle", "orientation", "theta"),
    "load": ("load", "force", "normal force", "normal load", "w", "f", "fn", "fz", "f n", "f z"),
}
PART = {word: part for part, words in WORDS.items() for word in words}
ORDERS = ("t", "x", "load"), ("t", "x", "y", "direction", "load")
UNITS = {"t": "s", "x": "m", "y": "m", "direction": "rad", "load": "N"}
WRITTEN_UNIT = re.compile(
    r"\s*[\[(]\s*(.+?)\s*[\])]\s*$|[\s_.](s|ms|us|ns|m|cm|mm|um|nm|N|mN|kN|g|kg|gf|rad|mrad|deg|px)$"
)
NUMBERED = re.compile(r"(column|col|f|dim)?[_ ]?[0-9]+", re.IGNORECASE)


def in_order(value: Any) -> Any:
    """Return the numbers [points, parts] of a table, in the order of a point; anything else is returned unchanged.

    Raises ArrayError if the names do not make a point, or if a column holds no real numbers in SI.
    """
    names = _names(value)
    if not names:
        return real_array(value, "") if hasattr(value, "columns") else value
    parts = [_part(name) for name in names]
    wanted = next((point for point in ORDERS if sorted(point) == sorted(map(str, parts))), None)
    if wanted is None:
        raise ArrayError(f"a table with the columns {', '.join(names)}", _hint(value))
    places = [parts.index(part) for part in wanted]
    for part, place in zip(wanted, places, strict=True):
        _check_unit(names[place], part)
    if _is_labelled(value):
        return real_array(value, "")[:, places]
    import numpy as np

    named = zip(wanted, places, strict=True)
    return np.column_stack([_column(value, names[place], UNITS[part]) for part, place in named])


def count_of_columns(points: Any) -> int:
    """Return how many numbers a recorded point of `points` has, as written: a list, an array or a table; 0 if none."""
    try:
        points = in_order(points)
    except ArrayError:
        return 0
    if is_array(points):
        return int((*getattr(points, "shape", ()), 0, 0)[1])
    first = points[0] if isinstance(points, list | tuple) and points else ()
    return len(first) if isinstance(first, list | tuple) or is_array(first) else 0


def _names(value: Any) -> list[str]:
    """Return the names of the columns; none where they are only numbered."""
    if not is_array(value):
        return []
    found: Any = getattr(value, "column_names", None)
    if found is None and hasattr(value, "data_vars"):
        found = [*value.coords, *value.data_vars]
    if found is None and _is_labelled(value):
        last = value.dims[-1] if value.ndim == 2 else None
        found = value.coords[last].values.tolist() if last in value.coords else None
    if found is None:
        found = getattr(value, "columns", None)
    if found is None:
        found = getattr(getattr(value, "dtype", None), "names", None)
    names = [] if found is None else list(found)
    numbered = all(not isinstance(name, str) or NUMBERED.fullmatch(name) for name in names)
    return [] if numbered and getattr(getattr(value, "dtype", None), "names", None) is None else [str(n) for n in names]


def _is_labelled(value: Any) -> bool:
    """Return whether `value` is an xarray.DataArray, whose columns are one array."""
    return hasattr(value, "coords") and hasattr(value, "ndim")


def _part(name: str) -> str | None:
    """Return the part of a point that a column's name means, or None."""
    for bare in (name, WRITTEN_UNIT.sub("", name)):
        found = PART.get(re.sub(r"[\s_.-]+", " ", bare.strip().lower()))
        if found is not None:
            return found
    return None


def _check_unit(name: str, part: str) -> None:
    found = WRITTEN_UNIT.search(name)
    unit = next((group for group in found.groups() if group), "") if found else ""
    if unit and unit != UNITS[part] and PART.get(re.sub(r"[\s_.-]+", " ", name.strip().lower())) is None:
        raise ArrayError(f"a table with the column {name!r}", f"Convert it to {UNITS[part]}, and name it {part!r}.")


def _column(value: Any, name: str, unit: str) -> np.ndarray[Any, np.dtype[np.float64]]:
    import numpy as np

    column = value[name]
    if np.asarray(column).dtype.kind in "mM":
        raise ArrayError(f"a table whose column {name!r} holds dates", "Write seconds since the first date.")
    return real_array(column, unit)


def _hint(value: Any) -> str:
    """Return what to write instead of a table whose names make no point."""
    columns = 'the columns "t", "x", "load", or "t", "x", "y", "direction", "load", and no others'
    if getattr(getattr(value, "dtype", None), "names", None):
        return f"Write {columns}, or an array of numbers in this order, such as np.c_[r.t, r.x, r.w]."
    index = " An index is no column: table.reset_index() makes it one." if hasattr(value, "reset_index") else ""
    return f'Write {columns}, or an array in this order, such as table[["t", "x", "load"]].to_numpy().{index}'
