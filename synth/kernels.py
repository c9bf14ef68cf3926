"""The decorators that compile kernels, with the options of Numba in one place.

Model   `kernel` compiles a function that runs without the GIL, and keeps the machine code on disk. `inner`, `inlined`,
        `summing` and `unfused` are for functions that kernels call. They have no wrappers and therefore compile
        several times faster.
        Rounding: products and sums may be fused, which rounds once less. Only `summing` reorders operations, so the
        same scene gives the same samples on the same machine. `unfused` is for functions that depend on every rounding.
        Python calls only `kernel` and `signed_kernel`, which are kept on disk (`kernel_cache`).
Limits  Numba infers types: these functions have no annotations, and mypy does not check them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast

from numba import njit, types
from numba.extending import intrinsic, is_jitted

from synth.kernel_cache import KernelCache

Function = Callable[..., Any]
Decorator = Callable[[Function], Function]

ALL: dict[str, Any] = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}  # C never calls kernels
INNER: dict[str, Any] = {**ALL, "no_cpython_wrapper": True}  # a wrapper for Python doubles the time to compile
FUSED = {"contract"}
COMPILES = is_jitted(njit(lambda x: x))  # not with NUMBA_DISABLE_JIT

inner: Decorator = njit(**INNER, fastmath=FUSED)
"""Compiles a function that kernels call. Python cannot call it."""
inlined: Decorator = njit(**INNER, forceinline=True, fastmath=FUSED)
"""Compiles a function that is inlined at every call in a kernel. Python cannot call it."""
summing: Decorator = njit(**INNER, fastmath={*FUSED, "reassoc", "nsz"})
"""Compiles as `inner` does, but sums in the fastest order. For loops that only add."""
unfused: Decorator = njit(**INNER)
"""Compiles as `inner` does, but rounds every product and every sum separately."""


def kernel(function: Function) -> Function:
    """Compile a function that runs without the GIL and is kept on disk."""
    return cast(Function, _kept(function, FUSED))


def signed_kernel(signature: str, *, fused: bool = True) -> Decorator:
    """Return a decorator that compiles as `kernel` does, but when the module is imported, not at the first call.

    signature: types of the result and the arguments.
    fused: whether products and sums may be fused; False rounds as `unfused` does.
    Functions that run during playback have a signature, so that no compilation interrupts it.
    """

    def compiled(function: Function) -> Function:
        made = _kept(function, FUSED if fused else set())
        if COMPILES:
            made.compile(signature)
            made.disable_compile()
        return cast(Function, made)

    return compiled


def _kept(function: Function, fastmath: set[str]) -> Any:
    made: Any = njit(**ALL, fastmath=fastmath)(function)
    if COMPILES:
        made._cache = KernelCache(function)  # what njit(cache=True) does, with a cache of Numba
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
