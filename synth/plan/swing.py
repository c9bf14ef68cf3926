"""The error of solutions of eq. 1 along a motion, measured on a finger that swings.

Stage   2 (PLAN). `direct_plan` reports this error.
Model   A finger swings by a cosine, up to a given speed. z over one swing is periodic, so its Fourier series gives the
        band exactly. z is solved at twice the usual rate. The band from every second solution differs from the band
        from all of them by what folds at the usual rate.
Source  design, section 8.
Limits  The error is that of one swing, at one place for each load.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from time import thread_time
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.response.table_error import QUANTITIES

SWING = 0.1  # s: a shorter swing passes less of the surface, a longer one delays the first sound
FOLD_POWER = 1.5  # the folded error falls at least with this power of the rate; kinks of order 3/2 give 2.5
MORE_FOLDS = 1.0 / (1.0 - 2.0**-FOLD_POWER)  # folded error at the usual rate, over its change at twice that rate


@dataclass(frozen=True, slots=True)
class Swing:
    """A finger that swings by a cosine, solved at twice the usual rate.

    rate: usual number of solutions per second.
    band: Hz.
    fastest: largest speed, m/s.
    across: motion across over motion along x, on a path over an area; 0 on a line.
    seconds: duration of a swing, s.
    """

    rate: float
    band: float
    fastest: float
    across: float = 0.0
    seconds: float = SWING

    @property
    def steps(self) -> int:
        """Number of solutions of a swing, even."""
        return 2 * math.ceil(self.seconds * self.rate)

    def heights(self, contact: Any, load: float, begin: float, turned_by: float = 0.0) -> Array:
        """Return z (m) of `contact` at `load` (N) over a swing about the phase `begin` (turns).

        turned_by: angle of the finger from its line, on a path over an area, rad.
        """
        reach = self.seconds * self.fastest / (2.0 * math.pi * math.hypot(1.0, self.across))
        turned = np.asarray(reach * np.cos(2.0 * math.pi * np.arange(self.steps) / self.steps))
        phases, loads = begin + turned / contact.geometry.texture_period, np.full(self.steps, load)
        if not self.across:
            return np.asarray(contact.heights(phases, loads))
        direction = np.full(self.steps, contact.line.direction + turned_by)
        return np.asarray(contact.heights(phases, loads, np.stack([self.across * turned, direction])))

    def curves(self, z: Array) -> Array:
        """Return z and its two time derivatives in the band, without the mean, SI [3, steps]."""
        series = np.fft.rfft(z)
        hertz = np.arange(len(series)) / self.seconds
        series[hertz > self.band] = series[0] = 0.0
        orders = np.arange(len(QUANTITIES))[:, np.newaxis]
        return np.asarray(np.fft.irfft(series * (2j * math.pi * hertz) ** orders, len(z)))


def folded_errors(contact: Any, swing: Swing, loads: tuple[float, ...]) -> tuple[Array, float]:
    """Return the folded error of each quantity in the band at the usual rate, and the time of a solution (s).

    The error is relative to the peak-to-peak at the same load, or at the scan's own load where that is larger.
    """
    changed, extents, seconds = [], [], 0.0
    for number, load in enumerate(loads):
        contact.heights(np.zeros(1), np.full(1, load))  # the first call builds caches, which the time leaves out
        started = thread_time()
        z = swing.heights(contact, load, (number + 0.5) / len(loads))
        seconds = max(seconds, (thread_time() - started) / swing.steps)
        fine = swing.curves(z)
        changed.append(np.max(np.abs(fine[:, ::2] - swing.curves(z[::2])), axis=1))
        extents.append(np.ptp(fine, axis=1))
    parts = relative(np.array(changed), np.maximum(extents, extents[1]))
    return MORE_FOLDS * np.max(parts, axis=0), seconds


def changed_by(contact: Any, better: Any, swing: Swing, load: float, begins: tuple[float, ...] = (0.5,)) -> Array:
    """Return the largest change of each quantity from `contact` to `better`, relative to its largest peak-to-peak.

    better: contact with a smaller error, to which `contact` is compared; None: the change is 0.
    begins: phase in the middle of each swing, turns.
    """
    if better is None:
        return np.zeros(len(QUANTITIES))
    found: Array = changes_to(better, (contact,), swing, load, begins)[0]
    return found


def changes_to(better: Any, contacts: Any, swing: Swing, load: float, begins: tuple[float, ...] = (0.5,)) -> Array:
    """Return `changed_by` of each of some contacts [contacts, quantities]. `better` is solved once for all of them."""
    changed, extents = np.zeros((len(contacts), len(QUANTITIES))), np.zeros(len(QUANTITIES))
    for begin in begins:
        after, *others = (swing.curves(swing.heights(one, load, begin)) for one in (better, *contacts))
        changed = np.maximum(changed, [np.max(np.abs(after - before), axis=1) for before in others])
        extents = np.maximum(extents, np.ptp(after, axis=1))
    return relative(changed, np.broadcast_to(extents, changed.shape))


def turning_errors(contact: Any, fine: Any, swing: Swing, load: float) -> Array:
    """Return what `turning_changes` does, relative to the peak-to-peak of each quantity."""
    return relative(*turning_changes(contact, fine, swing, load))


def turning_changes(contact: Any, fine: Any, swing: Swing, load: float) -> tuple[Array, Array]:
    """Return the error of each quantity for a finger between two directions, and its peak-to-peak, SI.

    The finger has the angle at which the overlap of two directions of `area_path` begins.

    fine: the same contact in cells that are as small or smaller, against which the error is measured.
    """
    from synth.contact.area_path import OVERLAP, TURN_STEP, turned

    angle = 0.5 * (1.0 - OVERLAP) * TURN_STEP
    between = swing.curves(swing.heights(contact, load, 0.5, angle))
    exact = swing.curves(swing.heights(turned(fine, angle), load, 0.5))
    return np.max(np.abs(between - exact), axis=1), np.ptp(exact, axis=1)


def relative(change: Array, extent: Array) -> Array:
    """Return `change` / `extent`, 0 where the extent is 0."""
    return np.asarray(np.divide(change, extent, where=extent > 0.0, out=np.zeros_like(extent)))
