"""A height field: the heights of a surface over an area, repeated in both directions.

Stage   SURFACES.
Model   h(x, y) is in metres, positive towards the finger, with mean 0 over a period of both directions. x is along the
        scan and y across it. A scene's `phase` shifts x, as for a profile. Where a profile is required, a height field
        gives the heights of its line y = 0, but bounds, Rq and rms slope of the whole area.
Limits  Periodic in x and y.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from typing import Any

import numpy as np

from synth.surfaces.profile import Array, Profile

Floats = np.ndarray[Any, np.dtype[np.float32]]

ROWS_TOGETHER = 1 << 20  # heights that are computed at a time: 8 MB


class HeightField(Profile):
    """Heights over an area. A height field is immutable.

    across: period in y, m; `period` is that in x.
    random: whether it is a sum of many waves of random phase.
    """

    of_area = True
    random = False
    across: float

    @abstractmethod
    def area(self, x: Array, y: Array) -> Array:
        """Return the heights (m) at every pair of `x` and `y` (m, one dimension each): [len(y), len(x)]."""

    @property
    @abstractmethod
    def slope_across(self) -> float:
        """Bound of |dh/dy|."""

    def heights(self, places: Array) -> Array:
        """Return the heights (m) of the line y = 0 at `places` (m, any shape)."""
        flat = np.ravel(np.asarray(places, np.float64))
        return np.asarray(self.area(flat, np.zeros(1))[0].reshape(np.shape(places)))

    def lines(self, x: Array) -> Callable[[Array], Floats]:
        """Return a function of y (m) that returns the heights (m) at every pair: float32 [len(y), len(x)]."""
        return lambda y: self.area(x, y).astype(np.float32)

    def lattice(self, x: Array, y: Array) -> Floats:
        """Return the heights (m) at every pair of `x` and `y` (m): float32 [len(y), len(x)]."""
        found, lines = np.empty((len(y), len(x)), np.float32), self.lines(x)
        step = max(1, ROWS_TOGETHER // len(x))
        for first in range(0, len(y), step):
            found[first : first + step] = lines(y[first : first + step])
        return found
