"""Heights measured or drawn elsewhere, as arrays that scenes name by their content.

Stage   SURFACES. A reader of files or a store provides the arrays; `measured` and `heightmap` make textures of them.
Model   The address of a surface is a hash of its heights and spacing, so a scene that names it always means the same
        surface. A process looks for an address first among the surfaces that it has read itself, then in its sources,
        such as a store.
Limits  A surface that was read here stays in memory until the process ends. A source manages the memory of its own.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from typing import Any

import numpy as np

Heights = np.ndarray[Any, np.dtype[np.float32]]


@dataclass(frozen=True, eq=False)
class SurfaceData:
    """Heights of a surface at equal distances, along a line or over an area. Immutable.

    heights: float32 [n], or [rows, columns] with x along the columns, m, positive towards the finger; all are finite.
    spacing: m, distance between neighbouring columns (x), then, for an area, between neighbouring rows (y).
    """

    heights: Heights
    spacing: tuple[float, ...]

    @cached_property
    def address(self) -> str:
        """SHA-256 of shape, spacing and heights, as 64 hexadecimal digits."""
        digest = sha256(f"{self.heights.shape} {self.spacing!r}".encode())
        digest.update(np.ascontiguousarray(self.heights, dtype="<f4").data)
        return digest.hexdigest()

    @property
    def nbytes(self) -> int:
        """Size of the heights in bytes."""
        return self.heights.nbytes


Source = Callable[[str], SurfaceData | None]

_read: dict[str, SurfaceData] = {}
_sources: list[Source] = []


def remember(data: SurfaceData) -> str:
    """Keep `data` in this process, and return its address."""
    return _read.setdefault(data.address, data).address


def add_source(source: Source) -> None:
    """Look up addresses that were not read in this process in `source`. It returns None for an unknown address."""
    if source not in _sources:
        _sources.append(source)


def remove_source(source: Source) -> None:
    """Stop looking up addresses in `source`."""
    if source in _sources:
        _sources.remove(source)


def surface_at(address: str) -> SurfaceData | None:
    """Return the surface with `address`, or None where this process cannot find it."""
    if address in _read:
        return _read[address]
    return next((found for source in _sources if (found := source(address)) is not None), None)
