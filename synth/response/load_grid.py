"""The load grid of a table: the loads at which z is solved, and the cubic between two of them.

Stage   RESPONSE, before the table.
Model   The first rows are 0 N (the envelope of the crests) and octaves up to the heaviest load; intervals are halved
        where the measured error is too large. Between two rows z is the cubic through both values and slopes dz/dw.
Source  design, sections 1 and 8; Hermite interpolation.
Limits  Where a patch of contact is born, z has a kink of order 3/2 in the load: the order of the cubic falls from 4 to
        3/2 there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from synth.arrays import Array

if TYPE_CHECKING:
    from synth.contact.forces import Response

OCTAVES = 10  # fewest octaves below the heaviest load; with fewer, light loads err more
LIGHTEST = 0.005  # N: the octaves reach down to this load at least
NO_LOAD = 1e-6  # of the lightest load: dz/dw of the row at 0 N is a limit, computed at this load
DIGITS = 40  # bisection steps that find where full contact begins


@dataclass(frozen=True, slots=True)
class SolvedRows:
    """Solved rows of the load grid.

    loads: N, rising [rows].
    heights: z at equal steps of place, m [rows, phases].
    slopes: dz/dw at the same places, m/N [rows, phases].
    """

    loads: Array
    heights: Array
    slopes: Array

    def joined(self, other: SolvedRows) -> SolvedRows:
        """Return the rows of both, in order of load."""
        loads = np.concatenate([self.loads, other.loads])
        order = np.argsort(loads, kind="stable")
        heights = np.concatenate([self.heights, other.heights])[order]
        return SolvedRows(loads[order], heights, np.concatenate([self.slopes, other.slopes])[order])


def heaviest_row(response: Response, heaviest: float) -> tuple[float, bool]:
    """Return the load of the last row (N), at most `heaviest`, and whether the contact is full from that load on."""
    if response.closed(heaviest) is None:
        return heaviest, False
    light, full = 0.0, heaviest
    for _ in range(DIGITS):
        middle = 0.5 * (light + full)
        light, full = (middle, full) if response.closed(middle) is None else (light, middle)
    return min(heaviest, float(np.float32(full * (1.0 + 1e-6)))), True


def first_loads(heaviest: float) -> Array:
    """Return the first loads (N) of every table: 0, and octaves up to `heaviest`."""
    octaves = max(OCTAVES, math.ceil(math.log2(heaviest / LIGHTEST)))
    return np.concatenate([[0.0], heaviest * 2.0 ** np.arange(-octaves, 1.0)])


def halfway(low: SolvedRows, high: SolvedRows) -> Array:
    """Return z (m) halfway between each row of `low` and the same row of `high`, from the cubic [rows, phases]."""
    widths = (high.loads - low.loads)[:, np.newaxis]
    return np.asarray(0.5 * (low.heights + high.heights) + 0.125 * widths * (low.slopes - high.slopes))


def solved_rows(response: Response, loads: Array, phases: int, guess: Array | None = None) -> SolvedRows:
    """Return the rows at `loads` (N), solved at `phases` equal steps of place.

    guess: z (m) that the solver starts from [loads, phases].
    """
    places = np.arange(phases) / phases
    lightest = NO_LOAD * float(np.min(loads[loads > 0.0], initial=1.0))
    rows = [
        response.approach(places, max(float(load), lightest), None if guess is None else guess[i])
        for i, load in enumerate(loads)
    ]
    return SolvedRows(np.asarray(loads), np.array([row[0] for row in rows]), np.array([row[1] for row in rows]))
