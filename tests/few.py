"""Parameters of tests: some of them in every run, the others with `-m thorough`.

A few scenes spread over a list show what all of them show; a machine that runs every case runs no other test meanwhile.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from typing import Any

import pytest


def few(values: Iterable[Any], shown: int) -> list[Any]:
    """Return the values as parameters: `shown` of them, spread from the first to the last, and the others thorough."""
    every = list(values)
    kept = {round(place * (len(every) - 1) / max(shown - 1, 1)) for place in range(shown)}
    return [value if number in kept else thorough(value) for number, value in enumerate(every)]


def paired(*axes: Iterable[Any]) -> list[Any]:
    """Return the product of the axes as parameters: each value of each axis at least once, and the others thorough."""
    lists = [list(axis) for axis in axes]
    kept = {tuple(number % len(axis) for axis in lists) for number in range(max(map(len, lists)))}
    places = itertools.product(*(range(len(axis)) for axis in lists))
    return [
        values if place in kept else thorough(*values)
        for place in places
        for values in [tuple(axis[number] for axis, number in zip(lists, place, strict=True))]
    ]


def thorough(*values: Any) -> Any:
    """Return a parameter of the tests that only a thorough run has."""
    return pytest.param(*values, marks=pytest.mark.thorough)
