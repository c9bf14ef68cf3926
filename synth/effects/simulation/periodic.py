"""The periodic state of a steady scan, in which its simulation begins: a stepper's state that one period leads back to.

Model   One texture period is a map of the state onto itself; its fixed point is the periodic state. z and its velocity:
        a period rings down by itself, or else Newton's method moves them, with a Jacobian from differences. What skin
        remembers is the place m of each dashpot, m' = (e - m) / tau (with one time constant, of a free element, its
        indentation). With tau far beyond a period m hardly moves within one, so its mean is nearly that of any other
        long time constant: skin whose time constants end at CUT periods is settled first, in coarse steps. Then, with
        its own, one period moves m by r, and, did e stay as it is, m would end r / (1 - exp(-T / tau)) away. Each round
        moves m by a part of that; the part follows from the round before (Aitken's relaxation), since e does not stay
        as it is where the skin is free. Before each, z and its velocity are brought to where a period leads them back.
        The eigenvalues of the last Jacobian tell whether the motion returns when it is disturbed.
Source  shooting: Nayfeh & Balachandran (1995), Applied Nonlinear Dynamics, chapter 6; relaxation: Kuettler & Wall
        (2008), Comput. Mech. 43. The rest is derived here.
Limits  a motion that does not repeat with the texture (bouncing in chaos, or every second period) begins after SETTLED
        seconds from rest, and `repeats` is False. The period is a whole number of steps here, so steps are up to half a
        step a period longer or shorter than those of a run. Rounds end at MOST_ROUNDS: with time constants of thousands
        of periods something is left, and told: `Found.others` holds the state that one more whole correction makes,
        `factor` what further ones would add, by how fast they fell.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.effects.simulation.steps import HEIGHT, ROWS, Phases, Stepper
from synth.response.phases import turns_to_phase

PLACES = 16  # phases of a period at which the state is kept: a voice steps on from the nearest one behind it
FEWEST_STEPS = 8  # of a period
LONGEST = 1 << 21  # steps of a period at most: 20 s of 96,000 a second
SETTLED = 0.5  # s that a motion which does not repeat is run before it begins
WATCHED = 13  # periods after which such a motion is compared with its beginning, at least; SETTLED after all
UNLIKE = 3.0  # times the largest difference from those: others may be further away
CUT = 8.0  # periods: a time constant is no longer than this at first; longer takes more periods to settle
FORGOTTEN = 6.0  # of the slowest time constants that are run at first: e^-6 of a start is left
COARSE, MIDDLE = 240, 960  # steps of a ridge's crossing, to settle first and for the rounds
MOST_ROUNDS = 20
FINE, CLOSE = 0.02, 1e-3  # of the tolerance: what a round may correct, and a period move z, relative to its extent
LEAST, MOST = 0.2, 1.0  # of a correction that is made
FIRST = 0.7  # of the first one
BESIDE = 0.05  # of the last correction: what z and its velocity may be off by while there are others to come
MOST_MOVES = 8  # of Newton's method between two rounds
STILL = (
    1e-12  # m: nudges are of this motion at least; where all cancels there is none, and a finger is nudged all the same
)
NUDGE = 1e-4  # of the peak-to-peak of z: for the differences of Newton's method
WORN = 0.3  # of a residual: a period that leaves more asks for a move, a move that leaves more for new differences
PARTS = (1.0, 0.3, 0.1)  # of a move: the first that makes the residual smaller
LATER = 0.05  # s after which the motion is compared with its beginning, whole periods
ASTRAY = 0.02  # of the peak-to-peak: where a period still moves z by more, the motion does not repeat with the texture
RETURNING = 1.001  # largest eigenvalue of a motion that returns; above, a disturbance grows. 1 is a mass without damper
MOST_FALLING = 0.9  # of a correction is left by a round, at most: the sum of those to come is ten times the last then


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


def steady_of(
    stepper: Stepper, turns: float, load: float, rate: int, crossings: float, tolerance: float, near: Steady | None
) -> Found:
    """Return the steady motion of a scan at `turns` periods a second (signed) and `load` (N), `rate` steps a second.

    crossings: ridges that a texture period passes. tolerance: of z, relative to its peak-to-peak. near: the motion of
    the same contact at other points, or in other steps.
    """
    own = Period.of(turns, load, max(FEWEST_STEPS, round(rate / abs(turns))))
    ridges, steps = max(1, round(crossings)), len(own.phases)
    coarse, middle = (Period.of(turns, load, min(steps, count * ridges)) for count in (COARSE, MIDDLE))
    begin = _settled(stepper, coarse) if near is None else stepper.taken_over(near.places[0][1])
    found = _found(stepper, begin, middle, own, tolerance)
    if not found.repeats and stepper.mass > 0.0:
        later = _on(stepper, stepper.start(0, load, turns, own.step), own, math.ceil(SETTLED / own.seconds))
        again = _found(stepper, later, own, own, tolerance)
        return again if again.repeats else _watched(stepper, own, later)
    return found


def _found(stepper: Stepper, state: Any, middle: Period, own: Period, tolerance: float) -> Found:
    """Return the motion that a search from `state` ends at."""
    state, falling = _corrected(stepper, state, middle, tolerance)
    enough = (FINE if stepper.memory > 0.0 else CLOSE) * tolerance  # what creeps comes no closer
    before = _balanced(stepper, _on(stepper, state, own, 1), own, enough)
    led = stepper.resumed(before, own.step)
    steady = own.recorded(stepper, led)
    later = _on(stepper, led, own, math.ceil(LATER / own.seconds))
    corrected = stepper.corrected(led, stepper.correction(before, led, own.seconds))
    corrected = _balanced(stepper, _on(stepper, corrected, own, 1), own, enough)
    others = tuple(Steady(((0, other),), own.turns, own.load) for other in (corrected, later))
    return Found(steady, others, 1.0 / (1.0 - falling), repeats=not _astray(stepper, led, own))


def _watched(stepper: Stepper, period: Period, state: Any) -> Found:
    """Return a motion that does not repeat with the texture, from `state` on, and what it comes to later."""
    steady, others = period.recorded(stepper, state), []
    last = max(WATCHED, math.ceil(SETTLED / period.seconds))
    numbers = {round(last ** (part / 8.0)) + 1 for part in range(9)}
    for number in range(2, last + 2):
        period.run(stepper, state)
        if number in numbers:
            others.append(Steady(((0, stepper.resumed(state, period.step)),), period.turns, period.load))
    return Found(steady, tuple(others), UNLIKE, repeats=False)


def _astray(stepper: Stepper, led: Any, period: Period) -> bool:
    """Return whether a period moves z by more than rounding and creep do, or a disturbance of it grows."""
    on, rest, extent = _led(stepper, led, period)
    growth = np.linalg.eigvals(_jacobian(stepper, led, on, period, extent)) if stepper.mass > 0.0 else np.zeros(1)
    return abs(rest[0]) > ASTRAY * extent or float(np.max(np.abs(growth))) > RETURNING


def _on(stepper: Stepper, state: Any, period: Period, count: int) -> Any:
    """Return the state some periods later."""
    state = stepper.resumed(state, period.step)
    for _ in range(count):
        period.run(stepper, state)
    return state


def _settled(stepper: Stepper, period: Period) -> Any:
    """Return the state of a finger whose memory ends at CUT periods, settled."""
    short = stepper.forgetting(CUT * period.seconds)
    begin = short.start(0, period.load, period.turns, period.step)
    return _on(short, begin, period, max(2, math.ceil(FORGOTTEN * short.memory / period.seconds)))


def _corrected(stepper: Stepper, state: Any, period: Period, tolerance: float) -> tuple[Any, float]:
    """Return the state after rounds of corrections, and what a round leaves of a correction."""
    part, last, falling, size, enough = FIRST, None, 0.0, math.inf, 1.0
    for number in range(MOST_ROUNDS):
        before = _balanced(stepper, _on(stepper, state, period, 1), period, max(BESIDE * enough, FINE * tolerance))
        state = stepper.resumed(before, period.step)
        extent = float(np.ptp(period.run(stepper, state)))
        correction = stepper.correction(before, state, period.seconds)
        largest = float(np.max(np.abs(correction), initial=0.0))
        if number:
            falling = min(largest / size, MOST_FALLING) if size > 0.0 else 0.0
        size, enough = largest, min(largest / extent, 1.0) if extent > 0.0 else 0.0
        if size <= FINE * tolerance * extent:
            break
        if last is not None:
            apart = correction - last
            part = min(max(-part * float(np.sum(last * apart)) / float(np.sum(apart * apart)), LEAST), MOST)
        state = stepper.corrected(state, part * correction)
        last = correction
    return state, falling


def _balanced(stepper: Stepper, state: Any, period: Period, enough: float) -> Any:
    """Return the state with z and its velocity where a period leads them back to; as it is without a mass."""
    if stepper.mass == 0.0:
        return state
    led, rest, extent = _led(stepper, state, period)
    size, jacobian = _size(rest, period), None
    for _ in range(MOST_MOVES):
        if size <= enough * extent:
            break
        before, state = size, led  # a period rings down by itself, or else Newton's method goes on from there
        led, rest, extent = _led(stepper, state, period)
        size = _size(rest, period)
        if size <= WORN * before:
            continue
        jacobian = _jacobian(stepper, state, led, period, extent) if jacobian is None else jacobian
        move = np.linalg.lstsq(np.eye(2) - jacobian, rest)[0]
        for part in PARTS:
            trial = stepper.moved(led, part * move - rest)
            led_on, rest_on, extent_on = _led(stepper, trial, period)
            if _size(rest_on, period) < size:
                jacobian = None if _size(rest_on, period) > WORN * size else jacobian
                state, led, rest, extent, size = trial, led_on, rest_on, extent_on, _size(rest_on, period)
                break
    return state


def _led(stepper: Stepper, state: Any, period: Period) -> tuple[Any, Array, float]:
    """Return the state a period later, by how much z and its velocity moved, and the peak-to-peak of z."""
    led = stepper.resumed(state, period.step)
    extent = float(np.ptp(period.run(stepper, led)))
    return led, stepper.place(led) - stepper.place(state), extent


def _jacobian(stepper: Stepper, state: Any, led: Any, period: Period, extent: float) -> Array:
    """Return by how much z and its velocity a period later, `led`, move with those of `state`."""
    nudges = NUDGE * max(extent, STILL) * np.diag([1.0, 2.0 * math.pi / period.seconds])
    moved = [stepper.place(_led(stepper, stepper.moved(state, one), period)[0]) - stepper.place(led) for one in nudges]
    return np.stack(moved, axis=1) / np.diag(nudges)


def _size(rest: Array, period: Period) -> float:
    """Return how far (m) z and its velocity moved; velocity as that of a line at the fundamental."""
    return float(max(abs(rest[0]), abs(rest[1]) * period.seconds / (2.0 * math.pi)))
