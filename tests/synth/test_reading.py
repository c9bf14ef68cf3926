"""The compiled loops against their readable twin, and against a surface whose derivatives are known in closed form."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest

from synth.kernels import kernel
from synth.response.cell_rates import surface_rates
from synth.response.cell_reading import read_displacement, read_rate
from synth.response.evaluation import gate
from synth.response.phase_cells import CUBIC, QUINTIC, surface
from synth.response.phases import turns_to_phase
from synth.response.speed_levels import Levels, levels_up_to
from tests.reference import slow_reading
from tests.synth.engine_cases import Real

RATE, PERIOD, LIFT = 48000.0, 0.8e-3, 1e-3
EDGES = np.array([0.0, 0.2, 0.5, 1.1])
NOWHERE = np.empty(0)


def series(highest: int, seed: int) -> Any:
    random = np.random.default_rng(seed)
    n = np.maximum(np.arange(highest + 1), 1)
    return (random.normal(size=highest + 1) + 1j * random.normal(size=highest + 1)) / n**2.5


class Tables:
    """Random tables of three levels over three intervals, as the compiled loops and as the twin take them."""

    def __init__(self, degree: int, missing: tuple[int, int] | None = None) -> None:
        self.levels: Levels = levels_up_to(3)
        assert self.levels.highest == (3, 2, 1)
        width, blocks, used = degree + 1, [], 0
        self.table = np.full((3, 1 + 3), -1, dtype=np.int64)
        slow = []
        for level, highest in enumerate(self.levels.highest):
            cells = 16 << (2 - level)
            self.table[level, 0] = cells.bit_length() - 1
            made: list[Real | None] = []
            for interval in range(3):
                block = surface(tuple(series(highest, 40 * interval + 7 * power) for power in range(4)), degree, cells)
                assert block.shape == (cells, width, 4)
                if (level, interval) != missing:
                    self.table[level, 1 + interval] = used
                    blocks.append(block.ravel())
                    used += block.size
                made.append(None if (level, interval) == missing else block)
            fade_from, fade_to = float(self.levels.fade_from[level]), float(self.levels.fade_to[level])
            slow.append(slow_reading.Level(tuple(made), fade_from, fade_to))
        self.pool, self.slow = np.concatenate(blocks), tuple(slow)

    def layout(self, gain: float = 1.0, hold: float = 1.0) -> Real:
        return np.concatenate([[RATE, PERIOD, LIFT, gain, hold], self.levels.fade_from, self.levels.fade_to, EDGES])

    def compiled(self, motion: Real, position: Real, order: int, phase: int = 0, hold: float = 1.0) -> tuple[Real, int]:
        """Return the samples as float64 and the phase after the last."""
        out = np.full((motion.shape[1], 2), np.nan, dtype=np.float32)
        state = np.array([phase], dtype=np.uint64)
        layout = self.layout(hold=hold)
        if order == 0:
            stop = read_displacement(self.pool, self.table, layout, state, motion, position, 0, out, 1)
        else:
            stop = read_rate(self.pool, self.table, layout, state, motion, position, 0, out, 1, order)
        assert stop == motion.shape[1]
        assert np.all(np.isnan(out[:, 0]))
        return out[:, 1].astype(float), int(state[0])


def wandering(frames: int, seed: int) -> Real:
    """Return a motion that crosses every level, every interval, both ends of the rows and the gate."""
    random = np.random.default_rng(seed)
    t = np.arange(frames) / RATE
    motion = np.zeros((5, frames))
    fastest = 0.55 * RATE * PERIOD
    motion[0] = fastest * np.sin(2 * np.pi * 3 * t / t[-1] + 0.3)
    motion[1] = random.normal(0, 40, frames)
    motion[2] = np.maximum(0.6 - 0.7 * np.cos(2 * np.pi * 5 * t / t[-1]), 0.0)
    motion[2, ::17] = 0.7e-3 * random.uniform(0, 1.3, len(motion[2, ::17]))
    motion[3] = random.normal(0, 3, frames)
    motion[4] = random.normal(0, 900, frames)
    return motion


@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize("with_position", [False, True])
def test_moving_loops_equal_their_twin(order: int, with_position: bool) -> None:
    tables = Tables(CUBIC if order == 0 else QUINTIC)
    motion = wandering(1500, order)
    position = np.cumsum(motion[0]) / RATE if with_position else NOWHERE
    start = 0x9E3779B97F4A7C15
    found, after = tables.compiled(motion, position, order, start)
    wanted = slow_reading.moving(
        tables.slow, EDGES, motion, position, start, rate_hz=RATE, period=PERIOD, lift_load=LIFT, order=order
    )
    assert np.max(np.abs(wanted)) > 0.1
    full_scale = float(np.max(np.abs(wanted)))
    assert np.max(np.abs(found - wanted)) <= 1e-6 * full_scale
    same_scale = np.abs(wanted) < 1e-3 * full_scale
    assert np.max(np.abs(found - wanted)[same_scale]) <= 1e-8 * full_scale
    assert abs(after - slow_reading.phases(motion, position, start, RATE, PERIOD)[1]) < 1e-12 * 2**64


RATES: Any = surface_rates  # what numba compiles in, and mypy cannot see


@kernel
def rates_there(pool: Any, at: int, t: float, s: float, rates: Any) -> Any:
    return RATES(pool, np.uint64(at), t, s, rates[0], rates[1], rates[2], rates[3])


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_a_cell_anywhere_in_memory_equals_its_twin(kind: type) -> None:
    random = np.random.default_rng(5)
    for at in range(9):
        coefficients: Any = random.normal(size=(6, 4)).astype(kind)
        pool: Any = np.concatenate([np.full(at, np.nan), coefficients.ravel(), np.full(3, np.nan)]).astype(kind)
        for alone in (*np.eye(4), np.zeros(4), random.normal(size=4)):
            t, s = random.random(2)
            found = rates_there(pool, at, t, s, alone)
            first, second = (alone[0], alone[1]), (alone[2], alone[3])
            wanted = slow_reading.cell_rates(coefficients.astype(np.float64), t, s, first, second)
            assert np.allclose(found, wanted, rtol=1e-13, atol=1e-12)


@pytest.mark.parametrize("order", [0, 1, 2])
def test_a_missing_table_stops_the_loop_at_its_first_frame(order: int) -> None:
    missing = Tables(CUBIC if order == 0 else QUINTIC, missing=(1, 1))
    motion = wandering(1500, 3)
    wanted = slow_reading.moving(
        missing.slow, EDGES, motion, NOWHERE, 0, rate_hz=RATE, period=PERIOD, lift_load=LIFT, order=order
    )
    first = int(np.flatnonzero(np.isnan(wanted))[0])
    out = np.zeros((1500, 1), dtype=np.float32)
    state = np.array([0], dtype=np.uint64)
    if order == 0:
        stop = read_displacement(missing.pool, missing.table, missing.layout(), state, motion, NOWHERE, 0, out, 0)
    else:
        stop = read_rate(missing.pool, missing.table, missing.layout(), state, motion, NOWHERE, 0, out, 0, order)
    assert stop == first
    reached = slow_reading.phases(motion[:, :first], NOWHERE, 0, RATE, PERIOD)[1]
    assert abs(int(state[0]) - reached) < 1e-12 * 2**64


def test_loads_beyond_the_rows_stop_the_loop_where_rows_may_still_come() -> None:
    tables = Tables(CUBIC)
    motion = np.zeros((5, 64))
    motion[0], motion[2] = 0.05, np.linspace(0.9, 1.3, 64)
    out, state = np.zeros((64, 1), dtype=np.float32), np.array([0], dtype=np.uint64)
    stop = read_displacement(tables.pool, tables.table, tables.layout(hold=0.0), state, motion, NOWHERE, 0, out, 0)
    assert stop == int(np.flatnonzero(motion[2] > EDGES[-1])[0])
    held, _after = tables.compiled(motion, NOWHERE, 0)
    at_edge = motion.copy()
    at_edge[2] = np.minimum(motion[2], EDGES[-1])
    assert np.max(np.abs(held - tables.compiled(at_edge, NOWHERE, 0)[0])) <= 1e-7


@pytest.mark.parametrize("order", [0, 1, 2])
def test_blocks_do_not_matter(order: int) -> None:
    tables = Tables(CUBIC if order == 0 else QUINTIC)
    motion = wandering(1200, 5)
    whole, _after = tables.compiled(motion, NOWHERE, order)
    random = np.random.default_rng(6)
    cuts = [0, *np.sort(random.choice(np.arange(1, 1200), 40, replace=False)).tolist(), 1200]
    phase, parts = 0, []
    for a, b in itertools.pairwise(cuts):
        part, phase = tables.compiled(np.ascontiguousarray(motion[:, a:b]), NOWHERE, order, phase)
        parts.append(part)
    assert np.array_equal(np.concatenate(parts), whole)


def test_turns_become_phases_exactly() -> None:
    turns = np.array([0.0, 0.25, 0.5, -0.25, 7.75, 2.0**40 + 0.125])
    assert turns_to_phase(turns).tolist() == [slow_reading.to_phase(float(one)) for one in turns]
    assert turns_to_phase(np.array([0.25]))[0] == 1 << 62


def test_the_gate_has_two_continuous_derivatives_and_is_zero_at_no_load() -> None:
    assert gate(0.0, LIFT) == (0.0, 0.0, 0.0)
    assert gate(LIFT, LIFT) == pytest.approx((1.0, 0.0, 0.0), abs=1e-12)
    assert gate(5.0, LIFT) == (1.0, 0.0, 0.0)
    step = 1e-6 * LIFT
    for load in np.linspace(0.02, 0.98, 13) * LIFT:
        below, here, above = gate(load - step, LIFT), gate(load, LIFT), gate(load + step, LIFT)
        assert here[1] == pytest.approx((above[0] - below[0]) / (2 * step), rel=1e-6)
        assert here[2] == pytest.approx((above[1] - below[1]) / (2 * step), rel=1e-5, abs=1e-3 / LIFT**2)
    for end in (0.0, LIFT):
        near = gate(end + (1e-7 if end == 0.0 else -1e-7) * LIFT, LIFT)
        assert near[1] * LIFT < 1e-9
        assert abs(near[2]) * LIFT**2 < 1e-4


class KnownSurface:
    """R(theta, w) = sum over n of c_n(w) cos(2 pi n theta + a_n), c_n a cubic in w; every derivative by hand."""

    n = np.array([1.0, 2.0])
    angle = np.array([0.4, 1.3])
    cubic = np.array([[1.0, -2.0, 5.0, 3.0], [0.4, 3.0, -4.0, -2.0]])  # powers of w - low
    low, high = 0.2, 0.5

    def table(self, cells: int) -> Real:
        width = self.high - self.low
        each = []
        for power in range(4):
            line = np.zeros(3, dtype=complex)
            line[1:] = 0.5 * self.cubic[:, power] * width**power * np.exp(1j * self.angle)
            each.append(line)
        return surface(tuple(each), QUINTIC, cells)

    def terms(self, theta: Real, w: Real, motion: Real) -> tuple[Real, Real, list[Real]]:
        """Return R, dR/dt and the five terms of d2R/dt2."""
        turn = 2 * np.pi * self.n[:, None]
        wave, slope = np.cos(turn * theta + self.angle[:, None]), -turn * np.sin(turn * theta + self.angle[:, None])
        bend = -(turn**2) * wave
        c0, c1, c2 = (
            np.array([np.polynomial.Polynomial(row).deriv(k)(w - self.low) if k else np.polynomial.Polynomial(row)(
                w - self.low) for row in self.cubic])
            for k in (0, 1, 2)
        )  # fmt: skip
        p1, p2, w1, w2 = motion[0] / PERIOD, motion[1] / PERIOD, motion[3], motion[4]
        value = (c0 * wave).sum(axis=0)
        first = (c0 * slope).sum(axis=0) * p1 + (c1 * wave).sum(axis=0) * w1
        second = [
            (c0 * bend).sum(axis=0) * p1**2,
            (c0 * slope).sum(axis=0) * p2,
            2 * (c1 * slope).sum(axis=0) * p1 * w1,
            (c2 * wave).sum(axis=0) * w1**2,
            (c1 * wave).sum(axis=0) * w2,
        ]
        return value, first, second


@pytest.mark.parametrize("order", [1, 2])
def test_total_derivatives_hold_every_term(order: int) -> None:
    known = KnownSurface()
    t = np.arange(3000) / RATE
    motion = np.zeros((5, 3000))  # frequencies at which every term weighs about as much as the others
    position = 1e-3 * np.sin(40 * t)
    motion[0], motion[1] = 0.04 * np.cos(40 * t), -1.6 * np.sin(40 * t)
    motion[2] = 0.35 + 0.14 * np.sin(900 * t)
    motion[3], motion[4] = 126 * np.cos(900 * t), -113400 * np.sin(900 * t)
    block = known.table(512)
    tables = np.array([[9, 0]], dtype=np.int64)
    levels = levels_up_to(1)
    layout = np.concatenate([[RATE, PERIOD, LIFT, 1.0, 1.0], levels.fade_from, levels.fade_to, [known.low, known.high]])
    out = np.zeros((3000, 1), dtype=np.float32)
    state = np.array([0], dtype=np.uint64)
    assert read_rate(block.ravel(), tables, layout, state, motion, position, 0, out, 0, order) == 3000
    value, first, second = known.terms(position / PERIOD, motion[2], motion)
    assert np.max(np.abs(value)) > 0.5
    wanted = first if order == 1 else np.sum(second, axis=0)
    tolerance = 2e-6 * float(np.max(np.abs(wanted)))
    assert np.max(np.abs(out[:, 0] - wanted)) <= tolerance
    if order == 2:
        for term in second:  # without any one of them the assertion above fails by far
            assert np.max(np.abs(term)) > 100 * tolerance
