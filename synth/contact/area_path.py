"""The contacts of fingers over a height field, and z of one that moves and turns there.

Stage   CONTACT.
Model   A finger moves along x. On a height field it stands at y, and its length is turned by an angle from x.
        The cells of a finger are prepared at directions TURN_STEP apart, counted from that of the contact's line. At a
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
from abc import abstractmethod
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import pairwise
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Self

import numpy as np

from synth.arrays import Array
from synth.contact.load_balance import Contact, FullContact, PhaseSolver
from synth.response_cache import PARTS
from synth.surfaces.height_field import HeightField

if TYPE_CHECKING:
    from synth.contact.area_grid import AreaGrid

TURN_STEP = math.radians(1.0)  # between two directions
OVERLAP = 0.1  # of TURN_STEP: here z is solved for both; with less, the change between lattices is heard as a step
RECENT = 4  # directions, about 1 MB each: a block has two at most, and a hand trembles between two or three


SETTLES = 0.25  # part of the error that remains when the cells are halved: the error is of second order
BEGINS_OVER_AREA = 1.0 / 3.0  # `Contact.begins`: a quarter was too little for 2 of 14 scenes over dots


class Line(NamedTuple):
    """Where a finger stands across a height field.

    y: place of its middle, m.
    direction: angle of its length from x, rad, counter-clockwise.
    """

    y: float = 0.0
    direction: float = 0.0


MIDDLE = Line()


@dataclass(frozen=True)
class ContactOnArea(Contact):
    """A finger of one shape on a height field. Its stiffness may depend on the load.

    line: where the finger stands.
    coarser: factor on the size of the cells.
    refines: whether `refined` makes them smaller, which files require.
    """

    of_one_line = False
    settles, begins = SETTLES, BEGINS_OVER_AREA
    line: Line = MIDDLE
    coarser: float = 1.0
    refines: bool = False

    @property
    @abstractmethod
    def lattice(self) -> tuple[tuple[float, float], float]:
        """Length and width that the cells cover, and the shortest length that they resolve, as `lattice_step` has it.

        Both in m.
        """

    @property
    def own_size(self) -> tuple[float, float]:
        """Length and width (m) of the region in which it may touch."""
        return self.lattice[0]

    @cached_property
    def grid(self) -> PhaseSolver:
        """Its cells; the profile of its geometry must be a height field."""
        return self.grid_at(self.line.direction)

    @cached_property
    def recent(self) -> deque[AreaGrid]:
        """The last RECENT directions that were solved."""
        return deque(maxlen=RECENT)

    @abstractmethod
    def grid_at(self, direction: float) -> AreaGrid:
        """Return its cells at another direction (rad)."""

    def heights(self, phases: Array, loads: Array, path: Array | None = None) -> Array:
        """Return z (m) at each of `phases` (turns) and `loads` (N, above 0), on its line or along a path.

        path: how far the texture has moved across (m), and the direction of the finger (rad) [2, phases].
        """
        return heights_along(self, phases, loads, path)

    def sizes(self, loads: Array) -> Array | None:
        """Return the size of the finger at each of `loads` (N), see `AreaGrid.finger`; None: it has one size."""
        return None

    hard_edges: ClassVar[bool]
    """Whether the finger ends at the edges of the region in which it may touch."""

    @abstractmethod
    def own_heights(self, x: Array, y: Array) -> Array:
        """Return its height (m) at every pair of `x` and `y` (m) from its middle, along and across it.

        A step beyond the region in which it may touch is asked for too.
        """

    @property
    @abstractmethod
    def own_area(self) -> float:
        """Area (m^2) to which its stiffness belongs."""

    def areas(self, loads: Array) -> Array:
        """Return the area (m^2) to which its stiffness belongs, at each of `loads` (N)."""
        return np.full(len(loads), self.own_area)

    def on_line(self, line: Line) -> Self:
        """Return the contact of the same finger on another line."""
        return replace(self, line=line)

    @property
    def own_middle(self) -> float:
        """x of its middle, m."""
        return 0.5 * self.geometry.contact_length

    def as_profile(self) -> Self:
        """Return the contact itself."""
        return self

    def closed(self, load: float) -> FullContact | None:
        """Return None: the closed form is that of two cosines."""
        return None


def coarsened(contact: ContactOnArea, coarser: float) -> Any:
    """Return `contact` with cells `coarser` times as large as usual."""
    return contact if contact.coarser == coarser else replace(contact, coarser=coarser)


def turned(contact: Any, angle: float) -> Any:
    """Return `contact`, or a force of it, with its finger turned by `angle` (rad)."""
    return contact.on_line(contact.line._replace(direction=contact.line.direction + angle))


def _grid(contact: ContactOnArea, number: int) -> AreaGrid:
    """Return the cells at `number` times TURN_STEP from the direction of `contact`."""
    if number == 0:
        own: Any = contact.grid
        return own  # type: ignore[no-any-return]
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


Read = Callable[["AreaGrid", Places], Array]
"""Returns a value at each of some places."""


def solved_at(contact: ContactOnArea, grid: AreaGrid, at: Places) -> Array:
    """Return z (m) at some places."""
    indentations, sizes = contact.indentations(at.loads), contact.sizes(at.loads)
    return grid.solve_places(at.phases, at.across, indentations, turns=at.turns, sizes=sizes).height


def heights_along(contact: ContactOnArea, phases: Array, loads: Array, path: Array | None) -> Array:
    """Return z (m) at each place; the arguments are those of `read_along`."""
    return read_along(contact, phases, loads, path, partial(solved_at, contact))


def read_along(contact: ContactOnArea, phases: Array, loads: Array, path: Array | None, read: Read) -> Array:
    """Return a value at each place of a path.

    phases: how far the texture has moved along x, turns.
    loads: N, above 0.
    path: how far it has moved across (m), and the direction of the finger (rad) [2, places]; None: on its line.
    read: returns the values in one direction.
    """
    if path is None:
        none = np.zeros(len(phases))
        return read(_grid(contact, 0), Places(phases, none, loads, none))
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
