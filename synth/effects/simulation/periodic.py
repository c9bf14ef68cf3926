"""The periodic state of a steady scan, in which its simulation begins: a stepper's state that one period leads back to.

Model   One texture period is a map P of the state x onto itself; its fixed point is the periodic state. Each round runs
        one period from the mix sum of a_i P(x_i), sum of a_i = 1, of the last states that makes |sum of a_i (P(x_i) -
        x_i)| least (Anderson's mixing). What a period forgets is settled in two rounds, a mass that rings for minutes
        in ten; skin whose time constants are hundreds of periods takes some forty. Such skin begins from the same skin
        with its time constants cut to CUT periods, settled in coarse steps: m, the place of a dashpot, hardly moves
        within a period then, and its mean is nearly that of any longer time constant.
        A motion returns if one that stands beside it comes no further away in WATCHED periods.
Source  shooting: Nayfeh & Balachandran (1995), Applied Nonlinear Dynamics, chapter 6; mixing: Anderson (1965), J. ACM
        12, as in Walker & Ni (2011), SIAM J. Numer. Anal. 49. The cut is derived here.
Limits  a motion that does not repeat with the texture (bouncing in chaos, or every second period) begins after SETTLED
        seconds from rest, and `repeats` is False. The period is a whole number of steps here, so steps are up to half a
        step a period longer or shorter than those of a run. Rounds end at MOST_ROUNDS: `PeriodicState.later` tells what
        is left then.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.effects.simulation.steps import HEIGHT, ROWS, Phases, Stepper
from synth.response.phases import turns_to_phase

PLACES = 16  # phases of a period at which the state is kept: a voice steps on from the nearest one behind it
FEWEST_STEPS = 8  # of a period
LONGEST = 1 << 21  # steps of a period at most: 20 s of 96,000 a second
MOST_ROUNDS, MIXED = 40, 8  # rounds at most, and states that are mixed: with fewer long time constants take far longer
ALIKE = 1e-4  # of the largest: smaller differences of moves are left out, since a mix would magnify what they hide
PLAIN = 3  # rounds before states are mixed: what is quickly forgotten would spoil the mix
FURTHEST = 10.0  # times the peak-to-peak of z: a mix that lies further away is none
WORSE = 10.0  # times what a period moved the state in the round before: where it moves it by more, mixing begins anew
CLOSE = 1e-3  # of the tolerance: what a period may move the state, relative to the peak-to-peak of z
CREEPING = 0.1  # of the tolerance: the same, of skin, over all periods to come
CUT, COARSE = 16.0, 240  # periods; steps of a ridge's crossing
FORGOTTEN = 6.0  # of the slowest time constants that are run at first: e^-6 of a start is left
SETTLED = 0.5  # s that a motion which does not repeat is run before it begins
WATCHED = 50  # periods in which a motion returns, or does not
BESIDE = 1e-4  # of the peak-to-peak of z: how far beside it one is that is watched
STILL = 1e-15  # m: a smaller move is rounding
ASTRAY = 20.0  # times as far away after these periods: it does not return; a mass that rings swings up to ten
RETURNED = 0.01  # times as far away: it returns, and is watched no longer
DIFFERENT = 8  # periods of such a motion that are compared
UNLIKE = 3.0  # times the largest difference of periods that do not repeat: others may be further away
LATER = 0.05  # s after which the motion is compared with its beginning, whole periods


@dataclass(frozen=True, slots=True)
class PeriodicState:
    """The states of one steady motion, at some phases of a period.

    places: phase (64-bit fraction of a turn) and state. turns: texture periods a second, signed. load: N. repeats: the
    motion repeats with the texture.
    """

    places: tuple[tuple[int, Any], ...]
    turns: float
    load: float
    repeats: bool = True

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
            state = state.resumed(seconds / count)
            moves = [begin + sign * (ahead * (i + 1) // count) for i in range(count)]
            phases = np.array([one % 2**64 for one in moves], dtype=np.uint64)
            stepper.run(state, phases, np.full(count, self.load), np.empty((ROWS, count)))
        return state.resumed(step)

    def later(self, stepper: Stepper, steps: int) -> tuple[list[PeriodicState], float]:
        """Return the same motion as it stands later, in so many steps a period, and a factor.

        What lies between them and this one, times the factor, is what has not settled.
        """
        period, gone, found = Period.of(self.turns, self.load, steps), 0, []
        counts = [math.ceil(LATER / period.seconds)]
        if not self.repeats:
            most = max(WATCHED, math.ceil(SETTLED / period.seconds))
            counts = np.geomspace(1, most, DIFFERENT).astype(int).tolist()
        state = self.places[0][1]
        for count in counts:
            state, gone = period.on(stepper, state, count - gone), count
            found.append(replace(self, places=((0, state),)))
        if not self.repeats:
            return found, UNLIKE
        forgets = -math.expm1(-counts[0] * period.seconds / stepper.memory) if stepper.memory > 0.0 else 1.0
        return found, 1.0 / forgets


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

    def on(self, stepper: Stepper, state: Any, count: int) -> Any:
        """Return the state `count` periods later."""
        state, rows = state.resumed(self.step), np.empty((ROWS, len(self.phases)))
        for _ in range(count):
            stepper.run(state, self.phases, self.loads, rows)
        return state

    def recorded(self, stepper: Stepper, state: Any) -> tuple[PeriodicState, Any, float]:
        """Return the states of the period that begins with `state`, the state at its end, and the peak-to-peak of z."""
        places, count = [], len(self.phases)
        state, rows = state.resumed(self.step), np.empty((ROWS, count))
        ends, extremes = np.linspace(0, count, min(PLACES, count) + 1).astype(int).tolist(), []
        for begin, end in pairwise(ends):
            places.append((int(self.phases[begin - 1]), state.resumed(self.step)))
            part = rows[:, : end - begin].copy()
            stepper.run(state, self.phases[begin:end], self.loads[begin:end], part)
            extremes += [part[HEIGHT].min(), part[HEIGHT].max()]
        return PeriodicState(tuple(places), self.turns, self.load), state, float(np.ptp(extremes))


def steady_of(
    stepper: Stepper,
    turns: float,
    load: float,
    steps: int,
    crossings: float,
    tolerance: float,
    near: PeriodicState | None,
) -> PeriodicState:
    """Return the steady motion of a scan at `turns` periods a second (signed) and `load` (N).

    steps: a period. crossings: ridges that it passes. tolerance: of z, relative to its peak-to-peak. near: the motion
    of the same contact at other points, or in other steps.
    """
    period = Period.of(turns, load, steps)
    begin = _begun(stepper, period, crossings) if near is None else stepper.taken_over(near.places[0][1])
    steady = _returning(stepper, begin, period, tolerance)
    if steady is None:
        rested = stepper.start(0, load, turns, period.step)
        begin = period.on(stepper, rested, math.ceil(SETTLED / period.seconds))
        steady = _returning(stepper, begin, period, tolerance)
    if steady is None:
        steady = replace(period.recorded(stepper, begin)[0], repeats=False)
    return steady


def _begun(stepper: Stepper, period: Period, crossings: float) -> Any:
    """Return the state from which the search begins: of skin whose memory is long, with a shorter one, settled."""
    short = stepper.forgetting(CUT * period.seconds)
    if short.memory >= stepper.memory:
        return stepper.start(0, period.load, period.turns, period.step)
    coarse = Period.of(period.turns, period.load, min(len(period.phases), COARSE * max(1, round(crossings))))
    begin = short.start(0, period.load, period.turns, coarse.step)
    return coarse.on(short, begin, math.ceil(FORGOTTEN * short.memory / period.seconds))


def _returning(stepper: Stepper, state: Any, period: Period, tolerance: float) -> PeriodicState | None:
    """Return the motion that a period leads back to, searched for from `state` on; None where none returns."""
    enough = CLOSE * tolerance
    if stepper.memory > 0.0:
        enough = CREEPING * tolerance * -math.expm1(-period.seconds / stepper.memory)
    ends: list[Any] = []
    moves: list[Array] = []
    for number in range(MOST_ROUNDS):
        steady, end, extent = period.recorded(stepper, state)
        move = stepper.apart(state, end, period.seconds)
        size = float(np.max(np.abs(move)))
        settled = size <= enough * extent + STILL
        if settled:
            break
        if number < PLAIN or size > WORSE * float(np.max(np.abs(moves[-1]))):
            ends, moves = [], []
        ends, moves = [*ends[1 - MIXED :], end], [*moves[1 - MIXED :], move]
        state = stepper.mixed(ends, _least(moves))
        if float(np.max(np.abs(stepper.apart(end, state, period.seconds)))) > FURTHEST * extent:
            state = end
    if stepper.mass > 0.0 and (not settled or _goes_astray(stepper, state, end, period, extent)):
        return None
    return steady


def _goes_astray(stepper: Stepper, other: Any, state: Any, period: Period, extent: float) -> bool:
    """Return whether a motion that begins beside that of `state`, on the side of `other`, comes far away from it."""
    way = float(np.max(np.abs(stepper.apart(state, other, period.seconds))))
    if way <= STILL:
        return False
    part = min(1.0, BESIDE * extent / way)
    beside = stepper.mixed([other, state], np.array([part, 1.0 - part]))
    far = part * way
    for _ in range(WATCHED):
        state, beside = (period.on(stepper, begin, 1) for begin in (state, beside))
        far = float(np.max(np.abs(stepper.apart(state, beside, period.seconds))))
        if far <= RETURNED * part * way:
            return False
    return far > ASTRAY * (part * way + STILL)


def _least(moves: list[Array]) -> Array:
    """Return the parts, of sum 1, of `moves` whose sum is least."""
    if len(moves) == 1:
        return np.ones(1)
    apart = np.stack([moves[-1] - move for move in moves[:-1]], axis=1)
    others = np.linalg.lstsq(apart, moves[-1], rcond=ALIKE)[0]
    return np.append(others, 1.0 - float(np.sum(others)))
