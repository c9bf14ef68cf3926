"""The dimensionless contact, solved in long double without any sampling: the reference for every solver.

Model   integral_0^tau max(A cos(2 pi X / Lambda - 2 pi theta + phi) - cos(2 pi X) - Z, 0) dX = W, solved for Z.
Source  Fagiani & Barbieri 2016, eqs 1, 2 and 7.
Method  The profile is cut at all its critical points (``two_cosines``). On each monotone piece the contact's edge is
        bracketed and polished. The area above Z is exact, in a form without cancellation for patches of any size.
        F(Z) is convex and falls, so Newton from a level below climbs to the root and never passes it. Each step thus
        needs only the parts of the pieces that touched at the step before.
Limits  Measured against 40 digits (``contact_oracle_mpmath``): |error of Z| < 2e-18 (1 + A + |Z|) in long double and
        < 1e-14 (1 + A + |Z|) in float64, for tau 0.3-60, Lambda 0.02-50, A 0-20, W/tau 1e-14-100. See README.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from tests.reference.two_cosines import (
    Floats,
    Pieces,
    Profiles,
    Rows,
    bracketed_root,
    first_cells,
    height_and_slope,
    make_profiles,
    monotone_pieces,
    two_pi,
    waves,
)

#: Climbing steps after which a solve is given up; a load of 1e-14 takes about 40.
MOST_STEPS = 400
#: First cells solved together; bounds the memory (about 1 kB a cell in long double), not the result.
CELLS_AT_ONCE = 120_000


@dataclass(frozen=True)
class Contact:
    """The contact at each case; all fields have the broadcast shape of the arguments.

    ``approach`` Z; ``contact_length`` |C| in ridges; ``load_slope`` dZ/dW = -1 / |C|; ``phase_slope`` dZ/dtheta, the
    mean of dh/dtheta over C; ``crest`` the largest h. Without load Z is the crest, |C| = 0, load_slope = -inf, and
    phase_slope is that of the highest point.
    """

    approach: Floats
    contact_length: Floats
    load_slope: Floats
    phase_slope: Floats
    crest: Floats


@dataclass(frozen=True)
class _Sums:
    """Sums over the touching parts, one value per profile."""

    area: Floats
    length: Floats
    phase: Floats


def solve_contact(
    tau: npt.ArrayLike,
    period_ratio: npt.ArrayLike,
    amplitude_ratio: npt.ArrayLike,
    load: npt.ArrayLike,
    theta: npt.ArrayLike,
    phi: npt.ArrayLike = 0.0,
    *,
    ridge: npt.ArrayLike = 1.0,
    dtype: npt.DTypeLike = np.longdouble,
) -> Contact:
    """Z(theta) of eq. 7, for arguments that broadcast against each other.

    ``tau`` = L / lambda1, ``period_ratio`` = Lambda, ``amplitude_ratio`` = A, ``load`` = W, ``theta`` in turns, ``phi``
    in rad. ``ridge`` scales the finger's own cosine (1 in eq. 7; 0 is a smooth finger). ``dtype`` is np.longdouble, or
    np.float64, which is several times faster. ValueError for values that are not finite or negative, or no length.
    """
    arguments = (tau, period_ratio, amplitude_ratio, ridge, load, theta, phi)
    fields = np.broadcast_arrays(*(np.asarray(value, dtype=np.longdouble) for value in arguments))
    _check(*fields)
    shape = fields[0].shape
    length, period, texture, finger, weight, turns, angle = (field.ravel() for field in fields)
    profiles = make_profiles(length, period, finger, texture, turns, angle, dtype)
    parts = [_solve(_rows_of(profiles, part), weight[part].astype(dtype)) for part in _batches(first_cells(profiles))]
    joined = [np.concatenate(column).reshape(shape) for column in zip(*parts, strict=True)]
    return Contact(*joined)


def _check(
    tau: Floats, period: Floats, texture: Floats, ridge: Floats, load: Floats, theta: Floats, phi: Floats
) -> None:
    """Refuse values outside eq. 7; written so that NaN fails."""
    if tau.size == 0:
        raise ValueError("at least one case is needed")
    for name, field in (("tau", tau), ("period_ratio", period)):
        if not np.all((field > 0) & np.isfinite(field)):
            raise ValueError(f"{name} must be finite and above zero")
    for name, field in (("amplitude_ratio", texture), ("ridge", ridge), ("load", load)):
        if not np.all((field >= 0) & np.isfinite(field)):
            raise ValueError(f"{name} must be finite and not negative")
    if not np.all(np.isfinite(theta) & np.isfinite(phi)):
        raise ValueError("theta and phi must be finite")


def _batches(cost: npt.NDArray[np.int64]) -> list[slice]:
    """Runs of rows whose cost adds up to about CELLS_AT_ONCE, at least one row each."""
    group = (np.cumsum(cost) - cost) // CELLS_AT_ONCE
    starts = np.flatnonzero(np.diff(group, prepend=-1))
    return [slice(int(a), int(b)) for a, b in zip(starts, [*starts[1:], cost.size], strict=True)]


def _rows_of(profiles: Profiles, part: slice) -> Profiles:
    """The profiles of one batch."""
    names = ("length", "period", "period_high", "period_low", "ridge", "texture", "offset")
    return Profiles(**{name: getattr(profiles, name)[part] for name in names})


def _solve(profiles: Profiles, load: Floats) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """The five fields of Contact for one batch: climb from a level below to the root."""
    pieces = monotone_pieces(profiles)
    crest, crest_slope, steepness = _crest(profiles, pieces)
    full = np.minimum(_mean_height(profiles) - load / profiles.length, crest)
    approach = np.maximum(full, _deepest(profiles, load, crest, steepness))
    length, phase = np.zeros_like(load), crest_slope.copy()
    approach[load == 0] = crest[load == 0]
    active = load > 0
    for _ in range(MOST_STEPS):
        if not active.any():
            load_slope = np.full_like(load, -np.inf)
            np.divide(-1, length, out=load_slope, where=length > 0)
            return approach, length, load_slope, phase, crest
        highest = np.maximum(pieces.height_left, pieces.height_right)
        pieces = _touching_parts(profiles, pieces.take(active[pieces.row] & (highest > approach[pieces.row])), approach)
        sums = _sums(profiles, pieces, approach)
        touching = active & (sums.length > 0)
        length[touching] = sums.length[touching]
        phase[touching] = sums.phase[touching] / sums.length[touching]
        step = np.zeros_like(load)
        np.divide(sums.area - load, sums.length, out=step, where=touching)
        smallest = 2 * profiles.epsilon * (profiles.tall + np.abs(approach))
        moved = np.where(approach + step < crest, approach + step, (approach + crest) / 2)
        approach = np.where(touching, moved, approach)
        active = touching & (step > smallest)
    raise ArithmeticError(f"{int(active.sum())} contacts did not settle in {MOST_STEPS} steps")


def _deepest(profiles: Profiles, load: Floats, crest: Floats, steepness: Floats) -> Floats:
    """A level below Z, near it where only the crest touches; -inf where the contact may be too short for the bound.

    On the longer side of the crest h >= crest - s x - c x^2 / 2, with its slope s there and c >= |h''|. Above the level
    crest - d this holds a triangle of the area d x / 2, x = 2 d / (s + sqrt(s^2 + 2 c d)). It is W or more for the d
    below.
    """
    curvature = profiles.most_curved
    deep = np.maximum(np.sqrt(4 * load * steepness), np.cbrt(8 * curvature * load**2))
    return np.where(8 * deep < curvature * profiles.length**2, crest - deep, -np.inf)


def _crest(profiles: Profiles, pieces: Pieces) -> tuple[Floats, Floats, Floats]:
    """Largest height of each profile, then dh/dtheta and |dh/dX| at that place."""
    left_higher = pieces.height_left >= pieces.height_right
    height = np.where(left_higher, pieces.height_left, pieces.height_right)
    position = np.where(left_higher, pieces.left, pieces.right)
    order = np.lexsort((height, pieces.row))
    best = order[np.append(np.flatnonzero(np.diff(pieces.row[order])), order.size - 1)]
    _, _, _, sine = waves(profiles, pieces.row[best], position[best])
    _, slope = height_and_slope(profiles, pieces.row[best], position[best])
    return height[best], two_pi(height.dtype) * profiles.texture * sine, np.abs(slope)


def _mean_height(profiles: Profiles) -> Floats:
    """Mean of h over the whole length, in closed form."""
    row, half = np.arange(profiles.rows), profiles.length / 2
    cos1, sin1, cos2, _ = waves(profiles, row, half)
    still = Profiles(**{**profiles.__dict__, "offset": np.zeros_like(profiles.offset)})
    _, _, _, sin2 = waves(still, row, half)
    mean = profiles.texture * cos2 * sin2 * profiles.period - profiles.ridge * cos1 * sin1
    return np.asarray(mean / (two_pi(half.dtype) * half))


def _sums(profiles: Profiles, parts: Pieces, approach: Floats) -> _Sums:
    """Area above the approach, contact length and integral of dh/dtheta, summed over the touching parts."""
    row, middle, half = parts.row, (parts.left + parts.right) / 2, (parts.right - parts.left) / 2
    cos1, _, cos2, sin2 = waves(profiles, row, middle)
    turn = two_pi(middle.dtype)
    texture, ridge = profiles.texture[row], profiles.ridge[row]
    lost1 = _one_less_sinc(turn * half)
    lost2 = _one_less_sinc(turn * half / profiles.period[row])
    above_middle = texture * cos2 - ridge * cos1 - approach[row]
    area = 2 * half * (above_middle - texture * cos2 * lost2 + ridge * cos1 * lost1)
    phase = 2 * half * turn * texture * sin2 * (1 - lost2)
    return _Sums(*(_sum_by_row(row, part, profiles.rows) for part in (area, 2 * half, phase)))


def _touching_parts(profiles: Profiles, pieces: Pieces, approach: Floats) -> Pieces:
    """The touching part of each piece; every piece given touches somewhere."""
    level = approach[pieces.row]
    crossing = np.flatnonzero((pieces.height_left > level) != (pieces.height_right > level))
    row, level = pieces.row[crossing], level[crossing]
    rising = pieces.height_right[crossing] > level
    left, right = pieces.left[crossing], pieces.right[crossing]
    low, high = pieces.height_left[crossing], pieces.height_right[crossing]
    # As on a parabola about the higher end, near which light loads touch.
    from_top = (right - left) * np.sqrt((np.maximum(low, high) - level) / np.abs(high - low))
    guess = np.where(rising, right - from_top, left + from_top)

    def above(index: Rows, position: Floats) -> tuple[Floats, Floats]:
        height, slope = height_and_slope(profiles, row[index], position)
        return height - level[index], slope

    noise = profiles.epsilon * (profiles.tall[row] + np.abs(level))
    edge = bracketed_root(above, left, right, guess, rising, noise)
    start, stop = pieces.left.copy(), pieces.right.copy()
    height_start, height_stop = pieces.height_left.copy(), pieces.height_right.copy()
    start[crossing[rising]], height_start[crossing[rising]] = edge[rising], level[rising]
    stop[crossing[~rising]], height_stop[crossing[~rising]] = edge[~rising], level[~rising]
    return Pieces(pieces.row, start, stop, height_start, height_stop)


def _one_less_sinc(angle: Floats) -> Floats:
    """1 - sin(angle) / angle, to full relative precision also where it is tiny."""
    square = angle * angle
    series = np.zeros_like(angle)
    for order in range(12, 0, -1):
        series = square / ((2 * order) * (2 * order + 1)) * (1 - series)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(np.abs(angle) < 1, series, 1 - np.sin(angle) / angle)


def _sum_by_row(row: Rows, value: Floats, rows: int) -> Floats:
    """Sums of ``value`` over equal, ascending ``row``."""
    total = np.zeros(rows, dtype=value.dtype)
    if row.size:
        starts = np.flatnonzero(np.diff(row, prepend=-1))
        total[row[starts]] = np.add.reduceat(value, starts)
    return total


def pieces_of(tau: float, period_ratio: float, amplitude_ratio: float, theta: float, phi: float = 0.0) -> Any:
    """Positions, in ridges, of the ends of the monotone pieces of one profile, in long double. Shape [pieces + 1]."""
    profiles = make_profiles(tau, period_ratio, 1.0, amplitude_ratio, theta, phi, np.longdouble)
    pieces = monotone_pieces(profiles)
    return np.append(pieces.left, pieces.right[-1])
