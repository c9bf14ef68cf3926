"""The rows of load of a table: where z is solved, and the cubic between two rows.

Stage   RESPONSE, before the table.
Model   Rows begin at 0 N (the envelope of the crests), then an octave apart up to the heaviest load; intervals are
        halved where the measured error asks. Between two rows z is the cubic through both values and slopes dz/dw.
Source  design, sections 1 and 8; Hermite interpolation.
Limits  kinks of order 3/2 in the load, where a patch is born, lower the order of the cubic from 4 to 3/2 there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from synth.arrays import Array
from synth.contact.forces import Response

OCTAVES = 10  # of load below the heaviest that have rows of their own at least; fewer err more at light loads
LIGHTEST = 0.005  # N: octaves reach down to it at least, however heavy the heaviest
NO_LOAD = 1e-6  # of the lightest octave: where dz/dw of the row at 0 N is taken, which has a limit there
DIGITS = 40  # halvings of the range of loads that find where full contact begins


@dataclass(frozen=True, slots=True)
class SolvedRows:
    """Rows of load, rising.

    loads: N [rows]. heights, slopes: z (m) and dz/dw (m/N) at equal steps of place [rows, phases].
    """

    loads: Array
    heights: Array
    slopes: Array

    def joined(self, other: SolvedRows) -> SolvedRows:
        """Return the rows of both, in order."""
        loads = np.concatenate([self.loads, other.loads])
        order = np.argsort(loads, kind="stable")
        heights = np.concatenate([self.heights, other.heights])[order]
        return SolvedRows(loads[order], heights, np.concatenate([self.slopes, other.slopes])[order])


def heaviest_row(response: Response, heaviest: float) -> tuple[float, bool]:
    """Return the last row (N), at most `heaviest`, and whether the contact is full, in closed form, from there on."""
    if response.closed(heaviest) is None:
        return heaviest, False
    light, full = 0.0, heaviest
    for _ in range(DIGITS):
        middle = 0.5 * (light + full)
        light, full = (middle, full) if response.closed(middle) is None else (light, middle)
    return min(heaviest, float(np.float32(full * (1.0 + 1e-6)))), True


def first_loads(heaviest: float) -> Array:
    """Return the rows (N) that every table begins with: none, and octaves up to `heaviest`."""
    octaves = max(OCTAVES, math.ceil(math.log2(heaviest / LIGHTEST)))
    return np.concatenate([[0.0], heaviest * 2.0 ** np.arange(-octaves, 1.0)])


def halfway(low: SolvedRows, high: SolvedRows) -> Array:
    """Return z (m) of the cubic in the middle between each row of `low` and that of `high` [rows, phases]."""
    widths = (high.loads - low.loads)[:, np.newaxis]
    return np.asarray(0.5 * (low.heights + high.heights) + 0.125 * widths * (low.slopes - high.slopes))


def solved_rows(response: Response, loads: Array, phases: int, guess: Array | None = None) -> SolvedRows:
    """Return the rows at `loads` (N) at `phases` equal steps of place; guess: z to begin from [loads, phases]."""
    places = np.arange(phases) / phases
    lightest = NO_LOAD * float(np.min(loads[loads > 0.0], initial=1.0))
    rows = [
        response.approach(places, max(float(load), lightest), None if guess is None else guess[i])
        for i, load in enumerate(loads)
    ]
    return SolvedRows(np.asarray(loads), np.array([row[0] for row in rows]), np.array([row[1] for row in rows]))
