"""The gap profile of eq. 2 without its ``z``: two cosines, cut into monotone pieces.

Model   h(X) = texture cos(2 pi X / period - 2 pi theta + phi) - ridge cos(2 pi X), 0 <= X <= length, in finger ridges.
Source  Fagiani & Barbieri 2016, eqs 2 and 7 (ridge = 1, texture = A, period = Lambda, length = tau).
Method  Every zero of h' is isolated by subdivision. A cell is *clear* when |h'| at its middle exceeds the largest
change
        of h' that the curvature allows. It is *simple* when h' is monotone on it, by a similar bound. Otherwise it is
        halved. No critical point can hide between grid points. A cell that is neither clear nor simple when h varies by
        less than one unit of round-off on it is cut at both its ends and left.
Limits  Works in np.longdouble (64-bit significand on x86) or np.float64. Angles are reduced in turns, without loss.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.floating[Any]]
Rows = npt.NDArray[np.intp]
Evaluate = Callable[[Rows, Floats], tuple[Floats, Floats]]

#: First cells per shortest wavelength; only the cost depends on it, since cells are halved as far as necessary.
FIRST_CELLS = 6
#: Newton and bisection steps after which a bracketed root is given up; bisection alone needs 70 in 64 bits.
MOST_STEPS = 300
#: Steps after which every other one is a bisection, so that a bracket full of round-off cannot hold Newton up.
QUICK_STEPS = 16


@dataclass(frozen=True)
class Profiles:
    """A batch of profiles, one row each; every field has shape [rows] and one floating type.

    ``offset`` is phi / 2 pi - theta in turns, reduced to [-1/2, 1/2]; ``period_high + period_low == period`` exactly,
    the first with 24 bits, so that multiplying it by a whole number of periods loses nothing.
    """

    length: Floats
    period: Floats
    period_high: Floats
    period_low: Floats
    ridge: Floats
    texture: Floats
    offset: Floats

    @property
    def rows(self) -> int:
        """Number of profiles."""
        return int(self.length.shape[0])

    @property
    def epsilon(self) -> Any:
        """Unit of round-off of the floating type in use."""
        return np.finfo(self.length.dtype).eps

    @property
    def tall(self) -> Floats:
        """Bound of |h|, the sum of the amplitudes; shape [rows]."""
        return self.ridge + self.texture

    @property
    def steepest(self) -> Floats:
        """Bound of |dh/dX|; shape [rows]."""
        return np.asarray(two_pi(self.length.dtype) * (self.ridge + self.texture / self.period))

    @property
    def most_curved(self) -> Floats:
        """Bound of |d2h/dX2|; shape [rows]."""
        return np.asarray(two_pi(self.length.dtype) ** 2 * (self.ridge + self.texture / self.period**2))

    @property
    def jerk(self) -> Floats:
        """Bound of |d3h/dX3|; shape [rows]. Equal periods give one cosine, which may be nearly zero."""
        half_turn = two_pi(self.length.dtype) / 2
        apart = self.ridge + self.texture / self.period**3
        together = np.hypot(
            self.texture - self.ridge, 2 * np.sqrt(self.texture * self.ridge) * np.sin(half_turn * self.offset)
        )
        return np.asarray((2 * half_turn) ** 3 * np.where(self.period == 1, 2 * together, apart))


@dataclass(frozen=True)
class Pieces:
    """Monotone pieces [left, right] of the profiles in ``row``, ordered by row, then position; heights at both ends."""

    row: Rows
    left: Floats
    right: Floats
    height_left: Floats
    height_right: Floats

    def take(self, keep: npt.NDArray[np.bool_]) -> Pieces:
        """The pieces where ``keep`` is true."""
        ends = (self.left[keep], self.right[keep])
        return Pieces(self.row[keep], *ends, self.height_left[keep], self.height_right[keep])


def two_pi(dtype: npt.DTypeLike) -> Any:
    """2 pi, rounded once to ``dtype``."""
    return np.asarray(np.longdouble("6.283185307179586476925286766559005768394")).astype(dtype)[()]


def make_profiles(
    length: npt.ArrayLike, period: npt.ArrayLike, ridge: npt.ArrayLike, texture: npt.ArrayLike,
    theta: npt.ArrayLike, phi: npt.ArrayLike, dtype: npt.DTypeLike,
) -> Profiles:  # fmt: skip
    """Profiles from 1-D arrays of one size; ``theta`` in turns (any size, taken exactly), ``phi`` in rad."""
    wide = [np.atleast_1d(np.asarray(field, dtype=np.longdouble)) for field in (length, period, ridge, texture)]
    turns = np.atleast_1d(np.asarray(theta, dtype=np.longdouble))
    turns = turns - np.rint(turns)
    offset = np.atleast_1d(np.asarray(phi, dtype=np.longdouble)) / two_pi(np.longdouble) - turns
    offset = offset - np.rint(offset)
    high = wide[1].astype(np.float32).astype(np.longdouble)
    fields = (wide[0], wide[1], high, wide[1] - high, wide[2], wide[3], offset)
    return Profiles(*(field.astype(dtype) for field in fields))


def texture_turns(profiles: Profiles, row: Rows, position: Floats) -> Floats:
    """X / period + offset, in turns without whole turns; accurate to round-off of one turn at any position."""
    period = profiles.period[row]
    whole = np.rint(position / period)
    rest = (position - whole * profiles.period_high[row]) - whole * profiles.period_low[row]
    return rest / period + profiles.offset[row]


def waves(profiles: Profiles, row: Rows, position: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Cosine and sine of the finger's angle, then of the texture's, at ``position`` in profile ``row``."""
    turn = two_pi(position.dtype)
    finger = turn * (position - np.rint(position))
    texture = turn * texture_turns(profiles, row, position)
    return np.cos(finger), np.sin(finger), np.cos(texture), np.sin(texture)


