"""Phases of a motion against their twin in integers, and the gate."""

from __future__ import annotations

import numpy as np
import pytest

from synth.effects.simulation.running import placed as phases_of
from synth.response.lift_gate import gate
from synth.response.phases import turns_to_phase
from tests.reference import slow_reading

LIFT = 1e-3  # N
HALF = 1 << 63  # of a turn


@pytest.mark.parametrize("with_position", [False, True])
def test_phases_are_those_of_the_twin(with_position: bool) -> None:
    random = np.random.default_rng(3)
    motion = np.zeros((5, 400))
    motion[0], motion[1] = random.normal(size=400), random.normal(size=400)
    position = np.cumsum(random.normal(size=400)) * 1e-3 if with_position else np.empty(0)
    phases, after = phases_of(motion, position, np.uint64(12345), 44100.0, 0.8e-3)
    wanted, wanted_after = slow_reading.phases(motion, position, 12345, 44100.0, 0.8e-3)
    apart = [(one - other + HALF) % (2 * HALF) - HALF for one, other in zip(phases.tolist(), wanted, strict=True)]
    assert max(map(abs, apart)) <= 1e-12 * HALF
    assert abs((int(after) - wanted_after + HALF) % (2 * HALF) - HALF) <= 1e-12 * HALF


def test_turns_become_phases_exactly() -> None:
    turns = np.array([0.0, 0.25, 0.5, -0.25, 7.75, 2.0**40 + 0.125])
    assert turns_to_phase(turns).tolist() == [slow_reading.to_phase(float(one)) for one in turns]
    assert turns_to_phase(np.array([0.25]))[0] == 1 << 62


def test_the_gate_has_two_continuous_derivatives_and_is_zero_at_no_load() -> None:
    """Its slope is at most 15 / 8 and bends by at most 5.8: so do the differences over steps of a thousandth."""
    step = 1e-3
    values = np.array([gate(float(part) * LIFT, LIFT) for part in np.arange(-0.5, 1.5, step)])
    slopes = np.diff(values) / step
    assert gate(0.0, LIFT) == 0.0 and gate(LIFT, LIFT) == gate(5.0, LIFT) == 1.0
    assert np.all(slopes >= 0.0) and np.max(slopes) == pytest.approx(1.875, rel=1e-4)
    assert np.max(np.abs(np.diff(slopes))) <= 6.0 * step
    assert np.max(np.abs(np.diff(slopes, 2))) <= 61.0 * step**2
