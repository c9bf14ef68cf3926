"""How the compiled loops are compiled: one place for the options of numba.

Model   `kernel` compiles a function without the GIL and keeps the machine code on disk; `inlined` is for the small
        functions inside the loops. Products and sums may be fused (one rounding fewer); nothing else is reordered but
        in `summing`, so the same scene gives the same samples on the same machine. `unfused` is for what counts on
        every rounding. numba keeps a kernel until its own file changes; a kernel also holds what it calls in other
        files, so what is older than the newest of these is forgotten here.
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


def kernel(function: Function) -> Function:
    """Return `function` compiled, GIL-free and kept on disk."""
    compiled: Function = njit(nogil=True, cache=True, error_model="numpy", fastmath={"contract"})(function)
    return compiled


def signed_kernel(signature: str, *, fused: bool = True) -> Callable[[Function], Function]:
    """Return what compiles a function of `signature` as `kernel` does, when its module is first imported.

    fused: False compiles as `unfused` does. What runs while something plays has a signature: nothing is compiled then.
    """
    rules = {"contract"} if fused else set()

    def compiled(function: Function) -> Function:
        made: Function = njit(signature, nogil=True, cache=True, error_model="numpy", fastmath=rules)(function)
        return made

    return compiled


def summing(function: Function) -> Function:
    """Return `function` compiled as `kernel` does, with sums in whatever order is fastest: for loops that only add."""
    compiled: Function = njit(nogil=True, cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"})(
        function
    )
    return compiled


def inlined(function: Function) -> Function:
    """Return `function` compiled into whatever kernel calls it."""
    compiled: Function = njit(inline="always", nogil=True, cache=True, error_model="numpy", fastmath={"contract"})(
        function
    )
    return compiled


def unfused(function: Function) -> Function:
    """Return `function` compiled with every product and every sum rounded by itself."""
    compiled: Function = njit(nogil=True, cache=True, error_model="numpy")(function)
    return compiled


@unfused
def two_product(a: float, b: float) -> tuple[float, float]:
    """Return a b rounded, and what the rounding left out, exactly (Dekker, 1971), for |a| and |b| below 1e300."""
    product = a * b
    far, high = 134217729.0 * a, 134217729.0 * b  # 2^27 + 1: each factor is split into halves of 26 bits
    a1, b1 = far - (far - a), high - (high - b)
    a2, b2 = a - a1, b - b1
    return product, ((a1 * b1 - product) + a1 * b2 + a2 * b1) + a2 * b2
