"""z of a finger that moves and turns over a height field.

Stage   CONTACT.
Model   The points of a finger are known at directions that are `turn_step` apart, beginning with that of the contact's
        line. At a direction between two of these, z is linear between the solutions at both. Each solution is that of
        `area_grid`. The most recently used directions are kept.
Source  Fagiani & Barbieri (2016), eq. 1. The directions are this project's.
Limits  With 1 degree between them, z of random and regular dots errs by 1 % (rms) of its peak-to-peak halfway between
        two directions, by 4 % at most; with a quarter of a degree by 0.7 % at most, and that is mostly the points'.
        A new direction takes the time of some hundred solutions.
"""

from __future__ import annotations

import math
from collections.abc import Hashable
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import pairwise
from typing import Any, Protocol

import numpy as np

from synth.arrays import Array
from synth.contact.area_grid import AreaGrid
from synth.contact.geometry import Geometry
from synth.contact.line import Line
from synth.contact.stiffness import Stiffness
from synth.surfaces.height_field import HeightField

TURN_STEP, COARSE_TURN_STEP = math.radians(0.25), math.radians(1.0)  # between two directions; coarse: for a live voice
DIRECTIONS = 32  # grids in memory, about 1 MB each: a hand that turns back and forth meets them again
ON_GRID = 1e-9  # of `turn_step`: a direction this near to one of the grids is that of the grid


class AreaContact(Protocol):
    """What this module reads of a contact on a height field."""

    @property
    def geometry(self) -> Geometry:
        """The finger, with a height field as its profile."""

    @property
    def stiffness(self) -> Stiffness:
        """Of eqs 4-5."""

    @property
    def line(self) -> Line:
        """Where the finger stands, and its direction."""

    @property
    def coarser(self) -> float:
        """Factor on the distance of its points."""

    @property
    def key(self) -> Hashable:
        """Everything that z depends on."""

    def heights(self, phases: Array, loads: Array, path: Array | None = None) -> Array:
        """Return z (m) at each of `phases` (turns) and `loads` (N, above 0), on its line or along a path."""

    def grid_at(self, direction: float) -> AreaGrid:
        """Return its points at another direction (rad), at the same y."""


def coarsened(contact: AreaContact, coarser: float) -> Any:
    """Return `contact`, a dataclass, with its points `coarser` times as far apart."""
    if contact.coarser == coarser:
        return contact
    return replace(contact, coarser=coarser)  # type: ignore[type-var]


def turned(contact: AreaContact, angle: float) -> Any:
    """Return `contact`, a dataclass, with its finger turned by `angle` (rad)."""
    line = contact.line._replace(direction=contact.line.direction + angle)
    return replace(contact, line=line)  # type: ignore[type-var]


@dataclass(frozen=True, slots=True)
class _Turned:
    """A contact at one of its directions, counted from its own."""

    key: Hashable
    number: int
    contact: AreaContact = field(compare=False)


@lru_cache(DIRECTIONS)
def _grid(one: _Turned) -> AreaGrid:
    return one.contact.grid_at(one.contact.line.direction + one.number * turn_step(one.contact))


def turn_step(contact: AreaContact) -> float:
    """Return the angle (rad) between the directions at which the points of `contact` are known."""
    return TURN_STEP if contact.coarser == 1.0 else COARSE_TURN_STEP


def heights_along(contact: AreaContact, phases: Array, loads: Array, path: Array) -> Array:
    """Return z (m) at each place of a path.

    phases: how far the texture has moved along x, turns.
    loads: N, above 0.
    path: how far it has moved across (m), and the direction of the finger (rad) [2, places].
    """
    texture, stiffness, line = contact.geometry.profile, contact.stiffness, contact.line
    assert isinstance(texture, HeightField)
    across = (path[0] + line.y) / texture.across
    indentation = stiffness.indentation(1.0) * loads**stiffness.load_exponent
    turns = (path[1] - line.direction) / turn_step(contact)
    if not len(phases):
        return np.empty(0)
    lower = np.floor(turns + ON_GRID).astype(np.int64)
    part = np.maximum(turns - lower, 0.0)
    part[part < 2.0 * ON_GRID] = 0.0
    z = np.empty(len(phases))
    numbers = [0, *(np.flatnonzero(np.diff(lower)) + 1).tolist(), len(phases)]
    for first, end in pairwise(numbers):
        run = slice(first, end)

        def solved(number: int, run: slice = run) -> Array:
            grid = _grid(_Turned(contact.key, number, contact))
            return grid.solve_places(phases[run], across[run], indentation[run]).height

        z[run] = solved(int(lower[first]))
        if part[run].any():
            z[run] += part[run] * (solved(int(lower[first]) + 1) - z[run])
    return z
