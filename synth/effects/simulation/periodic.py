"""The periodic state of a steady scan, in which its simulation begins: a stepper's state that one period leads back to.

Model   One texture period is a map of the state onto itself; its fixed point is the periodic state. A mass on a table
        has two numbers, z and its velocity: Newton's method, from the linear response to the elastic motion, with the
        Jacobian from differences. Its eigenvalues tell whether the motion returns when it is disturbed. Skin has many
        numbers: see `skin_settling`.
Source  shooting: Nayfeh & Balachandran (1995), Applied Nonlinear Dynamics, chapter 6.
Limits  a motion that does not repeat with the texture (bouncing in chaos, or every second period) begins after SETTLED
        seconds from rest, and `repeats` is False. The period is a whole number of steps here, so steps are up to half a
        step a period longer or shorter than those of a run.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.effects.simulation.steps import HEIGHT, ROWS, Phases, Stepper
from synth.effects.simulation.table_steps import SPEED, TableState, TableStepper, Z
from synth.response.phases import turns_to_phase

Lines = np.ndarray[Any, np.dtype[np.complex128]]

PLACES = 16  # phases of a period at which the state is kept: a voice steps on from the nearest one behind it
FEWEST_STEPS = 8  # of a period
LONGEST = 1 << 21  # steps of a period at most: 20 s of 96,000 a second
SETTLED = 0.5  # s that a motion which does not repeat is run before it begins
WATCHED = 13  # periods after which such a motion is compared with its beginning, at least; SETTLED after all
UNLIKE = 3.0  # times the largest difference from those: others may be further away
MOST_ROUNDS = 12  # of Newton's method
HALVINGS = 4  # of one of its moves at most, until the residual falls
CLOSE = 1e-9  # of the peak-to-peak of z: a smaller residual is a periodic state
NUDGE = 1e-5  # of the peak-to-peak of z: for differences; the motion bends little within
RETURNING = 1.001  # largest eigenvalue of a motion that returns; above, a disturbance grows. 1 is a mass without damper
RESONANT = 30.0  # the linear response makes no line larger than this


@dataclass(frozen=True, slots=True)
class Steady:
    """The states of one steady motion, at some phases of a period.

    places: phase (64-bit fraction of a turn) and state. turns: texture periods a second, signed. load: N.
    """

    places: tuple[tuple[int, Any], ...]
    turns: float
    load: float

    @property
    def nbytes(self) -> int:
        """Bytes that the states hold."""
        return sum(state.nbytes for _phase, state in self.places)

    def at(self, stepper: Stepper, phase: int, step: float) -> Any:
        """Return the state at `phase`, ready to go on in steps of `step` s."""
        sign = 1 if self.turns > 0.0 else -1
        ahead, state, begin = min(
            ((sign * (phase - place) % 2**64, state, place) for place, state in self.places), key=lambda one: one[0]
        )
        seconds = math.ldexp(float(ahead), -64) / abs(self.turns)
        count = math.ceil(seconds / step - 1e-6)
        if count:
            state = stepper.resumed(state, seconds / count)
            moves = [begin + sign * (ahead * (i + 1) // count) for i in range(count)]
            phases = np.array([one % 2**64 for one in moves], dtype=np.uint64)
            stepper.run(state, phases, np.full(count, self.load), np.empty((ROWS, count)))
        return stepper.resumed(state, step)


@dataclass(frozen=True, slots=True)
class Found:
    """A steady motion, and how well it is known.

    others: the same motion as it stands later, or corrected once more; what lies between them and `steady`, times
    `factor`, is what has not settled. repeats: the motion repeats with the texture.
    """

    steady: Steady
    others: tuple[Steady, ...] = ()
    factor: float = 1.0
    repeats: bool = True


@dataclass(frozen=True, slots=True)
class Period:
    """One texture period in equal steps. turns: signed, a second; step: s."""

    turns: float
    load: float
    phases: Phases
    loads: Array

    @classmethod
    def of(cls, turns: float, load: float, steps: int) -> Period:
        """Return the period in `steps` steps, from phase 0 to phase 0."""
        phases = turns_to_phase(math.copysign(1.0, turns) * np.arange(1, steps + 1) / steps)
        return cls(turns, load, phases, np.full(steps, load))

    @property
    def seconds(self) -> float:
        """Its length (s)."""
        return 1.0 / abs(self.turns)

    @property
    def step(self) -> float:
        """Length of a step (s)."""
        return self.seconds / len(self.phases)

    def run(self, stepper: Stepper, state: Any) -> Array:
        """Take `state` through the period; return z (m) at its steps."""
        rows = np.empty((ROWS, len(self.phases)))
        stepper.run(state, self.phases, self.loads, rows)
        return np.asarray(rows[HEIGHT])

    def recorded(self, stepper: Stepper, state: Any) -> Steady:
        """Take `state` through the period and return the states on its way."""
        places, count = [], len(self.phases)
        ends = [count * (i + 1) // min(PLACES, count) for i in range(min(PLACES, count))]
        for begin, end in zip([0, *ends[:-1]], ends, strict=True):
            places.append((int(self.phases[begin - 1]), stepper.resumed(state, self.step)))
            stepper.run(state, self.phases[begin:end], self.loads[begin:end], np.empty((ROWS, end - begin)))
        return Steady(tuple(places), self.turns, self.load)


def steps_of_period(turns: float, rate: int) -> int:
    """Return how many steps a period has at `rate` steps a second."""
    return max(FEWEST_STEPS, round(rate / abs(turns)))


def linear_start(heights: Array, turns: float, hard: Lines, mass: float, damping: float) -> Array:
    """Return z (m) and velocity (m/s) with which a mass begins the linear motion that `heights` drive.

    heights: z (m) without the mass, over a period. turns: periods a second. hard: complex stiffness (N/m) at each
    harmonic. mass: kg. damping: N s/m.
    """
    lines = np.fft.rfft(heights) / len(heights)
    pulses = 2.0 * math.pi * abs(turns) * np.arange(len(lines))
    lines[1:] *= 2.0
    resisting = 1.0 + (1j * damping * pulses - mass * pulses**2) / hard
    lines /= resisting * np.maximum(1.0, 1.0 / (RESONANT * np.abs(resisting)))
    return np.array([np.sum(lines).real, np.sum(1j * pulses * lines).real])


def steady_of_table(stepper: TableStepper, turns: float, load: float, rate: int, stiffness: float) -> Found:
    """Return the steady motion of a mass or of adhesion. stiffness: dF/dz (N/m) round the load."""
    period = Period.of(turns, load, steps_of_period(turns, rate))
    lean = replace(stepper, with_static=False, with_forces=False)
    shot = _Shot(lean, period, math.sqrt(stiffness / stepper.mass) if stepper.mass > 0.0 else 1.0)
    starts = [shot.place(shot.settled(2))]
    if stepper.mass > 0.0:
        starts.insert(0, shot.linear(stiffness))
    for begin in starts:
        found, largest = shot.repeated(begin)
        if found is not None and largest <= RETURNING:
            return Found(period.recorded(lean, found))
    state = shot.settled(max(2, math.ceil(SETTLED / period.seconds)))
    found, largest = shot.repeated(shot.place(state))
    if found is not None and largest <= RETURNING:
        return Found(period.recorded(lean, found))
    return watched(lean, period, state)


def watched(stepper: Stepper, period: Period, state: Any) -> Found:
    """Return a motion that does not repeat with the texture, from `state` on, and what it comes to later."""
    state = stepper.resumed(state, period.step)
    steady, others = period.recorded(stepper, state), []
    last = max(WATCHED, math.ceil(SETTLED / period.seconds))
    numbers = {round(last ** (part / 8.0)) + 1 for part in range(9)}
    for number in range(2, last + 2):
        period.run(stepper, state)
        if number in numbers:
            others.append(Steady(((0, stepper.resumed(state, period.step)),), period.turns, period.load))
    return Found(steady, tuple(others), UNLIKE, repeats=False)


@dataclass(slots=True)
class _Shot:
    """Newton's method on the map of one period; a place is z (m) and velocity / `pulse` (m). pulse: rad/s."""

    stepper: TableStepper
    period: Period
    pulse: float
    begin: TableState | None = None

    def start(self) -> TableState:
        """Return the state of a finger that follows the elastic contact, or that ran from there."""
        if self.begin is None:
            self.begin = self.stepper.start(0, self.period.load, self.period.turns, self.period.step)
        return self.begin.copied()

    def place(self, state: TableState) -> Array:
        """Return the numbers of a state that Newton's method moves."""
        return np.array([state.numbers[Z], state.numbers[SPEED] / self.pulse])

    def state(self, place: Array) -> TableState:
        """Return the state of `place`."""
        state = self.start()
        state.numbers[Z], state.numbers[SPEED] = place[0], place[1] * self.pulse
        return state

    def after(self, place: Array) -> tuple[Array, Array]:
        """Return the place after a period, and z (m) on the way."""
        state = self.state(place)
        heights = self.period.run(self.stepper, state)
        return self.place(state), heights

    def settled(self, periods: int) -> TableState:
        """Return the state after some periods from rest; what holds the finger, or does not, is known then."""
        self.begin = None
        state = self.start()
        for _ in range(periods):
            self.period.run(self.stepper, state)
        self.begin = state.copied()
        return state

    def linear(self, stiffness: float) -> Array:
        """Return where the linear motion round the load begins, driven by that of a finger without mass."""
        still = replace(self.stepper, mass=0.0, damping=0.0)
        state = still.start(0, self.period.load, self.period.turns, self.period.step)
        heights = np.roll(self.period.run(still, state), 1)
        hard = np.full(len(heights) // 2 + 1, stiffness, dtype=complex)
        place = linear_start(heights, self.period.turns, hard, self.stepper.mass, self.stepper.damping)
        return place / [1.0, self.pulse]

    def repeated(self, place: Array) -> tuple[TableState | None, float]:
        """Return the state that a period leads back to, near `place`, and its largest eigenvalue; None: not found."""
        after, heights = self.after(place)
        for _ in range(MOST_ROUNDS):
            rest, extent = after - place, float(np.ptp(heights))
            jacobian = self.jacobian(place, after, max(NUDGE * extent, 1e-6 * NUDGE * abs(place[0])))
            if np.max(np.abs(rest)) <= CLOSE * extent + 1e-14 * abs(place[0]):
                return self.state(after), float(np.max(np.abs(np.linalg.eigvals(jacobian))))
            try:
                move = np.linalg.solve(np.eye(2) - jacobian, rest)
            except np.linalg.LinAlgError:
                return None, math.inf
            for halved in range(HALVINGS + 1):
                trial = place + 0.5**halved * move
                led, heights = self.after(trial)
                if np.linalg.norm(led - trial) < np.linalg.norm(rest):
                    break
            place, after = trial, led
        return None, math.inf

    def jacobian(self, place: Array, after: Array, nudge: float) -> Array:
        """Return by how much the place after a period moves with the place before."""
        if self.stepper.mass == 0.0:
            return np.zeros((2, 2))
        return np.stack([(self.after(place + nudge * one)[0] - after) / nudge for one in np.eye(2)], axis=1)
