"""Sobol indices of a function whose indices are known in closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest

from synth.study.samples import indices_of
from synth.study.spec import read_spec

AXES = {name: {"from": 1.0, "to": 2.0} for name in ("groups.ridges", "groups.period_ratio", "groups.load")}


def test_the_indices_of_ishigami() -> None:
    """sin x + 7 sin^2 y + 0.1 z^4 sin x over -pi to pi (Ishigami & Homma, 1990)."""
    spec = read_spec({"axes": AXES, "sample": {"kind": "saltelli", "count": 4096}})
    x, y, z = (math.pi * (2.0 * np.array(column) - 3.0) for column in spec.columns().values())
    found, spread = indices_of(np.sin(x) + 7.0 * np.sin(y) ** 2 + 0.1 * z**4 * np.sin(x), 3)
    first, between = 0.5 * (1.0 + 0.1 * math.pi**4 / 5.0) ** 2, 0.01 * math.pi**8 * (1.0 / 18.0 - 1.0 / 50.0)
    squares = 49.0 / 8.0
    whole = first + between + squares
    assert found.first_order == pytest.approx([first / whole, squares / whole, 0.0], abs=0.02)
    assert found.total_order == pytest.approx([(first + between) / whole, squares / whole, between / whole], abs=0.02)
    assert np.all(spread.first_order.confidence_interval.low <= found.first_order)
