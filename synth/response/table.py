"""The response table: z of a contact over place, load and mip level, as coefficients that every voice reads.

Stage   RESPONSE: its result.
Model   z minus its mean over a period is a periodic quintic spline over place (`place_spline`). Its coefficients are
        cubics over the load between rows (`load_grid`), one set per mip level (`mip_levels`). The mean is such a cubic
        too. Beyond the last row the motion stays that of the last row, which is exact where the contact is full.
Source  design, sections 1, 8 and 9; docs/table.md describes how to read a table.
Limits  `error` bounds the error at each load, for each quantity and number of harmonics. A load beyond `covered` is
        read as the nearest covered load.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from functools import cached_property
from hashlib import sha256
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.response.mip_levels import MipLevels
from synth.response.place_spline import FIRST, PADDING
from synth.response.reading_filter import usual_weights
from synth.response.table_error import QUANTITIES, TableError

Floats = np.ndarray[Any, np.dtype[np.float32]]

LARGEST_LOAD = 1e3  # N: the end of the scene's range


@dataclass(frozen=True)
class ResponseTable:
    """The table of one contact, read along any motion. It is immutable.

    period: period of the texture (m).
    band: frequency (Hz) up to which every harmonic is heard in full.
    lift_load: load (N) below which the lift gate fades the output.
    loads: load grid (N), float32 [rows], rising from 0.
    means: mean of z over a period and its slope over the load, float32 [2, rows], m and m/N.
    pool: spline coefficients of z minus its mean (m) and of its slope over the load (m/N), float32; the levels one
        after the other, each [rows, 2, places + padding].
    full: True where the contact is full beyond the last row; the mean of z is a + b w^1.5 there.
    mean_law: a (m) and b (m/N^1.5) of that law.
    scene: the scene that the table was made for, as JSON, or "{}".
    """

    period: float
    band: float
    lift_load: float
    levels: MipLevels
    loads: Floats
    means: Floats
    pool: Floats
    error: TableError
    full: bool
    mean_law: tuple[float, float]
    scene: str = "{}"
    interpolation: str = field(default="quintic B-spline over place, cubic Hermite over load")

    @property
    def covered(self) -> tuple[float, float]:
        """The range of loads (N) of the table."""
        return 0.0, LARGEST_LOAD if self.full else float(self.loads[-1])

    @property
    def harmonics(self) -> int:
        """Harmonics of the fullest level."""
        return self.levels.highest[0]

    @property
    def memory_bytes(self) -> int:
        """Memory in bytes: that of its file, and the padding."""
        return self.pool.nbytes + self.means.nbytes + self.loads.nbytes + self.error.largest.nbytes

    @cached_property
    def layout(self) -> np.ndarray[Any, np.dtype[np.int64]]:
        """The begin of each level in `pool`, and its places, int64 [levels, 2]."""
        sizes = [2 * len(self.loads) * (places + PADDING) for places in self.levels.places]
        return np.stack([np.cumsum([0, *sizes[:-1]]), np.array(self.levels.places)], axis=1).astype(np.int64)

    @property
    def swings(self) -> tuple[Floats, ...]:
        """The coefficients of each level, float32 [rows, 2, places]: views of `pool`."""
        found = []
        for begin, places in self.layout.tolist():
            size = 2 * len(self.loads) * (places + PADDING)
            whole = self.pool[begin : begin + size].reshape(len(self.loads), 2, places + PADDING)
            found.append(whole[:, :, FIRST : FIRST + places])
        return tuple(found)

    @property
    def header(self) -> dict[str, Any]:
        """The header for a reader, ready for JSON."""
        return {
            "scene": json.loads(self.scene),
            "interpolation": self.interpolation,
            "period": self.period,
            "band": self.band,
            "lift_load": self.lift_load,
            "harmonics": list(self.levels.highest),
            "places": list(self.levels.places),
            "covered": list(self.covered),
            "full_from_last_row": self.full,
            "mean_law": list(self.mean_law),
            "error_harmonics": list(self.error.harmonics),
            "error_quantities": list(QUANTITIES),
            "filters": {name: usual_weights(order) for order, name in enumerate(QUANTITIES)},
        }

    @property
    def tensors(self) -> dict[str, Floats]:
        """The arrays of the table by name, float32, in the order of a file."""
        levels = {f"level_{n}": level for n, level in zip(self.levels.highest, self.swings, strict=True)}
        return {
            "loads": self.loads,
            "means": self.means,
            "errors": self.error.largest,
            "beyond": self.error.beyond,
            **levels,
        }

    @cached_property
    def hash(self) -> str:
        """SHA-256 of header and arrays, as 64 hexadecimal digits."""
        digest = sha256(json.dumps(self.header, sort_keys=True, separators=(",", ":")).encode())
        for name, tensor in self.tensors.items():
            digest.update(f"{name} {tensor.shape}".encode())
            digest.update(np.ascontiguousarray(tensor, dtype="<f4").tobytes())
        return digest.hexdigest()


def rounded(values: Array) -> Floats:
    """Return `values` as float32; values below the smallest normal float32 become zero."""
    found = np.asarray(values, dtype=np.float32)
    found[np.abs(found) < np.finfo(np.float32).tiny] = 0.0
    return found
