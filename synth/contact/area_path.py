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
from collections.abc import Callable, Hashable
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import Any, NamedTuple, Protocol, Self

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

    @property
    def grid(self) -> Any:
        """Its cells at the direction of its line."""

    def indentations(self, loads: Array) -> Array:
        """Return w / k (m) at each of `loads` (N)."""

    def sizes(self, loads: Array) -> Array | None:
        """Return the size of the finger at each of `loads` (N), see `AreaGrid.finger`; None: that of its cells."""

    def on_line(self, line: Line) -> Self:
        """Return the contact of the same finger on another line."""

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


def turned(contact: Any, angle: float) -> Any:
    """Return `contact`, or a force of it, with its finger turned by `angle` (rad)."""
    return contact.on_line(contact.line._replace(direction=contact.line.direction + angle))


def _grid(contact: AreaContact, number: int) -> AreaGrid:
    """Return the cells at `number` times TURN_STEP from the direction of `contact`."""
    if number == 0:
        own: AreaGrid = contact.grid
        return own
    direction = contact.line.direction + number * TURN_STEP
    grid: AreaGrid = PARTS.get((_grid, contact.key, number), partial(contact.grid_at, direction))
    contact.recent.append(grid)
    return grid


class Places(NamedTuple):
    """Places of a finger in one of its directions.

    phases, across: how far the texture has moved along (turns) and across (periods).
    loads: N.
    turns: angle by which the finger is turned from that direction, rad.
    """

    phases: Array
    across: Array
    loads: Array
    turns: Array


Read = Callable[[AreaGrid, Places], Array]
"""Returns a value at each of some places."""


def solved_at(contact: AreaContact, grid: AreaGrid, at: Places) -> Array:
    """Return z (m) at some places."""
    indentations, sizes = contact.indentations(at.loads), contact.sizes(at.loads)
    return grid.solve_places(at.phases, at.across, indentations, turns=at.turns, sizes=sizes).height


def heights_along(contact: AreaContact, phases: Array, loads: Array, path: Array | None) -> Array:
    """Return z (m) at each place; the arguments are those of `read_along`."""
    return read_along(contact, phases, loads, path, partial(solved_at, contact))


def read_along(contact: AreaContact, phases: Array, loads: Array, path: Array | None, read: Read) -> Array:
    """Return a value at each place of a path.

    phases: how far the texture has moved along x, turns.
    loads: N, above 0.
    path: how far it has moved across (m), and the direction of the finger (rad) [2, places]; None: on its line.
    read: returns the values in one direction.
    """
    if path is None:
        none = np.zeros(len(phases))
        return read(contact.grid, Places(phases, none, loads, none))
    texture, line = contact.geometry.profile, contact.line
    assert isinstance(texture, HeightField)
    across = (path[0] + line.y) / texture.across
    turns = (path[1] - line.direction) / TURN_STEP * (not contact.of_any_direction)
    if not len(phases):
        return np.empty(0)
    lower = np.floor(turns).astype(np.int64)
    beyond = (turns - lower - 0.5) / OVERLAP + 0.5  # 0 to 1 in the overlap
    part = np.clip(beyond, 0.0, 1.0) ** 2 * (3.0 - 2.0 * np.clip(beyond, 0.0, 1.0))
    values = np.zeros(len(phases))
    numbers = [0, *(np.flatnonzero(np.diff(lower)) + 1).tolist(), len(phases)]
    for first, end in pairwise(numbers):
        for number, share in ((int(lower[first]), 1.0 - part), (int(lower[first]) + 1, part)):
            some = first + np.flatnonzero(share[first:end])
            if len(some):
                angles = (turns[some] - number) * TURN_STEP
                at = Places(phases[some], across[some], loads[some], angles)
                values[some] += share[some] * read(_grid(contact, number), at)
    return values
