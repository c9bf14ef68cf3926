"""The surfaces at the points of a finger of viscous skin, at any phase: of two cosines, or of a texture of any profile.

Model   two cosines turn: finger + cos(angle) texture + sin(angle) quarter, of three rows. Any other texture is read off
        a table of one period that moves past the points, by straight lines. The table is the projection of the profile
        onto straight lines between points (`polyline`), taken at every offset of the points: sinc^2(n d) 3 / (2 +
        cos(2 pi n d)) of its n-th harmonic, d the distance of points in periods. So areas over a few pieces are kept,
        wherever the points stand, and a corner that passes them makes no ripple.
        The kernels take `tables`: the three rows, or (finger, places, table). Types are known when a kernel is
        compiled, so one source gives a kernel for each.
Source  numba's `overload`, which puts what fits the types in place of the call; de Boor (2001) for the projection.
Limits  the table has at least FINER knots a distance of points: its straight lines err by 1/200 of what the distance of
        points does.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numba.core.types import BaseTuple
from numba.extending import overload

from synth.arrays import Array
from synth.contact.geometry import Geometry
from synth.kernels import kernel

Tables = Array | tuple[Array, Array, Array]
"""float64 [3, points]: finger, texture at phase 0 and a quarter period on. Or finger [points], places [points] (knots,
0 to N) and the table [2 N + 2], two periods long. Heights relative to a1 + a2."""
Chosen = Callable[..., Any]  # numba wants parameters named and typed as in the function that stands in

FINER = 8  # knots a distance of points; fewer show their straight lines in the acceleration
FEWEST_KNOTS = 4096  # a period


def texture_tables(geometry: Geometry, finger: Array) -> Tables:
    """Return the tables of a texture that is a profile; finger: relative to a1 + a2, at points over the length."""
    profile, points = geometry.profile, len(finger)
    assert profile is not None, "two cosines need no table"
    apart = geometry.contact_length / (points - 1) / profile.period
    knots = max(FEWEST_KNOTS, math.ceil(FINER / apart))
    turns = np.arange(knots) / knots
    lines = np.fft.rfft(geometry.texture(turns * profile.period) / geometry.height_scale)
    passed = np.arange(len(lines)) * apart
    lines *= 3.0 * np.sinc(passed) ** 2 / (2.0 + np.cos(2.0 * math.pi * passed))
    table = np.fft.irfft(lines, knots)
    places = np.asarray(np.arange(points) * apart % 1.0 * knots, np.float64)
    return finger, places, np.concatenate([table, table, table[:2]])


def write_heights(tables: Any, turns: Any, heights: Any) -> None:
    """Write h at every point; turns: the phase, from -1/2 to 1/2. For kernels."""
    raise NotImplementedError


def write_rates(tables: Any, turns: Any, rates: Any) -> None:
    """Write the derivative of h over the phase as an angle (1/rad) at every point. For kernels."""
    raise NotImplementedError


def turned_heights(tables: Any, turns: Any, heights: Any) -> None:
    """See `write_heights`."""
    cosine, sine = math.cos(2.0 * math.pi * turns), math.sin(2.0 * math.pi * turns)
    for j in range(heights.shape[0]):
        heights[j] = tables[0, j] + (cosine * tables[1, j] + sine * tables[2, j])


def read_heights(tables: Any, turns: Any, heights: Any) -> None:
    """See `write_heights`."""
    finger, places, table = tables
    shift = (math.ceil(turns) - turns) * (len(table) // 2 - 1)
    for j in range(heights.shape[0]):
        place = places[j] + shift
        k = int(place)
        heights[j] = finger[j] + (table[k] + (place - k) * (table[k + 1] - table[k]))


def turned_rates(tables: Any, turns: Any, rates: Any) -> None:
    """See `write_rates`."""
    cosine, sine = math.cos(2.0 * math.pi * turns), math.sin(2.0 * math.pi * turns)
    for j in range(rates.shape[0]):
        rates[j] = cosine * tables[2, j] - sine * tables[1, j]


def read_rates(tables: Any, turns: Any, rates: Any) -> None:
    """See `write_rates`."""
    _finger, places, table = tables
    knots = len(table) // 2 - 1
    shift, steep = (math.ceil(turns) - turns) * knots, knots / (2.0 * math.pi)
    for j in range(rates.shape[0]):
        k = int(places[j] + shift)
        rates[j] = (table[k] - table[k + 1]) * steep


@overload(write_heights, jit_options={"error_model": "numpy", "fastmath": {"contract"}})
def write_heights_of_type(tables: Any, turns: Any, heights: Any) -> Chosen:
    """Choose by the type of `tables`."""
    return read_heights if isinstance(tables, BaseTuple) else turned_heights


@overload(write_rates, jit_options={"error_model": "numpy", "fastmath": {"contract"}})
def write_rates_of_type(tables: Any, turns: Any, rates: Any) -> Chosen:
    """Choose by the type of `tables`."""
    return read_rates if isinstance(tables, BaseTuple) else turned_rates


@kernel
def heights_at(tables: Any, turns: Any, heights: Any) -> None:
    """Write h at every point at the phase `turns` (-1/2 to 1/2)."""
    write_heights(tables, turns, heights)
