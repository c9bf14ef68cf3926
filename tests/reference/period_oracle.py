"""One whole period of a function of phase to a stated error, with kinks, by adaptive Chebyshev panels.

Method  Panels of Chebyshev nodes. A panel is halved and its halves are solved, until its own polynomial agrees with the
        solution at the nodes of the halves. So panels shrink towards the kinks at which patches touch down, and the
        cost grows with the logarithm of the accuracy. The required error is that of Fourier coefficients, which is the
        area between polynomial and function: a panel's error counts times its width.
Limits  A feature narrower than 1/16 of a first panel, which ends as it began, can be missed: with 64 panels, one
        shorter than 1e-3 turn. Such a short patch moves z by less than 1e-8 of the amplitudes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Real = npt.NDArray[np.float64]
#: From phases in [0, 1) to values, one each.
Response = Callable[[Real], Real]

#: Chebyshev nodes per panel.
NODES = 16
#: A narrower panel is not halved: its share of any coefficient is below round-off.
NARROWEST = 1e-9
_ANGLES = np.pi * (np.arange(NODES) + 0.5) / NODES
_POINTS = (1 - np.cos(_ANGLES)) / 2  # the nodes of the panel [0, 1], ascending
_ORDERS = np.arange(NODES)
#: Values at the nodes (ascending) to Chebyshev coefficients.
_TO_COEFFICIENTS = (2 / NODES) * np.cos(np.outer(_ORDERS, np.pi - _ANGLES))
_TO_COEFFICIENTS[0] /= 2


def _series(coefficients: Real, place: Real) -> Real:
    """Chebyshev series by Clenshaw; coefficients [..., NODES], place in [0, 1] of shape [...]."""
    x = 2 * place - 1
    ahead = np.zeros_like(x)
    further = np.zeros_like(x)
    for order in range(NODES - 1, 0, -1):
        ahead, further = coefficients[..., order] + 2 * x * ahead - further, ahead
    return np.asarray(coefficients[..., 0] + x * ahead - further)


@dataclass(frozen=True)
class Period:
    """Panels [left, left + width) that cover [0, 1) once, ascending.

    coefficients: [panels, NODES].
    error: per panel.
    """

    left: Real
    width: Real
    coefficients: Real
    error: Real

    def at(self, theta: npt.ArrayLike) -> Real:
        """Values at any phases (turns, taken modulo one)."""
        phase = np.mod(np.asarray(theta, dtype=float), 1.0)
        phase = np.where(phase >= 1.0, 0.0, phase)
        panel = np.searchsorted(self.left, phase, side="right") - 1
        return _series(self.coefficients[panel], (phase - self.left[panel]) / self.width[panel])

    def dense(self, points: int) -> Real:
        """Values at the phases j / points."""
        block = 1 << 16
        parts = [self.at(np.arange(start, min(start + block, points)) / points) for start in range(0, points, block)]
        return np.concatenate(parts)


def start_period(response: Response, panels: int = 64) -> Period:
    """A period of equal panels, with unknown error (inf)."""
    left = np.arange(panels) / panels
    width = np.full(panels, 1.0 / panels)
    values = response((left[:, None] + width[:, None] * _POINTS).ravel()).reshape(panels, NODES)
    return Period(left, width, values @ _TO_COEFFICIENTS.T, np.full(panels, np.inf))


def refine(period: Period, response: Response, tolerance: float) -> Period:
    """Halve panels until the error of each Fourier coefficient is at most about ``tolerance`` (units of the response).

    A panel is good when error * width <= tolerance / 100, or when it is NARROWEST.
    """
    while True:
        bad = (period.error * period.width > tolerance / 100) & (period.width > NARROWEST)
        if not bad.any():
            return period
        halves = _halve(period, response, np.flatnonzero(bad))
        fields = zip(
            (period.left, period.width, period.coefficients, period.error),
            (halves.left, halves.width, halves.coefficients, halves.error),
            strict=True,
        )
        left, width, coefficients, error = (np.concatenate([old[~bad], new]) for old, new in fields)
        order = np.argsort(left)
        period = Period(left[order], width[order], coefficients[order], error[order])


def _halve(period: Period, response: Response, panels: npt.NDArray[np.intp]) -> Period:
    """Both halves of ``panels``, solved, each with the error of its parent's polynomial."""
    parent = np.repeat(panels, 2)
    second = np.tile([0.0, 0.5], panels.size)
    width = period.width[parent] / 2
    left = period.left[parent] + second * period.width[parent]
    values = response((left[:, None] + width[:, None] * _POINTS).ravel()).reshape(parent.size, NODES)
    place = second[:, None] + _POINTS / 2
    said = _series(np.repeat(period.coefficients[parent][:, None, :], NODES, axis=1), place)
    return Period(left, width, values @ _TO_COEFFICIENTS.T, np.max(np.abs(said - values), axis=1))
