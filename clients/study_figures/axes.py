"""What the figures share: axes of a study in the units of a reader."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from clients.figure_look import Real

if TYPE_CHECKING:
    from xarray import Dataset

SHOWN = {"m": ("mm", 1e3), "m/s": ("mm/s", 1e3)}
"""Unit of the dataset: the unit that is shown, and its factor."""
SMALL = 1e-4  # m: lengths up to here are shown in um


def in_unit(found: Dataset, name: str) -> tuple[Real, str]:
    """Return the values of an axis and its label, in the unit that is shown."""
    unit, factor = SHOWN.get(found[name].attrs["units"], (found[name].attrs["units"], 1.0))
    if unit == "mm" and np.max(found[name].values) <= SMALL:
        unit, factor = "um", 1e6
    words = name.replace(".", " ").replace("_", " ")
    return np.asarray(factor * found[name].values, np.float64), f"{words} ({unit})" if unit else words


def is_number(found: Dataset, name: str) -> bool:
    """Return whether an axis has numbers."""
    return bool(np.issubdtype(found[name].dtype, np.number))


def is_log(values: Real) -> bool:
    """Return whether an axis is better drawn at equal ratios."""
    return bool(np.min(values) > 0.0 and np.max(values) >= 8.0 * np.min(values))
