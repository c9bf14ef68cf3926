"""Slow twins of a layered table: every point of the finger at one place, and the spline of the table term by term."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np

Real = np.ndarray[Any, np.dtype[np.float64]]
QUARTER = 0.5 / math.sqrt(3.0)  # of a cell: points there have the variance of a plane over it
ROW_DISTANCE = 0.97  # of the rows of a finger, in those of the texture
COLUMNS_BEFORE = 8  # of the stored texture, before x = 0
NO_POINT = -1e20  # heights below it are places without a point of the finger


def points_of(grid: Any) -> tuple[Real, Real, Real, Real]:
    """Return x and y (periods of the texture), height and share of four points in every cell of an `AreaGrid`."""
    found, there = [], grid.finger[:, 0] > NO_POINT
    for u, v in itertools.product((-QUARTER, QUARTER), repeat=2):
        x = grid.begin[0] + (grid.places[:, :1] - COLUMNS_BEFORE + np.arange(there.shape[1]) + u) / grid.texture.columns
        y = np.broadcast_to(grid.begin[1] + (grid.places[:, 1:2] + ROW_DISTANCE * v) / grid.texture.shape[0], x.shape)
        heights = grid.finger[:, 0] + u * grid.finger[:, 1] + v * grid.finger[:, 2]
        found.append((x[there], y[there], heights[there].astype(float), grid.shares[there]))
    x, y, heights, shares = (np.concatenate(one) for one in zip(*found, strict=True))
    return x, y, heights, shares


class BruteForce:
    """Every point of the finger of an `AreaGrid`, at any place."""

    def __init__(self, grid: Any) -> None:
        rows, self.finer_x, finer_y, _stride, span = (int(one) for one in grid.texture.shape)
        cells = grid.texture.heights.reshape(finer_y, self.finer_x, rows, span)
        self.texture = cells.transpose(2, 0, 3, 1).reshape(rows * finer_y, -1)
        self.grid, self.points = grid, points_of(grid)

    def heights(self, phase: float, across: float) -> tuple[Real, Real]:
        """Return h1 + h2 (m) and the share of every point, where the finger has moved by `phase` and `across`."""
        (x, y, h1, shares), texture = self.points, self.texture
        x, y = (x - phase) % 1.0 * self.grid.texture.columns * self.finer_x, (y - across) % 1.0 * len(texture)
        i, j = np.floor(x).astype(int) + COLUMNS_BEFORE * self.finer_x, np.floor(y).astype(int) % len(texture)
        u, v, after = x - np.floor(x), y - np.floor(y), (j + 1) % len(texture)
        lower = (1.0 - u) * texture[j, i] + u * texture[j, i + 1]
        upper = (1.0 - u) * texture[after, i] + u * texture[after, i + 1]
        return np.asarray((h1 + (1.0 - v) * lower + v * upper) * self.grid.height_scale), shares

    def approach(self, phase: float, across: float, indentation: float) -> float:
        """Return z (m): the mean of max(h - z, 0) over A0 is `indentation` (m)."""
        h, shares = self.heights(phase, across)
        order = np.argsort(-h)
        h, shares = h[order], shares[order]
        levels = (np.cumsum(shares * h) - 4.0 * indentation / self.grid.cell) / np.cumsum(shares)
        return float(levels.max())  # with n points above z; too many or too few give a lower level


def heights_at(grid: Any, phase: float, across: float) -> tuple[Real, Real]:
    """Return h1 + h2 (m) and the share of every point, where the finger has moved by `phase` and `across` (periods)."""
    return BruteForce(grid).heights(phase, across)


def cubic(t: float) -> Real:
    """Return the cubic B-spline at t + 1, t, t - 1 and t - 2."""
    return np.array([(1 - t) ** 3, 3 * t**3 - 6 * t**2 + 4, 3 * (1 - t) ** 3 - 6 * (1 - t) ** 2 + 4, t**3]) / 6.0


def read(table: Any, phase: float, across: float, load: float) -> float:
    """Return z (m) of `table` at one place and load."""
    lightest, heaviest = table.loads[0] ** 0.25, table.loads[-1] ** 0.25
    part = (np.clip(load, table.loads[0], table.loads[-1]) ** 0.25 - lightest) / (heaviest - lightest)

    def piece(cells: int, at: float) -> tuple[slice, Real]:
        first = min(int(at), cells - 1)
        return slice(first, first + 4), cubic(at - first)

    columns, rows = table.places
    along, a = piece(columns, phase % 1.0 * columns)
    over, b = piece(rows, across % 1.0 * rows)
    loads, c = piece(len(table.loads) - 1, part * (len(table.loads) - 1))
    curve, d = piece(len(table.curve) - 3, part * (len(table.curve) - 3))
    taps = table.coefficients[over, along, loads] * table.scales[loads]
    return float(np.einsum("yxw,y,x,w", taps, b, a, c) + table.curve[curve] @ d)
