"""How the compiled loops are compiled: one place for the options of numba.

Model   `kernel` compiles a function without the GIL and keeps the machine code on disk. `inner`, `inlined`, `summing`
        and `unfused` are for the functions that kernels call: without wrappers, they compile several times faster.
        Products and sums may be fused (one rounding fewer); nothing else is reordered but in `summing`, so the same
        scene gives the same samples on the same machine. `unfused` is for what counts on every rounding. numba keeps a
        kernel until its own file changes; a kernel also holds what it calls in other files, so what is older than the
        newest of these is forgotten here.
Limits  only kernels kept beside their source are forgotten so: with NUMBA_CACHE_DIR set, empty it after a change. numba
        infers the types: these functions carry none, and mypy does not look into them.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from pathlib import Path
from time import time
from typing import Any

from numba import njit

Function = Callable[..., Any]
Decorator = Callable[[Function], Function]

HERE = Path(__file__).parent
FOLDERS = ("contact", "response", "motion", "effects/simulation", "voice", "surfaces")  # those with compiled loops


def forget_stale_kernels(root: Path, names: tuple[str, ...]) -> None:
    """Delete the indexes of compiled kernels, in `root` and its folders `names`, that are older than a source there."""
    folders = [root, *(folder for folder in (root / name for name in names) if folder.is_dir())]
    newest = max(source.stat().st_mtime for folder in folders for source in folder.glob("*.py"))
    if newest > time():  # a wrong clock: everything would be older, at every start
        return
    for index in (index for folder in folders for index in (folder / "__pycache__").glob("*.nbi")):
        with contextlib.suppress(OSError):  # another process was quicker, or the folder is not ours to change
            if index.stat().st_mtime < newest:
                index.unlink()


forget_stale_kernels(HERE, FOLDERS)

ALL: dict[str, Any] = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}  # a wrapper for C: no one asks
KEPT: dict[str, Any] = {**ALL, "cache": True}
INNER: dict[str, Any] = {**ALL, "no_cpython_wrapper": True}  # nor for Python: half of a small function's compilation
FUSED = {"contract"}


kernel: Decorator = njit(**KEPT, fastmath=FUSED)
"""Compiles a function, GIL-free and kept on disk."""
inner: Decorator = njit(**INNER, fastmath=FUSED)
"""Compiles a part of the kernels that call it; Python cannot call it."""
inlined: Decorator = njit(**INNER, forceinline=True, fastmath=FUSED)
"""Compiles a function into whatever kernel calls it, at every place; Python cannot call it."""
summing: Decorator = njit(**INNER, fastmath={*FUSED, "reassoc", "nsz"})
"""Compiles as `inner` does, with sums in whatever order is fastest: for loops that only add."""
unfused: Decorator = njit(**INNER)
"""Compiles as `inner` does, with every product and every sum rounded by itself."""


def signed_kernel(signature: str, *, fused: bool = True) -> Decorator:
    """Return what compiles a function of `signature` as `kernel` does, when its module is first imported.

    fused: False compiles as `unfused` does. What runs while something plays has a signature: nothing is compiled then.
    """
    made: Decorator = njit(signature, **KEPT, fastmath=FUSED if fused else set())
    return made


@unfused
def two_product(a: float, b: float) -> tuple[float, float]:
    """Return a b rounded, and what the rounding left out, exactly (Dekker, 1971), for |a| and |b| below 1e300."""
    product = a * b
    far, high = 134217729.0 * a, 134217729.0 * b  # 2^27 + 1: each factor is split into halves of 26 bits
    a1, b1 = far - (far - a), high - (high - b)
    a2, b2 = a - a1, b - b1
    return product, ((a1 * b1 - product) + a1 * b2 + a2 * b1) + a2 * b2
