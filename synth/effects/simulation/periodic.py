"""The periodic motion of a steady scan: the state that recurs after a texture period, and the series of that period.

Model   A motion that repeats is one period, whose rows are Fourier series over the place: a constant scan reads them as
        it reads the series of a contact without effects. So an effect changes nothing but its cause: every harmonic
        below the band passes whole, and none above it. The steps of a mass lose some amplitude, which the series make
        up for.
        The state: one texture period maps a state x to P(x). The periodic state is the fixed point of P. Each round of
        the search runs one period from a mix of the last states, sum of a_i P(x_i) with sum of a_i = 1, for which |sum
        of a_i (P(x_i) - x_i)| is least (Anderson mixing).
        A start that is forgotten within a period settles in two rounds, a mass that rings for minutes in ten. Skin
        whose time constants are hundreds of periods takes some forty. For such skin the search begins from the settled
        state of the same skin with its time constants cut to CUT periods, run in coarse steps. The position of a
        dashpot then hardly changes within a period, and its mean is close to that of any longer time constant.
        The search begins from the motion in other steps or at other points, where one is known, then from its own
        start, then from rest. A mass without a damper may have several motions that repeat: where the known one does
        not bounce, one that does is taken only if no other is found.
        A motion repeats if a second motion that begins near it stays near it for WATCHED periods. One that does not, or
        in which adhesion lets go and takes hold again, has no series and is run step by step from an earlier start.
Source  Shooting: Nayfeh & Balachandran (1995), Applied Nonlinear Dynamics, chapter 6. Mixing: Anderson (1965), J. ACM
        12, as in Walker & Ni (2011), SIAM J. Numer. Anal. 49. The cut is derived here.
Limits  A motion may not repeat with the texture: chaotic bouncing, or a repeat every second period. The period is a
        whole number of steps. The search ends after MOST_ROUNDS; `SteadyMotion.left` is what has not settled then.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.effects.simulation.steps import ATTACHED, HEIGHT, ROWS, Phases, Stepper
from synth.response.demand import Complex, harmonics_of
from synth.response.phases import turns_to_phase
from synth.sampling.decimation import lost_amplitude

FEWEST_STEPS = 8  # per period
LONGEST = 1 << 21  # most steps per period: 20 s at 96,000 per second
MOST_ROUNDS, MIXED = 40, 8  # most rounds, and most mixed states; with fewer states long time constants take far longer
ALIKE = 1e-4  # of the largest: smaller differences of moves are left out, since a mix would magnify their errors
PLAIN = 3  # rounds before mixing begins: motion that is quickly forgotten would spoil the mix
FURTHEST = 10.0  # times the peak-to-peak of z: a mix that is further away is discarded
WORSE = 10.0  # times the move of the round before: after a larger move mixing starts again
CLOSE = 1e-3  # of the tolerance: largest move of the state in a period, relative to the peak-to-peak of z
CREEPING = 0.01  # of the tolerance: the same for skin, over all periods to come
CUT, COARSE = 16.0, 240  # periods to which time constants are cut; steps per crossing of a ridge
FORGOTTEN = 6.0  # times the slowest time constant, run before the search: e^-6 of the start is left
SETTLED = 0.5  # s of a second start, for a motion that is not found from the first; and of ringing without a damper
WATCHED = 50  # periods after which it is decided whether a motion repeats
BESIDE = 1e-4  # of the peak-to-peak of z: initial distance of the second motion
STILL = 1e-15  # m: smaller moves are rounding
ASTRAY = 20.0  # times the initial distance: beyond it after WATCHED periods nothing repeats; a ringing mass reaches 10
RETURNED = 0.01  # times the initial distance: a motion that comes within it repeats and is watched no longer
ROUNDING = 1e-8  # of the peak-to-peak of z: a smaller distance that does not grow in UNGROWN periods is rounding
UNGROWN = 5  # periods; over fewer, a distance that swings, such as that of a ringing mass, may seem not to grow


@dataclass(frozen=True, slots=True)
class SteadyMotion:
    """A steady motion that repeats with the texture.

    state: at phase 0.
    steps: number of steps of a period in the search.
    harmonics: of each row of a run over the place, as in `Spectrum` [ROWS, highest + 1]; None if the finger is held for
        a part of the period only.
    left: what has not settled, relative to the peak-to-peak of z.
    missed: harmonics of z that its points or table miss, as far as they are known; they are added to `harmonics`.
    """

    state: Any
    steps: int
    harmonics: Complex | None
    left: float
    missed: Complex | float = 0.0

    @property
    def attached(self) -> bool:
        """Whether the finger touches, or is held, all the time; otherwise it never is. It has harmonics."""
        assert self.harmonics is not None
        return bool(self.harmonics[ATTACHED, 0].real > 0.5)

    def height(self) -> Complex:
        """Return the harmonics of z, where it has any."""
        assert self.harmonics is not None
        return np.asarray(self.harmonics[HEIGHT] + self.missed)


@dataclass(frozen=True, slots=True)
class Period:
    """One texture period in equal steps.

    turns: texture periods per second, signed.
    load: N.
    phases, loads: at the end of each step.
    """

    turns: float
    load: float
    phases: Phases
    loads: Array

    @classmethod
    def of(cls, turns: float, load: float, steps: int) -> Period:
        """Return the period in `steps` steps, from phase 0 back to phase 0."""
        phases = turns_to_phase(math.copysign(1.0, turns) * np.arange(1, steps + 1) / steps)
        return cls(turns, load, phases, np.full(steps, load))

    @property
    def seconds(self) -> float:
        """Length of the period (s)."""
        return 1.0 / abs(self.turns)

    @property
    def step(self) -> float:
        """Length of a step (s)."""
        return self.seconds / len(self.phases)

    def on(self, stepper: Stepper, state: Any, count: int) -> Any:
        """Return the state `count` periods after `state`."""
        state, rows = state.resumed(self.step), np.empty((ROWS, len(self.phases)))
        for _ in range(count):
            stepper.run(state, self.phases, self.loads, rows)
        return state

    def recorded(self, stepper: Stepper, state: Any) -> tuple[Array, Any]:
        """Run a period from `state`. Return its rows [ROWS, steps], and the state at its end."""
        state, rows = state.resumed(self.step), np.zeros((ROWS, len(self.phases)))
        stepper.run(state, self.phases, self.loads, rows)
        return rows, state


def steady_of(
    stepper: Stepper,
    period: Period,
    crossings: float,
    tolerance: float,
    near: SteadyMotion | None,
    highest: int,
    *,
    of_mass: bool,
) -> SteadyMotion | None:
    """Return the steady motion of a scan; None if it does not repeat with the texture.

    crossings: ridges passed per period.
    tolerance: of z, relative to its peak-to-peak.
    near: the motion of the same contact at other points or in other steps, if known.
    highest, of_mass: as of `_harmonics`.
    """
    bounces, found = near is None or near.harmonics is None, None
    for begin in _begins(stepper, period, crossings, near):
        recurs = _returning(stepper, begin, period, tolerance)
        if recurs is None:
            continue
        state, rows, left = recurs
        harmonics = _harmonics(stepper, period, rows, highest, of_mass=of_mass)
        found = SteadyMotion(state, len(period.phases), harmonics, left)
        if bounces or harmonics is not None:  # otherwise it is another of several motions than `near`
            break
    return found


def _begins(stepper: Stepper, period: Period, crossings: float, near: SteadyMotion | None) -> Iterator[Any]:
    """Yield the states from which the search begins, one after the other."""
    if near is not None and (taken := stepper.taken_over(near.state)) is not None:
        yield taken
    yield _begun(stepper, period, crossings)
    rested = stepper.start(0, period.load, period.turns, period.step)
    yield period.on(stepper, rested, math.ceil(SETTLED / period.seconds))


def _harmonics(stepper: Stepper, period: Period, rows: Array, highest: int, *, of_mass: bool) -> Complex | None:
    """Return the harmonics of the `rows` of a period, see `SteadyMotion`.

    highest: number of harmonics that are kept.
    of_mass: make up for the amplitude that the steps of a mass lose (`decimation.lost_amplitude`).
    """
    if np.ptp(rows[ATTACHED]) > 0.0:
        return None
    number = np.arange(highest + 1)
    # row i belongs to the phase (i + 1) / steps in the direction of the motion, or a part of a step before it
    before = np.where(np.arange(ROWS) == HEIGHT, 1.0, 1.0 - stepper.late(period.step))
    turns = np.exp(-2j * math.pi * before[:, np.newaxis] * number / len(period.phases))
    found = np.array([harmonics_of(row, highest) for row in rows]) * turns
    if of_mass:
        found[:, 1:] *= 1.0 / lost_amplitude(math.pi * np.minimum(number[1:] / len(period.phases), 0.4))
    return found if period.turns > 0.0 else np.conj(found)


def _begun(stepper: Stepper, period: Period, crossings: float) -> Any:
    """Return the state from which the search begins. For skin with a long memory, see Model."""
    short = stepper.forgetting(CUT * period.seconds)
    if short.memory >= stepper.memory:
        return stepper.start(0, period.load, period.turns, period.step)
    coarse = Period.of(period.turns, period.load, min(len(period.phases), COARSE * max(1, round(crossings))))
    begin = short.start(0, period.load, period.turns, coarse.step)
    return coarse.on(short, begin, math.ceil(FORGOTTEN * short.memory / period.seconds))


def _returning(stepper: Stepper, state: Any, period: Period, tolerance: float) -> tuple[Any, Array, float] | None:
    """Search from `state` for the motion that recurs after a period. Return None if there is none.

    Otherwise return its state at phase 0, its rows, and what has not settled (`SteadyMotion.left`).
    """
    lasting, enough = stepper.memory, CLOSE * tolerance
    if lasting > 0.0:
        enough = CREEPING * tolerance * -math.expm1(-period.seconds / lasting)
    if stepper.mass > 0.0:
        lasting = max(lasting, 2.0 * stepper.mass / stepper.damping if stepper.damping > 0.0 else SETTLED)
    ends: list[Any] = []
    moves: list[Array] = []
    for number in range(MOST_ROUNDS):
        begin = state
        rows, end = period.recorded(stepper, begin)
        extent = float(np.ptp(rows[HEIGHT]))
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
    moves_to_come = 1.0 / -math.expm1(-period.seconds / lasting) if lasting > 0.0 else 1.0
    return begin, rows, moves_to_come * size / extent if extent > 0.0 else 0.0


def _goes_astray(stepper: Stepper, other: Any, state: Any, period: Period, extent: float) -> bool:
    """Return whether a motion that begins near `state`, in the direction of `other`, moves far away from it."""
    way = float(np.max(np.abs(stepper.apart(state, other, period.seconds))))
    if way <= STILL:
        return False
    part = min(1.0, BESIDE * extent / way)
    beside = stepper.mixed([other, state], np.array([part, 1.0 - part]))
    seen = [part * way]
    for _ in range(WATCHED):
        state, beside = (period.on(stepper, begin, 1) for begin in (state, beside))
        seen.append(float(np.max(np.abs(stepper.apart(state, beside, period.seconds)))))
        ungrown = len(seen) > UNGROWN and max(seen[-UNGROWN:]) <= seen[-UNGROWN - 1]
        if seen[-1] <= RETURNED * seen[0] or (ungrown and seen[-1] <= ROUNDING * extent):
            return False
    return seen[-1] > ASTRAY * (seen[0] + STILL)


def _least(moves: list[Array]) -> Array:
    """Return the weights, with sum 1, for which the weighted sum of `moves` is least."""
    if len(moves) == 1:
        return np.ones(1)
    apart = np.stack([moves[-1] - move for move in moves[:-1]], axis=1)
    others = np.linalg.lstsq(apart, moves[-1], rcond=ALIKE)[0]
    return np.append(others, 1.0 - float(np.sum(others)))
