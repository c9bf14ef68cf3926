"""A cell of a table of degree 5, read as LLVM's vectors of four: the response there and how it changes in time.

Model   In a cell R(t, s) = sum over i of t^i (c_i0 + c_i1 s + c_i2 s^2 + c_i3 s^3): t the place along the phase, s that
        along the load. The four columns are carried through Horner's scheme for t side by side, with the first and half
        the second derivative over t (synthetic division), and then weighted by the powers of s and their derivatives:

            R   = P . S                         dR/dt = P' . S t' + P . S' s'
            d2R = P'' . S t'^2 + P' . (S t'' + 2 S' t' s') + P . (S'' s'^2 + S' s'')

Source  design, section 4; coefficients: `tables`. LLVM language reference: vectors, llvm.fmuladd. The readable twin is
        `cell_rates` of tests/reference/slow_reading.py.
Limits  the compiler does not find these vectors by itself: a frame takes half of the time that it takes of the plain
        formula. Where the processor fuses products and sums, so do they; nothing else depends on it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

COLUMNS = 4  # powers of s
REAL, INDEX, LANE = ir.DoubleType(), ir.IntType(64), ir.IntType(32)
QUAD = ir.VectorType(REAL, COLUMNS)
FUSED = "llvm.fmuladd.v4f64"


@intrinsic
def surface_rates(
    typing: Any, pool: Any, at: Any, t: Any, s: Any, turn_rate: Any, turn_bend: Any, load_rate: Any, load_bend: Any
) -> Any:
    """Return R and its first and second total time derivative from the 24 coefficients at pool[at].

    turn_rate, turn_bend: dt/dt and d2t/dt2 in cells a second; load_rate, load_bend: the same of s.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array = context.make_array(signature.args[0])(context, builder, arguments[0])
        real = context.get_data_type(signature.args[0].dtype)
        cell = Cell(builder, builder.gep(array.data, [arguments[1]]), real)
        return context.make_tuple(builder, signature.return_type, cell.rates(*arguments[2:]))

    three: Any = types.UniTuple
    return three(types.float64, 3)(pool, at, t, s, turn_rate, turn_bend, load_rate, load_bend), generate


class Cell:
    """Writes the instructions for the cell whose coefficients, of type `real`, begin at `address`."""

    def __init__(self, builder: Any, address: Any, real: Any) -> None:
        self._builder, self._address, self._real = builder, address, real
        module = builder.module
        self._fmuladd = module.globals.get(FUSED) or ir.Function(module, ir.FunctionType(QUAD, [QUAD] * 3), FUSED)

    def rates(self, t: Any, s: Any, turn_rate: Any, turn_bend: Any, load_rate: Any, load_bend: Any) -> Sequence[Any]:
        """Return R, dR/dt and d2R/dt2."""
        times, fused, spread = self._builder.fmul, self._fused, self._spread
        value, slope, half_bend = self._columns(spread(t))
        powers, first, second = self._powers(s)
        twice = times(REAL(2.0), turn_rate)
        rate = fused(slope, times(powers, spread(turn_rate)), times(value, times(first, spread(load_rate))))
        by_bend = times(powers, spread(times(twice, turn_rate)))
        by_slope = fused(powers, spread(turn_bend), times(first, spread(times(twice, load_rate))))
        by_value = fused(second, spread(times(load_rate, load_rate)), times(first, spread(load_bend)))
        bend = fused(half_bend, by_bend, fused(slope, by_slope, times(value, by_value)))
        return [self._sum(quad) for quad in (times(value, powers), rate, bend)]

    def _columns(self, t: Any) -> tuple[Any, Any, Any]:
        """Return of each column the polynomial at t, its first and half its second derivative."""
        fused = self._fused
        value, slope = fused(self._row(5), t, self._row(4)), self._row(5)
        value, slope, half_bend = fused(value, t, self._row(3)), fused(slope, t, value), slope
        for row in (2, 1, 0):
            half_bend = fused(half_bend, t, slope)
            slope = fused(slope, t, value)
            value = fused(value, t, self._row(row))
        return value, slope, half_bend

    def _powers(self, s: Any) -> tuple[Any, Any, Any]:
        """Return 1, s, s^2, s^3 and their first and second derivatives."""
        times = self._builder.fmul
        square = times(s, s)
        first = [REAL(0.0), REAL(1.0), times(REAL(2.0), s), times(REAL(3.0), square)]
        second = [REAL(0.0), REAL(0.0), REAL(2.0), times(REAL(6.0), s)]
        return self._packed([REAL(1.0), s, square, times(square, s)]), self._packed(first), self._packed(second)

    def _row(self, row: int) -> Any:
        """Return the coefficients of t^row."""
        place = self._builder.gep(self._address, [INDEX(COLUMNS * row)])
        quad = ir.VectorType(self._real, COLUMNS)
        width = 4 if self._real == ir.FloatType() else 8  # bytes: cells begin wherever they do
        read = self._builder.load(self._builder.bitcast(place, quad.as_pointer()), align=width)
        return read if self._real == REAL else self._builder.fpext(read, QUAD)

    def _fused(self, one: Any, other: Any, added: Any) -> Any:
        return self._builder.call(self._fmuladd, [one, other, added])

    def _spread(self, number: Any) -> Any:
        return self._packed([number] * COLUMNS)

    def _packed(self, numbers: Sequence[Any]) -> Any:
        quad = ir.Constant(QUAD, ir.Undefined)
        for lane, number in enumerate(numbers):
            quad = self._builder.insert_element(quad, number, LANE(lane))
        return quad

    def _sum(self, quad: Any) -> Any:
        one, other, third, fourth = (self._builder.extract_element(quad, LANE(lane)) for lane in range(COLUMNS))
        return self._builder.fadd(self._builder.fadd(one, third), self._builder.fadd(other, fourth))
