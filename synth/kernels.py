"""The decorators that compile kernels, with the options of Numba in one place.

Model   `kernel` compiles a function that runs without the GIL, and keeps the machine code on disk. `inner`, `inlined`,
        `summing` and `unfused` are for functions that kernels call. They have no wrappers and therefore compile
        several times faster.
        Rounding: products and sums may be fused, which rounds once less. Only `summing` reorders operations, so the
        same scene gives the same samples on the same machine. `unfused` is for functions that depend on every rounding.
        Cache: Numba keeps a kernel on disk until the kernel's own file changes. A kernel also contains the code that it
        calls in other files. This module therefore deletes kernels that are older than the newest source.
Limits  Only kernels that are kept next to their source are deleted. If NUMBA_CACHE_DIR is set, empty that folder after
        a change of the code. Numba infers types: these functions have no annotations, and mypy does not check them.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from pathlib import Path
from time import time
from typing import Any

from numba import njit, types
from numba.extending import intrinsic

Function = Callable[..., Any]
Decorator = Callable[[Function], Function]

HERE = Path(__file__).parent
FOLDERS = ("contact", "response", "motion", "effects/simulation", "voice", "surfaces", "surfaces/measurement")
"""Folders with kernels."""


def forget_stale_kernels(root: Path, names: tuple[str, ...]) -> None:
    """Delete the cache indexes of kernels that are older than the newest source in `root` and its folders `names`."""
    folders = [root, *(folder for folder in (root / name for name in names) if folder.is_dir())]
    newest = max(source.stat().st_mtime for folder in folders for source in folder.glob("*.py"))
    if newest > time():  # the clock is wrong: every start would delete all kernels
        return
    for index in (index for folder in folders for index in (folder / "__pycache__").glob("*.nbi")):
        with contextlib.suppress(OSError):  # another process was faster, or the folder is not writable
            if index.stat().st_mtime < newest:
                index.unlink()


forget_stale_kernels(HERE, FOLDERS)

ALL: dict[str, Any] = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}  # C never calls kernels
KEPT: dict[str, Any] = {**ALL, "cache": True}
INNER: dict[str, Any] = {**ALL, "no_cpython_wrapper": True}  # a wrapper for Python doubles the time to compile
FUSED = {"contract"}


kernel: Decorator = njit(**KEPT, fastmath=FUSED)
"""Compiles a function that runs without the GIL and is kept on disk."""
inner: Decorator = njit(**INNER, fastmath=FUSED)
"""Compiles a function that kernels call. Python cannot call it."""
inlined: Decorator = njit(**INNER, forceinline=True, fastmath=FUSED)
"""Compiles a function that is inlined at every call in a kernel. Python cannot call it."""
summing: Decorator = njit(**INNER, fastmath={*FUSED, "reassoc", "nsz"})
"""Compiles as `inner` does, but sums in the fastest order. For loops that only add."""
unfused: Decorator = njit(**INNER)
"""Compiles as `inner` does, but rounds every product and every sum separately."""


def signed_kernel(signature: str, *, fused: bool = True) -> Decorator:
    """Return a decorator that compiles as `kernel` does, but when the module is imported, not at the first call.

    signature: types of the result and the arguments.
    fused: whether products and sums may be fused; False rounds as `unfused` does.
    Functions that run during playback have a signature, so that no compilation interrupts it.
    """
    made: Decorator = njit(signature, **KEPT, fastmath=FUSED if fused else set())
    return made


def _fma(typing: Any, a: Any, b: Any, c: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.fma(*arguments)

    return types.float64(types.float64, types.float64, types.float64), generate


fma: Function = intrinsic(_fma)
"""Returns a b + c, rounded once. In `unfused` functions fma(a, b, -p) is the rounding error of a product p = a b.

Source: LLVM language reference, llvm.fma. A processor without the instruction calls the C library, which is slow."""


@unfused
def two_product(a: float, b: float) -> tuple[float, float]:
    """Return the rounded product a b and its rounding error, which is exact."""
    product = a * b
    return product, fma(a, b, -product)
