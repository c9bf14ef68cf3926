"""The layered table: z of a finger on a height field at all places (x, y) and loads, for a hand that moves anywhere.

Stage   RESPONSE: its result, over an area.
Model   z(p, q, w) = m(u) + s(p, q, u),   u = w^(1/4)

        m is the mean of z over the surface, and s the rest, whose mean is 0. Both are cubic B-splines over u with
        equally spaced nodes; those of m are closer. s is a cubic B-spline over p and q, too. Its coefficients are
        16-bit numbers with one scale per row of load, and those of all loads at one place are neighbours in memory.
        `layered_making` makes the table.
Source  Unser, Splines: a perfect fit for signal and image processing (1999).
Limits  A load outside `loads` is read as the nearest one inside. Waves over place that are shorter than two places of
        the lattice are absent. `errors` are measured, not proven (`layered_making`).
        For a map of 2,000 x 2,000 heights, 25 um apart, under a fingertip, the table has 1,000 x 960 places and 50 MB.
        Making it takes 3.3 s of one core, reading 57 ns per place along a scan. In three scans at 100 mm/s, up to
        1 kHz, displacement errs by 0.7 % of its peak-to-peak, velocity by 5 %, and acceleration by 25 %
        (`python -m tests.bench layered`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.response.layered_reading import PADDING, read_heights, read_means

Shorts = np.ndarray[Any, np.dtype[np.int16]]


@dataclass(frozen=True, eq=False)
class LayeredTable:
    """z of one contact on a height field, its finger in one direction. It is immutable.

    loads: N, rising [rows], at equal distances of u.
    curve: coefficients of m, m.
    coefficients: of s, int16 [places across + PADDING, places along + PADDING, rows + 2].
    scales: m per unit of `coefficients` [rows + 2].
    swings: peak-to-peak of z over the surface, m [rows].
    errors: error of z between two rows, m [rows - 1]; twice the largest that was measured near them.
    below, above: bounds of the error that the layers cause, m [rows]. For the points on the lattice, z is at most this
        far below and above that of the table.
    """

    loads: Array
    curve: Array
    coefficients: Shorts
    scales: Array
    swings: Array
    errors: Array
    below: Array
    above: Array

    @property
    def places(self) -> tuple[int, int]:
        """Places along and across, per period of the texture."""
        rows, columns, _loads = self.coefficients.shape
        return columns - PADDING, rows - PADDING

    @property
    def memory_bytes(self) -> int:
        """Memory in bytes."""
        own = (self.loads, self.curve, self.scales, self.swings, self.errors, self.below, self.above)
        return self.coefficients.nbytes + sum(one.nbytes for one in own)

    def heights(self, phases: Array, across: Array, loads: Array) -> Array:
        """Return z (m) at each place of a path.

        phases, across: how far the texture has moved along and across, in periods, as in `AreaGrid.solve_places`.
        loads: N.
        All three have one dimension and one length. Raises ValueError if they do not.
        """
        place, beside, load = (np.ascontiguousarray(one, np.float64) for one in (phases, across, loads))
        if place.ndim != 1 or not place.shape == beside.shape == load.shape:
            raise ValueError(f"phases, across and loads have shapes {place.shape}, {beside.shape} and {load.shape}.")
        found = np.empty(len(place))
        read_heights(self.coefficients, self.scales, self.curve, self._ends, place, beside, load, found)
        return found

    def mean(self, loads: Array) -> Array:
        """Return the mean of z over the surface (m) at each of `loads` (N)."""
        found = np.empty(len(loads))
        read_means(self.curve, self._ends, np.ascontiguousarray(loads, np.float64), found)
        return found

    def error_at(self, load: float) -> float:
        """Return the largest error of z (m) at `load` (N)."""
        return float(self.errors[self._interval(load)])

    def bracket_at(self, load: float) -> tuple[float, float]:
        """Return the largest distances (m) of z below and above that of the table, at `load` (N).

        Each is the bound for the points on the lattice plus the measured error, which covers all other errors.
        """
        interval = self._interval(load)
        below, above = (float(one[interval : interval + 2].max()) for one in (self.below, self.above))
        return below + float(self.errors[interval]), above + float(self.errors[interval])

    def _interval(self, load: float) -> int:
        return int(np.clip(np.searchsorted(self.loads, load, side="right") - 1, 0, len(self.loads) - 2))

    @property
    def _ends(self) -> Array:
        return self.loads[[0, -1]]
