"""What a simulation of a contact offers, whatever moves it on: a state that is started once, and runs over any steps.

Model   A step leads from one place and load to the next, at equal times `step` (s) apart. What a stepper needs of the
        step before stands in its state, so that runs of any lengths give the same numbers.
Limits  phases are 64-bit fractions of a turn (`response.phases`): their differences are right across whole turns as
        long as a step is shorter than half of one.
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

Phases = np.ndarray[Any, np.dtype[np.uint64]]

HEIGHT, SLOPE_FORCE, REACTION, ATTACHED = range(4)
"""Rows of what a run writes: z (m), the horizontal force of the pressure on the slopes of the texture (N), the sum of
the pressure where it presses (N), and 1 while the finger touches or is held, 0 when it has let go."""
ROWS = 4
TOUCH_LOAD = 1e-6  # N, far below what is felt: less does not bring back a finger that has let go


Z, SPEED, LOAD, HELD, STEP, PRESSING, EARLIER, NUMBERS = 0, 1, 2, 3, 4, 5, 6, 9
"""Places in the numbers of a state, and how many they are.

z (m; of skin relative to a1 + a2), velocity (m/s), load (N), 1 while the finger touches or is held, step (s); of skin
alone the sum of the pressure (N), and z one to three steps before.
"""


@dataclass(frozen=True, slots=True)
class StiffnessLaw:
    """k = coefficient max(w, lightest)^power in N/m: power -0.5 for eqs 4-5; lightest: N."""

    coefficient: float
    power: float
    lightest: float

    @classmethod
    def of(cls, contact: Contact, load: float, lightest: float) -> StiffnessLaw:
        """Return the stiffness of `contact`; that of one `load` (N) where its shape follows the load."""
        load = max(load, lightest)
        power = 1.0 - contact.stiffness.load_exponent if contact.of_one_shape else 0.0
        return cls(contact.stiffness_at(load) / load**power, power, lightest)


@dataclass(slots=True)
class State:
    """Where a finger stands: after every run, at its last step.

    numbers: float64 [NUMBERS]. phase: uint64 [1]. elements: of skin, see `skin_steps`; empty otherwise.
    """

    numbers: Array
    phase: Phases
    elements: Array

    def resumed(self, step: float) -> State:
        """Return a copy that goes on in steps of `step` s."""
        state = State(self.numbers.copy(), self.phase.copy(), self.elements.copy())
        state.numbers[STEP] = step
        return state

    @property
    def nbytes(self) -> int:
        """Bytes that it holds."""
        return self.numbers.nbytes + self.phase.nbytes + self.elements.nbytes


class Stepper(ABC):
    """Simulates one contact; frozen coefficients, so that one stepper serves many states.

    mass: kg. pull: N, with which surfaces attract each other if all of them touch.
    """

    __slots__ = ()
    mass: float
    pull: float

    @property
    def memory(self) -> float:
        """The longest time (s) in which a start is forgotten, but for a mass's; 0 where nothing is remembered."""
        return 0.0

    @property
    def scale(self) -> float:
        """The unit (m) of z and of the elements in a state."""
        return 1.0

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of the elements of a state."""
        return (0,)

    @property
    @abstractmethod
    def nbytes(self) -> int:
        """Bytes that it holds."""

    @property
    @abstractmethod
    def step_time(self) -> float:
        """Seconds that a step is predicted to take."""

    @property
    @abstractmethod
    def at_rest(self) -> Self:
        """The same contact without mass or memory, its rows of forces left out."""

    @property
    def elastic(self) -> Self:
        """The same contact without mass, memory or adhesion."""
        return self.at_rest

    @abstractmethod
    def run(self, state: State, phases: Phases, loads: Array, out: Array) -> None:
        """Go on to each of `phases` and `loads` (N) in turn, and write ROWS rows of `out`, float64 [ROWS, steps]."""

    def start(self, phase: int, load: float, turns: float, step: float) -> State:
        """Return the state of a finger in equilibrium at `phase` and `load` (N), skin relaxed.

        With mass it has the velocity of the equilibrium at `turns` texture periods a second (signed). With adhesion
        a finger that pulls is held where it can be; at no load at all it has let go. step: s.
        """
        half = round(math.ldexp(0.5 * turns * step, 64))
        ways = np.array([(phase + move) % 2**64 for move in (-half, half, 0)], dtype=np.uint64)
        state = State(np.zeros(NUMBERS), ways[:1].copy(), np.zeros(self.shape))
        loads, rows = np.full(3, load), np.empty((ROWS, 3))
        state.numbers[[LOAD, HELD, STEP]] = load, 1.0, step
        self.elastic.run(state, ways[:1], loads[:1], rows[:, :1].copy())
        state.numbers[HELD] = 1.0 if load != 0.0 or self.pull == 0.0 else 0.0
        self.at_rest.run(state, ways, loads, rows)
        if self.mass > 0.0 and state.numbers[HELD] > 0.0:
            state.numbers[SPEED] = (rows[HEIGHT, 1] - rows[HEIGHT, 0]) / step
        return state

    def apart(self, before: State, after: State, seconds: float) -> Array:
        """Return how far (m) each number of a state lies from that of another; velocities as of `seconds` / (2 pi)."""
        moved = (after.numbers - before.numbers)[[Z, SPEED]] * [self.scale, seconds / (2.0 * math.pi)]
        return np.concatenate([moved, self.scale * (after.elements - before.elements).ravel()])

    def mixed(self, states: Sequence[State], parts: Array) -> State:
        """Return the sum of `parts`, which add up to 1, of states at one phase and load, the last the nearest to it.

        A finger that has let go stays away.
        """
        state = states[-1].resumed(states[-1].numbers[STEP])
        if all(one.numbers[HELD] > 0.0 for one in states):
            state.numbers = np.tensordot(parts, [one.numbers for one in states], 1)
            state.numbers[LOAD : STEP + 1] = states[-1].numbers[LOAD : STEP + 1]
            state.elements = np.tensordot(parts, [one.elements for one in states], 1)
        return state

    def forgetting(self, longest: float) -> Self:
        """Return the same contact, none of its time constants longer than `longest` (s)."""
        return self

    def taken_over(self, state: State) -> State:
        """Return the state of the same contact at other points, at its own."""
        return state

    def coarser(self) -> Self | None:
        """Return the same contact at half as many phases and heights; None where points say how fine it is."""
        return None
