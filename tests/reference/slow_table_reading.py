"""The readable twin of a table's reader: docs/table.md in NumPy, frame by frame, slow.

It reads a table's own numbers (its header and arrays) along the frames of a motion and returns a quantity. It shares
no code with `synth.response`; the caller passes the weights of the filter.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

Real = npt.NDArray[np.float64]
KEPT = 2.0**-53  # phases are read to 53 bits


def bspline(x: float) -> float:
    """Return the centred B-spline of degree 5 at `x`: a sum of powers (Schoenberg)."""
    return float(sum((-1) ** k * math.comb(6, k) * max(x + 3.0 - k, 0.0) ** 5 for k in range(7))) / 120.0


def cubic(s: float, width: float, low: Any, low_slope: Any, high: Any, high_slope: Any) -> Any:
    """Return the cubic through two values and slopes at 0 <= s <= 1 of `width`."""
    value = (1 + 2 * s) * (1 - s) ** 2 * low + s**2 * (3 - 2 * s) * high
    return value + width * (s * (1 - s) ** 2 * low_slope - s**2 * (1 - s) * high_slope)


def swing(coefficients: Any, row: int, s: float, width: float, turn: float) -> float:
    """Return z minus its mean (m) of one level [rows, 2, places] between rows `row` and `row` + 1, at `turn` turns."""
    low, high = coefficients[row].astype(float), coefficients[row + 1].astype(float)
    here = cubic(s, width, low[0], low[1], high[0], high[1])
    x = turn * len(here)
    cell = math.floor(x)
    return float(sum(here[(cell + k) % len(here)] * bspline(x - (cell + k)) for k in range(-2, 4)))


def sample(
    header: dict[str, Any], tensors: dict[str, Any], quantity: str, turn: float, speed: float, load: float
) -> float:
    """Return the sample of z (m) for a reader of `quantity`, at a place (turns), a speed (m/s) and a load (N)."""
    loads = tensors["loads"].astype(float)
    load = min(max(load, 0.0), header["covered"][1])
    held = min(load, loads[-1])
    row = min(int(np.searchsorted(loads, held, side="right")) - 1, len(loads) - 2)
    width = loads[row + 1] - loads[row]
    s = (held - loads[row]) / width
    turns = abs(speed) / (header["period"] * header["band"])
    highest = header["harmonics"]
    entered, value = 1.0, 0.0
    for number, n in enumerate(highest):
        begin = 1.0 / ((highest[number + 1] if number + 1 < len(highest) else 0) + 1)
        part = min(max((turns - begin) / (1.4 / n - begin), 0.0), 1.0)
        gone = part * part * (3 - 2 * part)
        if entered > gone:
            value += (entered - gone) * swing(tensors[f"level_{n}"], row, s, width, turn)
        entered = gone
    if quantity == "approach":
        means, slopes = tensors["means"].astype(float)
        value += cubic(s, width, means[row], slopes[row], means[row + 1], slopes[row + 1])
        if load > loads[-1] and header["full_from_last_row"]:
            law = header["mean_law"]
            value += law[0] + law[1] * load**1.5 - means[-1]
    g = min(load / header["lift_load"], 1.0)
    return float(value * g**3 * (10 - 15 * g + 6 * g * g))


def read(
    header: dict[str, Any],
    tensors: dict[str, Any],
    quantity: str,
    phases: npt.NDArray[np.uint64],
    motion: Real,
    weights: Real,
    hold: float,
) -> Real:
    """Return the quantity (SI) of every frame of a motion that begins at rest, with the filter's delay.

    phases: uint64 fractions of a turn.
    motion: float64 [5, frames], rows 0 and 2 speed (m/s) and load (N).
    weights, hold: of the filter.
    """
    stride, width = weights.shape
    turns = (phases >> np.uint64(11)).astype(float) * KEPT
    taken = [
        sample(header, tensors, quantity, turns[i], motion[0, i], motion[2, i]) for i in range(0, len(phases), stride)
    ]
    z = np.array([taken[0]] * (width + 1) + taken)
    found = np.empty(len(phases))
    for frame in range(len(phases)):
        newest = width + 1 + frame // stride
        window = z[newest - width : newest + 1]
        steps = np.diff(window)
        found[frame] = np.dot(weights[frame % stride], steps) + hold * window[(width + 1) // 2 - 1]
    return found
