"""NPY: one NumPy array of heights, along a line or over an area.

Stage   SURFACES, from files.
Model   Rows are along y and columns along x. NaN and infinities are missing points.
Source  numpy.lib.format.
Limits  The format has no unit and no distance between points. Arrays of objects, which can run code, are refused.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from synth.surfaces.readers.surface_file import SurfaceFile, check_shape, finite_heights, refuse_file


def fits(head: bytes, _ending: str) -> bool:
    """Return whether the file begins as NPY does."""
    return head.startswith(b"\x93NUMPY")


def read(path: Path, _ending: str) -> SurfaceFile:
    """Return the contents. Raises InvalidRequest, and ValueError for a damaged file."""
    stored = np.lib.format.open_memmap(path, mode="r")  # maps the file, so a false shape allocates no memory
    if stored.dtype.kind not in "fiu":
        refuse_file(f"an array of {stored.dtype}", "an array of real numbers", "Save the heights as numbers.")
    check_shape(stored.shape)
    heights, missing = finite_heights(stored)
    kind = "heights along a line" if heights.ndim == 1 else "a grid: rows along y, columns along x"
    return SurfaceFile("NPY", f"{kind}, {stored.dtype}", heights, missing)
