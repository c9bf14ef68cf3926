"""Arrays of NumPy, and files that the extra `surfaces` reads."""

from __future__ import annotations

import io
from typing import Any

import numpy as np

from tests.synth.surfaces.readers.usual_files import GRID, STEP, UsualFile, Z

VALUES = np.array(GRID)
AREA = {"unit": "um", "pixel": "125 um"}


def npy(values: Any) -> bytes:
    written = io.BytesIO()
    np.save(written, values, allow_pickle=True)
    return written.getvalue()


def npz(values: Any) -> bytes:
    written = io.BytesIO()
    np.savez_compressed(written, heights=values)
    return written.getvalue()


def array(name: str, writer: str, values: Any, heights: Any = GRID, **more: Any) -> UsualFile:
    more = {"options": AREA, "spacing": (STEP, STEP)[: np.ndim(heights)]} | more
    return UsualFile(name, writer, npy(values), heights, **more)


HOLED = np.where(VALUES == 0.0, np.nan, VALUES)

ARRAYS: tuple[UsualFile, ...] = (
    array("float64.npy", "NumPy, save: 64-bit real numbers", VALUES),
    array("float32.npy", "NumPy: 32-bit real numbers", VALUES.astype(np.float32)),
    array("float16.npy", "NumPy, PyTorch: 16-bit real numbers", VALUES.astype(np.float16)),
    array("whole.npy", "NumPy: whole numbers", (1000 * VALUES).astype(np.int16), options=AREA | {"unit": "nm"}),
    array("fortran.npy", "NumPy: Fortran order", np.asfortranarray(VALUES)),
    array("big-endian.npy", "NumPy: big-endian", VALUES.astype(">f8")),
    array("line.npy", "NumPy: a profile", np.array(Z), Z),
    array(
        "nan.npy",
        "NumPy: NaN at a missing point",
        HOLED,
        np.where(VALUES == 0.0, (-2.25 + 1.25 - 1.0 + 2.5) / 4.0, VALUES),
        options=AREA | {"missing": "fill"},
    ),
    UsualFile("one.npz", "NumPy, savez_compressed of one array", npz(VALUES), GRID, (STEP, STEP), AREA, ("NPZ",)),
)