def height_and_slope(profiles: Profiles, row: Rows, position: Floats) -> tuple[Floats, Floats]:
    """H and dh/dX at ``position`` of profile ``row`` (one shape)."""
    cos1, sin1, cos2, sin2 = waves(profiles, row, position)
    ridge, texture = profiles.ridge[row], profiles.texture[row]
    height = texture * cos2 - ridge * cos1
    return height, two_pi(position.dtype) * (ridge * sin1 - texture / profiles.period[row] * sin2)


def slope_and_curvature(profiles: Profiles, row: Rows, position: Floats) -> tuple[Floats, Floats]:
    """dh/dX and d2h/dX2 at ``position`` of profile ``row`` (one shape)."""
    cos1, sin1, cos2, sin2 = waves(profiles, row, position)
    turn = two_pi(position.dtype)
    ridge, texture = profiles.ridge[row], profiles.texture[row] / profiles.period[row]
    slope = turn * (ridge * sin1 - texture * sin2)
    return slope, turn * turn * (ridge * cos1 - texture / profiles.period[row] * cos2)


def bracketed_root(
    evaluate: Evaluate, low: Floats, high: Floats, start: Floats, rising: npt.NDArray[np.bool_], noise: Floats
) -> Floats:
    """Roots in the brackets [low, high], to the last digits of the position or of the value.

    ``evaluate(index, position)`` gives value and slope for the brackets ``index``. ``rising`` is true where the value
    goes from negative to positive. ``noise`` is the round-off of the value, below which it counts as zero. Newton, and
    bisection where Newton leaves the bracket. ArithmeticError when it stalls.
    """
    low, high, position = low.copy(), high.copy(), np.clip(start, low, high)
    tolerance = 2 * np.finfo(low.dtype).eps * np.maximum(np.abs(low), np.abs(high))
    index = np.arange(low.size)
    for count in range(MOST_STEPS):
        if index.size == 0:
            return position
        here = position[index]
        value, slope = evaluate(index, here)
        beyond = (value > 0) == rising[index]
        high[index[beyond]] = here[beyond]
        low[index[~beyond]] = here[~beyond]
        with np.errstate(divide="ignore", invalid="ignore"):
            newton = here - value / slope
        below, above = low[index], high[index]
        settled = (np.abs(value) <= noise[index]) | (np.abs(newton - here) <= tolerance[index])
        settled |= above - below <= tolerance[index]
        trusted = (newton > below) & (newton < above) & (count < QUICK_STEPS or count % 2 == 0)
        following = np.where(trusted, newton, below + (above - below) / 2)
        position[index] = np.where(settled, here, following)
        index = index[~settled]
    raise ArithmeticError(f"{index.size} bracketed roots did not settle in {MOST_STEPS} steps")


