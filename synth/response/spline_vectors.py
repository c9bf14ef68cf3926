"""One value of a table, in vectors: six taps of a quintic spline, each a cubic over the load.

Stage   RESPONSE, the innermost step of `reading_loop`.
Model   sum over i of w_i(t) (a z0_i + b d0_i + c z1_i + d d1_i): w_i the pieces of the B-spline of degree 5, by
        Horner's scheme for all taps at once; z, d values and slopes of the lower and the upper row of load.
Source  LLVM language reference: vectors, llvm.fmuladd. The readable twin is `swing` of
        tests/reference/slow_table_reading.py.
Limits  numba does not find these vectors by itself: the plain sum takes one and a half times as long.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

LANES = 8  # taps read at a time, the last two of no weight
PIECES = (  # of t^0 to t^5, for each tap, times 120
    (1.0, 26.0, 66.0, 26.0, 1.0, 0.0),
    (-5.0, -50.0, 0.0, 50.0, 5.0, 0.0),
    (10.0, 20.0, -60.0, 20.0, 10.0, 0.0),
    (-10.0, 20.0, 0.0, -20.0, 10.0, 0.0),
    (5.0, -20.0, 30.0, -20.0, 5.0, 0.0),
    (-1.0, 5.0, -10.0, 10.0, -5.0, 1.0),
)
REAL, INDEX, LANE = ir.DoubleType(), ir.IntType(64), ir.IntType(32)
EIGHT, EIGHT_SINGLE = ir.VectorType(REAL, LANES), ir.VectorType(ir.FloatType(), LANES)
FUSED = "llvm.fmuladd.v8f64"


@intrinsic
def spline_value(typing: Any, pool: Any, at: Any, half: Any, t: Any, a: Any, b: Any, c: Any, d: Any) -> Any:
    """Return the spline at 0 <= t < 1 of the cell whose taps begin at pool[at], a float32 array.

    half: from the values of a row to its slopes, and from these to the next row. a, b, c, d: weights of value and slope
    of the lower row, and of the upper.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        _pool, at, half, t, *load = arguments
        name = builder.module.globals.get(FUSED)
        fused = name or ir.Function(builder.module, ir.FunctionType(EIGHT, [EIGHT] * 3), FUSED)

        def spread(number: Any) -> Any:
            one = builder.insert_element(ir.Constant(EIGHT, ir.Undefined), number, LANE(0))
            return builder.shuffle_vector(one, one, ir.Constant(ir.VectorType(LANE, LANES), [0] * LANES))

        def taps(place: Any) -> Any:
            pointer = builder.bitcast(builder.gep(data, [place]), EIGHT_SINGLE.as_pointer())
            return builder.fpext(builder.load(pointer, align=4), EIGHT)

        value = builder.fmul(taps(at), spread(load[0]))
        for weight in load[1:]:
            at = builder.add(at, half)
            value = builder.call(fused, [taps(at), spread(weight), value])
        powers = [ir.Constant(EIGHT, [*(one / 120.0 for one in row), 0.0, 0.0]) for row in PIECES]
        weights = powers[5]
        for row in powers[4::-1]:
            weights = builder.call(fused, [weights, spread(t), row])
        return summed(builder, builder.fmul(weights, value))

    return types.float64(pool, types.int64, types.int64, *([types.float64] * 5)), generate


def summed(builder: Any, vector: Any) -> Any:
    """Return the sum of the lanes of `vector`, halves on halves."""
    lanes = LANES
    while lanes > 1:
        lanes //= 2
        low, high = (
            builder.shuffle_vector(
                vector, vector, ir.Constant(ir.VectorType(LANE, lanes), list(range(first, first + lanes)))
            )
            for first in (0, lanes)
        )
        vector = builder.fadd(low, high)
    return builder.extract_element(vector, LANE(0))
