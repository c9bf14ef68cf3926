"""A reader of table files in NumPy, written from docs/table.md alone: it imports nothing of ridgewave."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

Real = npt.NDArray[np.float64]


def load(path: Path) -> tuple[dict[str, Any], dict[str, Real]]:
    """Return the header and the arrays of the file at `path`."""
    content = path.read_bytes()
    length = int.from_bytes(content[:8], "little")
    arrays = json.loads(content[8 : 8 + length])
    metadata = arrays.pop("__metadata__")
    assert metadata["ridgewave_table"] == "1"
    body = content[8 + length :]
    found = {
        name: np.frombuffer(body[slice(*one["data_offsets"])], "<f4").reshape(one["shape"]).astype(float)
        for name, one in arrays.items()
    }
    return json.loads(metadata["header"]), found


def hermite(y: Real, slope: Real, r: int, s: float, width: float) -> Any:
    """Return the cubic between rows r and r + 1."""
    own, other = (1 + 2 * s) * (1 - s) ** 2 * y[r], s**2 * (3 - 2 * s) * y[r + 1]
    return own + other + width * (s * (1 - s) ** 2 * slope[r] - s**2 * (1 - s) * slope[r + 1])


def taken(
    header: dict[str, Any], arrays: dict[str, Real], approach: bool, place: float, speed: float, w: float
) -> float:
    """Return z at one frame."""
    loads = arrays["loads"]
    w = min(max(w, 0.0), header["covered"][1])
    v = min(w, loads[-1])
    r = min(int(np.sum(loads <= v)) - 1, len(loads) - 2)
    width = loads[r + 1] - loads[r]
    s = (v - loads[r]) / width
    q, left, z = abs(speed) / (header["period"] * header["band"]), 1.0, 0.0
    for n, after, places in zip(header["harmonics"], [*header["harmonics"][1:], 0], header["places"], strict=True):
        begin, end = 1 / (after + 1), 1.4 / n
        f = min(max((q - begin) / (end - begin), 0.0), 1.0)
        gone = f * f * (3 - 2 * f)
        if left > 0.0 and gone < 1.0:
            level = arrays[f"level_{n}"]
            coefficients = hermite(level[:, 0], level[:, 1], r, s, width)
            x = places * (place / header["period"] % 1.0)
            i = int(np.floor(x))
            t, u = x - i, 1 - (x - i)
            weights = [
                u**5,
                26 - 50 * t + 20 * t**2 + 20 * t**3 - 20 * t**4 + 5 * t**5,
                66 - 60 * t**2 + 30 * t**4 - 10 * t**5,
                66 - 60 * u**2 + 30 * u**4 - 10 * u**5,
                26 - 50 * u + 20 * u**2 + 20 * u**3 - 20 * u**4 + 5 * u**5,
                t**5,
            ]
            z += left * (1 - gone) * np.dot(weights, coefficients[(i + np.arange(-2, 4)) % places]) / 120
        left = left * gone if gone < 1.0 else 1.0
    if approach:
        full = header["full_from_last_row"] and w > loads[-1]
        a, b = header["mean_law"]
        z += a + b * w**1.5 if full else hermite(arrays["means"][0], arrays["means"][1], r, s, width)
    g = min(w / header["lift_load"], 1.0)
    return float(z * g**3 * (10 - 15 * g + 6 * g * g))


def read(path: Path, quantity: str, rate: int, places: Real, speeds: Real, loads: Real) -> Real:
    """Return the quantity (SI) at every frame of a motion, from places (m), speeds (m/s) and loads (N)."""
    header, arrays = load(path)
    stride = 1
    while 2 * stride <= min(rate / (10 * header["band"]), 8):
        stride *= 2
    held = quantity in ("displacement", "approach")
    order = {"velocity": 1, "acceleration": 2}.get(quantity, 0)
    b = np.array(header["filters"]["displacement" if held else quantity])
    z: list[float] = []
    found = np.empty(len(places))
    for frame in range(len(places)):
        j = frame % stride
        if j == 0:
            now = taken(header, arrays, quantity == "approach", places[frame], speeds[frame], loads[frame])
            z = [*z[1:], now] if z else [now] * 8
        found[frame] = held * z[3] + (rate / stride) ** order * np.dot(b[8 * j // stride], np.diff(z))
    return found
