"""How the compiled loops are compiled: one place for the options of numba.

Model   `kernel` compiles a function without the GIL and keeps the machine code on disk; `inlined` is for the small
        functions inside the loops. Products and sums may be fused (one rounding fewer); nothing else is reordered, so
        the same scene gives the same samples on the same machine.
Limits  numba infers the types: these functions carry none, and mypy does not look into them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba import njit

Function = Callable[..., Any]


def kernel(function: Function) -> Function:
    """Return `function` compiled, GIL-free and kept on disk."""
    compiled: Function = njit(nogil=True, cache=True, error_model="numpy", fastmath={"contract"})(function)
    return compiled


def inlined(function: Function) -> Function:
    """Return `function` compiled into whatever kernel calls it."""
    compiled: Function = njit(inline="always", nogil=True, cache=True, error_model="numpy", fastmath={"contract"})(
        function
    )
    return compiled
