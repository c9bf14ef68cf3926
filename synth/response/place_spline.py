"""One level over place: a periodic quintic spline whose harmonics 1 to N are exactly those of the response.

Stage   RESPONSE: one level of a table.
Model   s(theta) = sum over i of c_i B(P theta - i), with B the centred B-spline of degree 5. Its harmonic n is
        C_n sinc(n / P)^6, where C_n is harmonic n of the coefficients. So C_n = Z_n / sinc(n / P)^6 makes harmonics 1
        to N exact. A value is read in vectors of eight: the sum over i of w_i(t) (a z0_i + b d0_i + c z1_i + d d1_i).
        The w_i are the pieces of the B-spline, by Horner's scheme for all taps at once; z and d are values and slopes
        of the lower and the upper row of load.
Source  Unser, Splines: a perfect fit for signal and image processing (1999). LLVM language reference: vectors,
        llvm.fmuladd. The readable twin of the reading is `swing` of tests/reference/slow_table_reading.py.
Limits  Images of harmonic n lie at P - n, (n / (P - n))^6 as strong: with 5.5 places per harmonic, 1e-4 of the highest
        harmonic, and 2e-3 of it in acceleration, most of which the reading filter removes. numba does not vectorise
        a plain sum, which takes three times as long.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from synth.arrays import Array
from synth.response.demand import Complex

TAPS = 6  # coefficients per value
FIRST = 2  # of the taps lie before the cell of the place
PADDING = 8  # coefficients repeated at the end of a period, so that a reader need not wrap around
LANES = 8  # taps read at a time; the last two have no weight
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


def spline_coefficients(harmonics: Complex, highest: int, places: int) -> Array:
    """Return the coefficients [rows, places] of harmonics 1 to `highest` of the series [rows, harmonics]."""
    series = np.zeros((len(harmonics), places // 2 + 1), dtype=np.complex128)
    n = np.arange(1, highest + 1)
    series[:, 1 : highest + 1] = harmonics[:, 1 : highest + 1] / np.sinc(n / places) ** TAPS
    return np.asarray(np.fft.irfft(series, places, axis=1) * places)


def padded(coefficients: Any) -> Any:
    """Return the coefficients as [..., places + PADDING], so that the taps of cell i begin at index i."""
    places = coefficients.shape[-1]
    return coefficients[..., (np.arange(places + PADDING) - FIRST) % places]


@intrinsic
def spline_value(typing: Any, pool: Any, at: Any, half: Any, t: Any, a: Any, b: Any, c: Any, d: Any) -> Any:
    """Return the spline at 0 <= t < 1 of the cell whose taps begin at pool[at], a float32 array.

    half: offset from the values of a row to its slopes, and from these to the values of the next row.
    a, b, c, d: weights of value and slope of the lower row, then of the upper row.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        """Write the instructions: `arguments` are the values of the call, in LLVM's form."""
        data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        _pool, at, half, t, *load = arguments
        name = builder.module.globals.get(FUSED)
        fused = name or ir.Function(builder.module, ir.FunctionType(EIGHT, [EIGHT] * 3), FUSED)

        def spread(number: Any) -> Any:
            """Return a vector of LANES copies of `number`."""
            one = builder.insert_element(ir.Constant(EIGHT, ir.Undefined), number, LANE(0))
            return builder.shuffle_vector(one, one, ir.Constant(ir.VectorType(LANE, LANES), [0] * LANES))

        def taps(place: Any) -> Any:
            """Return the taps that begin at `place` of the pool, as float64."""
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
    """Return the sum of the lanes of `vector`, added pairwise."""
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
