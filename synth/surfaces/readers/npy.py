"""NPY, and NPZ of one array: heights along a line or over an area.

Stage   SURFACES, from files.
Model   Rows are along y and columns along x. NaN and infinities are missing points.
Source  numpy.lib.format.
Limits  The format has no unit and no distance between points. Arrays of objects, which can run code, are refused, as
        are several arrays in one NPZ.
"""

from __future__ import annotations

import math
import zipfile
from pathlib import Path
from typing import IO, Any

import numpy as np

from synth.surfaces.readers.surface_file import (
    LARGEST_FILE,
    SurfaceFile,
    check_array,
    check_shape,
    finite_heights,
    refuse_file,
)

MAGIC = b"\x93NUMPY"
NAME_IN_ZIP = 30  # place of the first name in a ZIP file


def fits(head: bytes, _ending: str) -> bool:
    """Return whether the file begins as NPY does, or as a ZIP file whose first part is an NPY file."""
    length = int.from_bytes(head[26:28], "little")
    is_npz = head.startswith(b"PK\x03\x04") and head[NAME_IN_ZIP : NAME_IN_ZIP + length].endswith(b".npy")
    return is_npz or head.startswith(MAGIC)


def read(path: Path, _ending: str) -> SurfaceFile:
    """Return the contents. Raises InvalidRequest, and ValueError for a damaged file."""
    with path.open("rb") as file:
        if file.read(len(MAGIC)) == MAGIC:
            file.seek(0)
            return _array(file, "NPY")
    with zipfile.ZipFile(path) as packed:
        parts = packed.infolist()
        if len(parts) > 1:
            names = ", ".join(part.filename.removesuffix(".npy") for part in parts)[:80]
            hint = "Save the array of heights alone, as NPY."
            refuse_file(f"{len(parts)} arrays in one file (NPZ): {names}", "one array", hint)
        if parts[0].file_size > LARGEST_FILE:
            refuse_file(f"{parts[0].file_size} bytes when unpacked", f"at most {LARGEST_FILE} bytes", "Crop it.")
        with packed.open(parts[0]) as file:
            return _array(file, "NPZ")


def _array(file: IO[bytes], name: str) -> SurfaceFile:
    """Return the array in `file`. Its size is checked before memory is allocated."""
    version = np.lib.format.read_magic(file)
    if version > (2, 0):
        refuse_file("an array of named fields", "an array of real numbers", "Save the heights alone.")
    header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, is_by_column, kind = header(file)
    if kind.kind not in "fiu":
        refuse_file(f"an array of {kind}", "an array of real numbers", "Save the heights as numbers.")
    check_shape(shape)
    content = file.read(math.prod(shape) * kind.itemsize)
    stored: np.ndarray[Any, Any] = np.frombuffer(content, kind).reshape(shape, order="F" if is_by_column else "C")
    check_array(stored)
    heights, missing = finite_heights(stored)
    layout = "heights along a line" if heights.ndim == 1 else "a grid: rows along y, columns along x"
    return SurfaceFile(name, f"{layout}, {stored.dtype}", heights, missing)
