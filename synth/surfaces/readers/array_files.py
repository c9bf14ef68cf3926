"""Files of arrays alone, MATLAB and HDF5: which array has the heights, and what attributes say of its numbers.

Stage   SURFACES, from files.
Model   The only matrix has the heights, or the only vector where there is no matrix. Numbers alone do not count. Of
        several matrices, one has the heights if all others are named as x or y, such as the grids X and Y beside Z.
        Any other choice would be a guess, and is refused with the names.
Limits  The grids X and Y are not read: the distance between points has to be given.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from synth.surfaces.readers.column_names import column_of
from synth.surfaces.readers.surface_file import refuse_file

HDF5 = b"\x89HDF"
ARRAYS = ("h5", "mat")  # formats of arrays alone, which are read as NPY is: rows along y
ATTRIBUTES = (
    "scale_factor",
    "add_offset",
    "offset",
    "scale",
    "factor",
    "gain",
    "unit",
    "units",
    "_fillvalue",
    "missing_value",
    "fill_value",
    "nodata",
    "no_data",
    "z_unit",
    "unit_z",
    "units_z",
    "x_unit",
    "xy_unit",
    "height_unit",
    "zscale",
    "z_scale",
    "scaling",
    "dx",
    "dy",
    "pixelsize",
    "spacing",
    "resolution",
    "pixel_size",
)


def array_of_heights(channels: list[Any]) -> Any:
    """Return which of the arrays has the heights. channels: of the package, at least one. Raises InvalidRequest."""
    matrices = [one for one in channels if min(one.nb_grid_pts) > 1]
    found = matrices or [one for one in channels if max(one.nb_grid_pts) > 1] or channels[:1]
    others = [one for one in matrices if column_of(_name(one)).role not in ("x", "y")]
    if len(found) > 1 and len(others) != 1:
        kind = "matrices" if matrices else "vectors"
        names = ", ".join(f"{one.name} ({_size(one)})" for one in found)[:160]
        hint = "Save the heights alone" + (", or name the other matrices x and y." if matrices else ", or as text.")
        refuse_file(f"{len(found)} {kind}: {names}", "one array that can be told to be the heights", hint)
    chosen = others[0] if len(found) > 1 else found[0]
    if not matrices and chosen.nb_grid_pts[0] == 1:
        allowed = "a matrix with at least 2 points along each axis, or a profile as one column"
        refuse_file(
            f"the array {chosen.name} of {_size(chosen)} points", allowed, "Turn the profile, or save it as NPY."
        )
    return chosen


def _name(channel: Any) -> str:
    return str(channel.name).rpartition("/")[2]


def _size(channel: Any) -> str:
    return " x ".join(map(str, channel.nb_grid_pts))


def check_attributes(path: Path, name: str) -> None:
    """Refuse an array of HDF5 with attributes that change what its numbers mean: the package leaves them out.

    The attributes of its groups, up to that of the whole file, are meant for it too.
    """
    import h5py

    with h5py.File(path) as file:
        parts = name.strip("/").split("/")
        places = ["/", *("/".join(parts[: count + 1]) for count in range(len(parts)))]
        attributes = [(place, key) for place in places if place in file for key in file[place].attrs]
        stated = [f"{key} (of {place})" for place, key in attributes if key.lower() in ATTRIBUTES]
    if stated:
        allowed, hint = "an array of heights without attributes", "Apply them, and save the heights as NPY or text."
        refuse_file(f"an array of HDF5 with the attributes {', '.join(sorted(stated))[:120]}", allowed, hint)
