"""DSAA: the text grid of Golden Software Surfer.

Stage   SURFACES, from files.
Model   Five lines of header: DSAA; numbers of columns and rows; first and last x; first and last y; least and greatest
        height. Then the heights row by row, with x along a row, in lines of any length. A height of BLANK or more is a
        missing point.
Source  Golden Software Surfer help, "ASCII Grid File Format".
Limits  The format has no unit. Its binary forms, DSBB and DSRB, are not read.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from synth.surfaces.readers.surface_file import SurfaceFile, check_shape, finite_heights, refuse_file

MAGIC = b"DSAA"
BLANK = 1.7014e38
HEADER = 8  # numbers before the heights


def fits(head: bytes, _ending: str) -> bool:
    """Return whether the file begins as the grid does."""
    return head.startswith(MAGIC) and head[len(MAGIC) : len(MAGIC) + 1].isspace()


def read(path: Path, _ending: str) -> SurfaceFile:
    """Return the contents. Raises InvalidRequest, and ValueError for a damaged file."""
    words = path.read_text("ascii").split()[1:]
    columns, rows = int(words[0]), int(words[1])
    check_shape((rows, columns))
    if len(words) != HEADER + rows * columns:
        found = f"{len(words) - HEADER} heights"
        refuse_file(found, f"{rows} rows of {columns}, as its header states", "Save the grid again.")
    west, east, south, north = map(float, words[2:6])
    spacing = (east - west) / (columns - 1), (north - south) / (rows - 1)
    if not min(spacing) > 0.0:
        refuse_file("a first x or y that is not below the last", "x and y that increase", "Correct the header.")
    values = np.array(words[HEADER:], np.float64).reshape(rows, columns)
    heights, missing = finite_heights(np.where(values >= BLANK, np.nan, values))
    layout = f"a grid of {rows} rows and {columns} columns, the row of the least y first"
    return SurfaceFile("Surfer grid", layout, heights, missing, spacing=spacing)
