"""z of a finger that moves and turns over a height field.

Stage   CONTACT.
Model   The cells of a finger are prepared at directions TURN_STEP apart, counted from that of the contact's line. At a
        direction between two of these, the blocks of the nearer one are moved about the middle of the finger
        (`area_grid`). In the OVERLAP halfway between both, z is solved for both and cross-faded. The most recently used
        directions are kept in PARTS, and the last RECENT also by the contact itself, for a map that is too large for
        PARTS.
Source  Fagiani & Barbieri (2016), eq. 1. The directions are this project's.
Limits  Halfway between two directions, z of square dots differs from that of cells prepared at that direction by at
        most 1 % of its peak-to-peak. To prepare a new direction takes the time of some hundred solutions.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Hashable
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import Any, Protocol, Self

import numpy as np

from synth.arrays import Array
from synth.contact.area_grid import AreaGrid
from synth.contact.geometry import Geometry
from synth.contact.line import Line
from synth.response_cache import PARTS
from synth.surfaces.height_field import HeightField

TURN_STEP = math.radians(1.0)  # between two directions
OVERLAP = 0.1  # of TURN_STEP: here z is solved for both; with less, the change between lattices is heard as a step
RECENT = 4  # directions, about 1 MB each: a block has two at most, and a hand trembles between two or three


class AreaContact(Protocol):
    """What this module reads of a contact on a height field."""

    @property
    def geometry(self) -> Geometry:
        """The finger, with a height field as its profile."""

    @property
    def of_any_direction(self) -> bool:
        """Whether z does not change when the finger turns."""

    @property
    def line(self) -> Line:
        """Where the finger stands, and its direction."""

    @property
    def coarser(self) -> float:
        """Factor on the size of its cells."""

    @property
    def key(self) -> Hashable:
        """Everything that z depends on."""

    def indentations(self, loads: Array) -> Array:
        """Return w / k (m) at each of `loads` (N)."""

    def heights(self, phases: Array, loads: Array, path: Array | None = None) -> Array:
        """Return z (m) at each of `phases` (turns) and `loads` (N, above 0), on its line or along a path."""

    def halved(self) -> Self | None:
        """Return the contact with cells half as large; None where they would be too many."""

    def grid_at(self, direction: float) -> AreaGrid:
        """Return its cells at another direction (rad), at the same y."""

    @property
    def recent(self) -> deque[AreaGrid]:
        """The last RECENT directions that were solved."""


def coarsened(contact: AreaContact, coarser: float) -> Any:
    """Return `contact`, a dataclass, with cells `coarser` times as large as usual."""
    if contact.coarser == coarser:
        return contact
    return replace(contact, coarser=coarser)  # type: ignore[type-var]


def turned(contact: AreaContact, angle: float) -> Any:
    """Return `contact`, a dataclass, with its finger turned by `angle` (rad)."""
    line = contact.line._replace(direction=contact.line.direction + angle)
    return replace(contact, line=line)  # type: ignore[type-var]


def _grid(contact: AreaContact, number: int) -> AreaGrid:
    """Return the cells at `number` times TURN_STEP from the direction of `contact`."""
    direction = contact.line.direction + number * TURN_STEP
    grid: AreaGrid = PARTS.get((_grid, contact.key, number), partial(contact.grid_at, direction))
    contact.recent.append(grid)
    return grid


def heights_along(contact: AreaContact, phases: Array, loads: Array, path: Array) -> Array:
    """Return z (m) at each place of a path.

    phases: how far the texture has moved along x, turns.
    loads: N, above 0.
    path: how far it has moved across (m), and the direction of the finger (rad) [2, places].
    """
    texture, line = contact.geometry.profile, contact.line
    assert isinstance(texture, HeightField)
    across = (path[0] + line.y) / texture.across
    indentation = contact.indentations(loads)
    turns = (path[1] - line.direction) / TURN_STEP * (not contact.of_any_direction)
    if not len(phases):
        return np.empty(0)
    lower = np.floor(turns).astype(np.int64)
    beyond = (turns - lower - 0.5) / OVERLAP + 0.5  # 0 to 1 in the overlap
    part = np.clip(beyond, 0.0, 1.0) ** 2 * (3.0 - 2.0 * np.clip(beyond, 0.0, 1.0))
    z = np.zeros(len(phases))
    numbers = [0, *(np.flatnonzero(np.diff(lower)) + 1).tolist(), len(phases)]
    for first, end in pairwise(numbers):
        for number, share in ((int(lower[first]), 1.0 - part), (int(lower[first]) + 1, part)):
            some = first + np.flatnonzero(share[first:end])
            if len(some):
                grid, angles = _grid(contact, number), (turns[some] - number) * TURN_STEP
                solved = grid.solve_places(phases[some], across[some], indentation[some], turns=angles)
                z[some] += share[some] * solved.height
    return z
