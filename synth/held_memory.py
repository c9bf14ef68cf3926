"""The memory that objects keep alive, counted by following their references.

Stage   None: a tool of all stages.
Model   Every object that is reachable counts once, with the size that Python and NumPy report. A view counts with the
        array that it reads. Objects of LARGE bytes or more are listed by identity, so that what several scenes share
        counts once in their sum.
Limits  Types, modules and the globals of functions are not followed. Nor is a cache (`CountsItself`), which is counted
        by itself. Compiled kernels and the allocator's own memory are not counted. Takes 1 us per object.
"""

from __future__ import annotations

import gc
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import _lru_cache_wrapper
from itertools import chain
from types import BuiltinFunctionType, CodeType, FrameType, FunctionType, ModuleType
from typing import Any

import numpy as np

LARGE = 4096  # bytes: what scenes share and is smaller does not matter in a sum
MANY, FLOAT = 512, 24  # numbers that are counted together, as the points of a track; bytes of one
NOT_FOLLOWED = (type, ModuleType, CodeType, FrameType, BuiltinFunctionType, _lru_cache_wrapper)


class CountsItself:
    """What `held_by` does not follow: it is shared, and has a count of its own."""


@dataclass(frozen=True, slots=True)
class Held:
    """The memory of some objects.

    small: bytes of all objects below LARGE.
    large: bytes of every other object, by its identity, which is valid while the object lives.
    """

    small: int = 0
    large: Mapping[int, int] = field(default_factory=dict)

    @property
    def bytes(self) -> int:
        """All of it."""
        return self.small + sum(self.large.values())


def held_by(*roots: object) -> Held:
    """Return the memory of everything that is reachable from `roots`."""
    seen: set[int] = set()
    small, large = 0, dict[int, int]()
    waiting: list[Any] = list(roots)
    while waiting:
        one = waiting.pop()
        if id(one) in seen or isinstance(one, (*NOT_FOLLOWED, CountsItself)):
            continue
        seen.add(id(one))
        size, numbers = sys.getsizeof(one), _numbers_in(one)
        if numbers:
            large[id(one)] = size + numbers
            continue
        if size < LARGE:
            small += size
        else:
            large[id(one)] = size
        waiting += _referents(one)
    return Held(small, large)


def _numbers_in(one: Any) -> int:
    """Return the bytes within a long tuple of numbers, or of short tuples of numbers; 0 for anything else."""
    if type(one) is not tuple or len(one) < MANY:
        return 0
    kinds, rows = set(map(type, one)), 0
    if kinds == {tuple}:
        kinds, rows = set(map(type, chain.from_iterable(one))), sum(map(sys.getsizeof, one))
        one = tuple(chain.from_iterable(one))
    return rows + FLOAT * len(one) if kinds <= {float, int} else 0


def _referents(one: Any) -> Iterable[Any]:
    if isinstance(one, np.ndarray):  # the collector does not know what it refers to
        return () if one.base is None else (one.base,)
    if isinstance(one, FunctionType):
        return (*(one.__closure__ or ()), *(one.__defaults__ or ()))
    if type(one).__module__.startswith("numba"):
        return ()
    return gc.get_referents(one)


def bytes_together(held: Iterable[Held]) -> int:
    """Return the memory of all of `held` together; what they share counts once."""
    small, large = 0, dict[int, int]()
    for one in held:
        small += one.small
        large.update(one.large)
    return small + sum(large.values())
