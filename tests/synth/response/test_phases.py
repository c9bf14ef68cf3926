"""Phases of a motion against their twin in integers, and the gate."""

from __future__ import annotations

import numpy as np
import pytest

from synth.effects.simulation.running import placed as phases_of
from synth.response.lift_gate import gate
from synth.response.phases import turned_by, turns_to_phase
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


def test_phases_turn_evenly_forwards_and_backwards() -> None:
    assert turned_by(7, 2**63, np.arange(-2, 3)).tolist() == [7, 7 + 2**63, 7, 7 + 2**63, 7]
    assert turned_by(0, 2**64 - 1, np.arange(-1, 2)).tolist() == [1, 0, 2**64 - 1]


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
