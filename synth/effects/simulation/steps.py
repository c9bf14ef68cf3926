"""The interface of simulated contacts: a state is started once and then run over any number of steps.

Model   A step leads from one place and load to the next; steps are `step` seconds apart. The state contains everything
        that a step needs of the step before, so the length of a run does not affect the numbers.
Limits  Phases are 64-bit fractions of a turn (`response.phases`). Their differences are correct across whole turns if a
        step is shorter than half a turn.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from synth.arrays import Array
from synth.contact.load_balance import Contact
from synth.motion.motion import NO_PATH

Phases = np.ndarray[Any, np.dtype[np.uint64]]

HEIGHT, SLOPE_FORCE, REACTION, ATTACHED, ACROSS_FORCE = range(5)
"""Rows that a run writes.

HEIGHT: z (m).
SLOPE_FORCE: horizontal force of the pressure on the slopes of the texture along x (N).
ACROSS_FORCE: the same along y, of points over an area only (N).
REACTION: sum of the pressure without attraction (N).
ATTACHED: 1 while the finger touches or is held, 0 once it has let go.
"""
ROWS = 5
TOUCH_LOAD = 1e-6  # N, far below what is felt: a smaller load does not bring back a finger that has let go


Z, SPEED, LOAD, HELD, STEP, PRESSING, EARLIER, BEFORE, NUMBERS = 0, 1, 2, 3, 4, 5, 6, 9, 11
"""Indices of the numbers of a state, and their count.

Z: z (m; for skin relative to a1 + a2).
SPEED: velocity (m/s).
LOAD: N.
HELD: 1 while the finger touches or is held.
STEP: s.
PRESSING: sum of the pressure (N), of skin only.
EARLIER: z one to three steps before, of skin only.
BEFORE: both rows of the path, of skin over an area only.
"""


@dataclass(frozen=True, slots=True)
class StiffnessLaw:
    """k = coefficient max(w, lightest)^power (N/m).

    power: -0.5 for eqs 4-5, 0.1 under a round finger.
    lightest: N.
    """

    coefficient: float
    power: float
    lightest: float

    @classmethod
    def of(cls, contact: Contact, load: float, lightest: float) -> StiffnessLaw:
        """Return the stiffness of `contact`, over its length at `load` (N)."""
        load, power = max(load, lightest), contact.stiffness_exponent
        return cls(contact.stiffness_at(load) / load**power, power, lightest)


@dataclass(slots=True)
class State:
    """The state of a finger after its last step.

    numbers: float64 [NUMBERS].
    phase: uint64 [1].
    elements: of skin, see `skin_steps`; empty otherwise.
    """

    numbers: Array
    phase: Phases
    elements: Array

    def resumed(self, step: float) -> State:
        """Return a copy that continues in steps of `step` (s)."""
        state = State(self.numbers.copy(), self.phase.copy(), self.elements.copy())
        state.numbers[STEP] = step
        return state


class Stepper(ABC):
    """Simulates one contact. Coefficients are frozen, so that one stepper serves many states.

    mass: kg.
    damping: N s/m, of a mass.
    pull: attraction of the surfaces if everything touches (N).
    """

    __slots__ = ()
    mass: float
    damping: float
    pull: float

    @property
    def memory(self) -> float:
        """Longest time constant (s) of the decay of a start, without that of a mass; 0 without memory."""
        return 0.0

    @property
    def scale(self) -> float:
        """Unit (m) of z and of the elements in a state."""
        return 1.0

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the elements of a state."""
        return (0,)

    @property
    @abstractmethod
    def step_time(self) -> float:
        """Predicted computing time of a step (s)."""

    @property
    @abstractmethod
    def at_rest(self) -> Self:
        """The same contact without mass or memory, and without its rows of forces."""

    @property
    def elastic(self) -> Self:
        """The same contact without mass, memory or adhesion."""
        return self.at_rest

    @abstractmethod
    def run(self, state: State, phases: Phases, loads: Array, out: Array, path: Array = NO_PATH) -> None:
        """Step to each of `phases` and `loads` (N) in turn, and write `out`, float64 [ROWS, steps].

        path: how far the texture has moved across (m) and the direction of the finger (rad) at each step; empty for a
            finger on its line.
        """

    def late(self, step: float) -> float:
        """Return the time between the forces of a step of `step` (s) and its end, as a part of the step."""
        return 0.0

    @property
    @abstractmethod
    def where(self) -> str:
        """On what z is simulated, in words."""

    @property
    def line(self) -> tuple[float, float] | None:
        """Both rows of a path on the line of the scan; None where every finger stays on its line."""
        return None

    def start(self, phase: int, load: float, turns: float, step: float, path: Array = NO_PATH) -> State:
        """Return the state of a finger in equilibrium at `phase` and `load` (N), with relaxed skin.

        A mass has the velocity of the equilibrium. With adhesion and a load below 0, the finger is held if an
        equilibrium exists; at a load of 0 it has let go.

        turns: texture periods per second, signed.
        step: s.
        path: as of `run`, of one step.
        """
        half = round(math.ldexp(0.5 * turns * step, 64))
        ways = np.array([(phase + move) % 2**64 for move in (-half, half, 0)], dtype=np.uint64)
        state = State(np.zeros(NUMBERS), ways[:1].copy(), np.zeros(self.shape))
        loads, rows = np.full(3, load), np.empty((ROWS, 3))
        state.numbers[[LOAD, HELD, STEP]] = load, 1.0, step
        self.elastic.run(state, ways[:1], loads[:1], rows[:, :1].copy(), path)
        state.numbers[HELD] = 1.0 if load != 0.0 or self.pull == 0.0 else 0.0
        self.at_rest.run(state, ways, loads, rows, np.repeat(path, 3, axis=1))
        if self.mass > 0.0 and state.numbers[HELD] > 0.0:
            state.numbers[SPEED] = (rows[HEIGHT, 1] - rows[HEIGHT, 0]) / step
        return state

    def apart(self, before: State, after: State, seconds: float) -> Array:
        """Return the difference (m) of each number of two states; velocities are multiplied by `seconds` / (2 pi)."""
        moved = (after.numbers - before.numbers)[[Z, SPEED]] * [self.scale, seconds / (2.0 * math.pi)]
        return np.concatenate([moved, self.scale * (after.elements - before.elements).ravel()])

    def mixed(self, states: Sequence[State], parts: Array) -> State:
        """Return the weighted sum of states at one phase and load.

        If the finger has let go in one of them, return the last state.

        states: the last is the nearest to the result.
        parts: weights, with sum 1.
        """
        state = states[-1].resumed(states[-1].numbers[STEP])
        if all(one.numbers[HELD] > 0.0 for one in states):
            state.numbers = np.tensordot(parts, [one.numbers for one in states], 1)
            state.numbers[LOAD : STEP + 1] = states[-1].numbers[LOAD : STEP + 1]
            state.elements = np.tensordot(parts, [one.elements for one in states], 1)
        return state

    def forgetting(self, longest: float) -> Self:
        """Return the same contact with time constants of at most `longest` (s)."""
        return self

    def taken_over(self, state: State) -> State | None:
        """Return a state of the same contact at other points, interpolated to those of this stepper, or None."""
        return state

    def coarser(self) -> Self | None:
        """Return the same contact at half as many phases and heights; None if it is resolved by points instead."""
        return None
