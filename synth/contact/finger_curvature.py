"""The parabola of a round finger inside a cell; where the finger is flat, nothing, and no work of the machine.

Model   a round finger takes d(x) = (x - xc)^2 / (2 R) off h. In a cell, over which t runs from -1 to 1, that is d0 +
        d1 t + d2 t^2 in units of a1 + a2. The kernels take `tables`: the array of `exact_solver.Grid` for a flat
        finger; for a round one the pair of that array and the rows d0, d1, d2 of every cell. A cell then ends in its
        level, the coefficients of z + d(t), where it ends in z for a flat finger. Types are known when a kernel is
        compiled, so one source gives a kernel for each.
Source  numba's `overload`, which puts what fits the types in place of the call.
Limits  nothing is rounded but the coefficients: to round-off of d, which is far below that of h near the middle.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba.core.types import BaseTuple
from numba.extending import overload

Level = float | tuple[float, float, float]  # z, or the coefficients of z + d
Four = tuple[float, float, float, float]
Chosen = Callable[..., Any]  # numba wants parameters named and typed as in the function that stands in


def surfaces_of(tables: Any) -> Any:
    """Return the rows of the two surfaces, float64 [6, cells]."""
    return (surfaces_of_round if isinstance(tables, tuple) else surfaces_of_flat)(tables)


def dome_of(tables: Any, i: Any) -> tuple[float, float, float]:
    """Return d0, d1, d2 of cell `i`."""
    return (dome_of_round if isinstance(tables, tuple) else dome_of_flat)(tables, i)


def level_of(tables: Any, i: Any, z: Any) -> Level:
    """Return what cell `i` ends in: z, or the coefficients of z + d."""
    return (level_of_round if isinstance(tables, tuple) else level_of_flat)(tables, i, z)


def level_at(level: Any, t: Any) -> Four:
    """Return z + d, its slope, its curvature, and its integral from 0 to `t`, at `t` of a cell."""
    return (round_level_at if isinstance(level, tuple) else flat_level_at)(level, t)


def surfaces_of_flat(tables: Any) -> Any:
    """See `surfaces_of`."""
    return tables


def surfaces_of_round(tables: Any) -> Any:
    """See `surfaces_of`."""
    return tables[0]


def dome_of_flat(tables: Any, i: Any) -> tuple[float, float, float]:
    """See `dome_of`."""
    return 0.0, 0.0, -0.0  # d2 is added, and adding -0 is no work: it leaves every number as it is


def dome_of_round(tables: Any, i: Any) -> tuple[float, float, float]:
    """See `dome_of`."""
    return tables[1][0, i], tables[1][1, i], tables[1][2, i]


def level_of_flat(tables: Any, i: Any, z: Any) -> Any:
    """See `level_of`."""
    return z


def level_of_round(tables: Any, i: Any, z: Any) -> Level:
    """See `level_of`."""
    return z + tables[1][0, i], tables[1][1, i], tables[1][2, i]


def flat_level_at(level: Any, t: Any) -> Four:
    """See `level_at`."""
    return level, 0.0, 0.0, level * t


def round_level_at(level: Any, t: Any) -> Four:
    """See `level_at`."""
    height, slope, bend = level
    area = t * (height + t * (0.5 * slope + t * (bend / 3.0)))
    return height + t * (slope + t * bend), slope + 2.0 * bend * t, 2.0 * bend, area


@overload(surfaces_of, inline="always")
def surfaces_of_type(tables: Any) -> Chosen:
    """Choose by the type of `tables`."""
    return surfaces_of_round if isinstance(tables, BaseTuple) else surfaces_of_flat


@overload(dome_of, inline="always")
def dome_of_type(tables: Any, i: Any) -> Chosen:
    """Choose by the type of `tables`."""
    return dome_of_round if isinstance(tables, BaseTuple) else dome_of_flat


@overload(level_of, inline="always")
def level_of_type(tables: Any, i: Any, z: Any) -> Chosen:
    """Choose by the type of `tables`."""
    return level_of_round if isinstance(tables, BaseTuple) else level_of_flat


@overload(level_at, jit_options={"error_model": "numpy", "fastmath": {"contract"}})
def level_at_type(level: Any, t: Any) -> Chosen:
    """Choose by the type of `level`."""
    return round_level_at if isinstance(level, BaseTuple) else flat_level_at