def first_cells(profiles: Profiles) -> npt.NDArray[np.int64]:
    """Number of equal cells into which each profile is first cut, a measure of its cost. Shape [rows]."""
    waves_held = profiles.length * np.where(profiles.texture > 0, np.maximum(1, 1 / profiles.period), 1)
    return np.asarray(np.ceil(FIRST_CELLS * waves_held) + 2, dtype=np.int64)


def _cut(profiles: Profiles) -> tuple[Rows, Floats, Floats]:
    """Row, left end and right end of the first cells; neighbours share their ends bit for bit."""
    count = first_cells(profiles)
    row = np.repeat(np.arange(profiles.rows), count)
    number = np.arange(row.size) - np.repeat(np.cumsum(count) - count, count)
    width = (profiles.length / count)[row]
    last = number + 1 == count[row]
    return row, number * width, np.where(last, profiles.length[row], (number + 1) * width)


def critical_points(profiles: Profiles) -> tuple[Rows, Floats]:
    """Row and position of every zero of dh/dX inside the profiles, unsorted (and ends of cells too flat to decide)."""
    row, left, right = _cut(profiles)
    jerk = profiles.jerk
    found_rows: list[Rows] = []
    found: list[Floats] = []
    while row.size:
        middle, reach = (left + right) / 2, (right - left) / 2 * (1 + 8 * profiles.epsilon)
        slope, curvature = slope_and_curvature(profiles, row, middle)
        change = np.abs(curvature) * reach + jerk[row] * reach**2 / 2
        clear = np.abs(slope) > change + 64 * profiles.epsilon * profiles.steepest[row]
        simple = ~clear & (np.abs(curvature) > jerk[row] * reach)
        flat = ~clear & ~simple & (2 * reach * (np.abs(slope) + change) <= profiles.epsilon * profiles.tall[row])
        found_rows += [row[flat], row[flat]]
        found += [left[flat], right[flat]]
        rows_here, points = _simple_roots(profiles, row[simple], left[simple], right[simple])
        found_rows.append(rows_here)
        found.append(points)
        split = ~(clear | simple | flat)
        row = np.concatenate([row[split], row[split]])
        left, right = (
            np.concatenate([left[split], middle[split]]),
            np.concatenate([middle[split], right[split]]),
        )
    return np.concatenate(found_rows), np.concatenate(found)


def _simple_roots(profiles: Profiles, row: Rows, left: Floats, right: Floats) -> tuple[Rows, Floats]:
    """Zeros of dh/dX in cells on which it is monotone: one where its sign differs at the ends, otherwise none."""
    slope_left, _ = slope_and_curvature(profiles, row, left)
    slope_right, _ = slope_and_curvature(profiles, row, right)
    crossing = (slope_left >= 0) != (slope_right >= 0)
    row, left, right = row[crossing], left[crossing], right[crossing]
    rising = slope_right[crossing] >= 0
    points = bracketed_root(
        lambda index, position: slope_and_curvature(profiles, row[index], position),
        left, right, (left + right) / 2, rising, 2 * profiles.epsilon * profiles.steepest[row],
    )  # fmt: skip
    return row, points


def monotone_pieces(profiles: Profiles) -> Pieces:
    """All the pieces of all the profiles, cut at their ends and at every critical point."""
    rows, points = critical_points(profiles)
    every = np.arange(profiles.rows)
    rows = np.concatenate([every, rows, every])
    points = np.concatenate([np.zeros_like(profiles.length), points, profiles.length])
    order = np.lexsort((points, rows))
    rows, points = rows[order], points[order]
    height, _ = height_and_slope(profiles, rows, points)
    inside = (rows[:-1] == rows[1:]) & (points[:-1] < points[1:])
    return Pieces(rows[:-1], points[:-1], points[1:], height[:-1], height[1:]).take(inside)
