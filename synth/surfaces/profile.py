"""A profile: the heights of a surface along a line, repeated with a period.

Stage   SURFACES: between the scene and the contact.
Model   h(x) is in metres, positive towards the finger, with mean 0 over a period. A scene's `phase` phi shifts
        every kind in the same way: h(x) = base(x + phi period / (2 pi)).
        Each profile has an equivalent sinusoid, with the same Rq (root mean square height) and the same rms slope:
        a = sqrt(2) Rq, lambda = 2 pi Rq / (rms slope). In eqs 4-7, a and lambda replace a2 and lambda2.
Source  Fagiani & Barbieri (2016), eqs 2-7, for one cosine. The equivalent sinusoid is this project's choice.
Limits  Periodic; one line along the direction of scanning.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Hashable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

Array = np.ndarray[Any, np.dtype[np.float64]]

NO_CORNERS: Array = np.empty(0)
NO_CORNERS.setflags(write=False)


@dataclass(frozen=True, slots=True)
class Cosine:
    """A profile in closed form: amplitude cos(2 pi x / period + phase).

    amplitude, period: m.
    phase: rad.
    """

    amplitude: float
    period: float
    phase: float = 0.0


class Bounds(NamedTuple):
    """Bounds of the heights and their derivatives.

    lowest, highest: of the height, m.
    slope: of |dh/dx|.
    curvature: of |d2h/dx2|, 1/m; infinite for a profile with corners.
    """

    lowest: float
    highest: float
    slope: float
    curvature: float


class Profile(ABC):
    """Heights of a periodic surface along a line, positive towards the finger. A profile is immutable.

    kind: its name in `texture.kind`.
    period: m.
    straight: whether it is straight between its corners.
    of_area: whether it is a height field, which varies across the scan.
    """

    kind: str
    period: float
    straight = False
    of_area = False

    @property
    @abstractmethod
    def key(self) -> Hashable:
        """Everything that decides the heights, for a cache and for comparisons."""

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Profile) and self.key == other.key

    def __hash__(self) -> int:
        return hash(self.key)

    @abstractmethod
    def heights(self, places: Array) -> Array:
        """Return the heights (m) at `places` (m, any shape, any range), in the same shape."""

    @property
    @abstractmethod
    def bounds(self) -> Bounds:
        """Bounds of the heights and their derivatives."""

    @property
    def extent(self) -> tuple[float, float]:
        """Bounds of the heights (m), lowest and highest."""
        return self.bounds[:2]

    @property
    def slope_bound(self) -> float:
        """Bound of |dh/dx|."""
        return self.bounds.slope

    @property
    def curvature_bound(self) -> float:
        """Bound of |d2h/dx2| (1/m)."""
        return self.bounds.curvature

    @property
    def corners(self) -> Array:
        """Places (m) in [0, period), rising, where the slope has a step; empty for a smooth profile."""
        return NO_CORNERS

    @property
    def cosine(self) -> Cosine | None:
        """The closed form of a profile that is one cosine of its own period, else None."""
        return None

    @property
    @abstractmethod
    def rms(self) -> tuple[float, float]:
        """Rq (m) and the root mean square of the slope, over a period."""

    def equivalent(self) -> Cosine:
        """Return the sinusoid of equal Rq and rms slope. For a flat profile it has amplitude 0 and the same period."""
        height, slope = self.rms
        if not height or not slope:
            return Cosine(0.0, self.period)
        return Cosine(math.sqrt(2.0) * height, 2.0 * math.pi * height / slope)


def turns_of(places: Array, period: float, phase: float) -> Array:
    """Return the positions of `places` (m) within a period, 0 to 1 turn, on a surface shifted by `phase` (rad)."""
    turns = (np.asarray(places, np.float64) / period + phase / (2.0 * math.pi)) % 1.0
    return np.where(turns >= 1.0, 0.0, turns)  # the remainder of a tiny negative number rounds to 1


def places_of(turns: Array, period: float, phase: float) -> Array:
    """Return the places (m) in [0, period), rising, of the positions `turns` on a surface shifted by `phase` (rad)."""
    return np.sort((np.asarray(turns, np.float64) - phase / (2.0 * math.pi)) % 1.0 % 1.0) * period
