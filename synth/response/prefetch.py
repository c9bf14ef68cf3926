"""Asking the memory for what a compiled loop reads some frames later, so that it does not wait for it then.

Model   A frame of a hand reads a cell of 64 to 192 bytes that no frame near it reads. The tables of many hands do not
        fit into the caches, so a loop that does not ask ahead waits for every cell. A prefetch has no effect on
        values, and does nothing at an address where nothing is.
Source  llvm.prefetch (LLVM language reference).
Limits  what is asked for goes by the line of 64 bytes, that of the processors which we know.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from synth.kernels import inlined

AHEAD = 8  # frames: at 10 to 20 ns a frame, about the time that main memory takes to answer; 24 are no quicker
LINE = 64  # bytes
FOR_READING, INTO_EVERY_CACHE, DATA = 0, 3, 1  # what llvm.prefetch is told


@intrinsic
def prefetch_line(typing: Any, pool: Any, at: Any) -> Any:
    """Ask for the line of memory in which the entry `at` of the array `pool` lies."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array = context.make_array(signature.args[0])(context, builder, arguments[0])
        number, address = ir.IntType(32), ir.IntType(8).as_pointer()
        place = builder.bitcast(builder.gep(array.data, [arguments[1]]), address)
        kind = ir.FunctionType(ir.VoidType(), [address, number, number, number])
        call = builder.module.declare_intrinsic("llvm.prefetch", [address], kind)
        builder.call(call, [place, *(ir.Constant(number, told) for told in (FOR_READING, INTO_EVERY_CACHE, DATA))])
        return context.get_dummy_value()

    return types.void(pool, at), generate


@inlined
def prefetch_cell(pool, phase, bits, size, offset):
    """Ask for the cell of `phase` in a table of `pool`; the arguments are those of `evaluation.place`."""
    at = np.uint64(offset) + size * (phase >> (np.uint64(64) - bits))
    last = at + size - np.uint64(1)
    a_line = np.uint64(LINE // pool.itemsize)
    while at < last:
        prefetch_line(pool, at)
        at += a_line
    prefetch_line(pool, last)
