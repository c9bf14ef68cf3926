"""The periodic state of viscous skin: every place remembers, some for seconds, and all that they remember must repeat.

Model   What an element remembers is the place m of each dashpot, m' = (e - m) / tau (Kelvin and Voigt: of a free
        element, its indentation). With tau far beyond a period m hardly moves within one, so its mean is nearly that of
        any other long time constant. So skin whose time constants end at CUT periods is settled first, in coarse steps.
        Then, with its own, one period moves m by r, and, did e stay as it is, m would end r / (1 - exp(-T / tau)) away.
        Each round moves m by a part of that; the part follows from the round before (Aitken's relaxation), since e does
        not stay as it is where the skin is free. A mass may ring on for longer than a round: before each, Newton's
        method brings z and its velocity to where a period leads them back to.
Source  relaxation: Kuettler & Wall (2008), Comput. Mech. 43. The rest is derived here.
Limits  `Found.others` holds the state that one more whole correction makes, `factor` what further ones would add, by
        how fast they fell. Rounds end at MOST_ROUNDS: with time constants of thousands of periods something is left,
        and told.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from synth.arrays import Array
from synth.effects.simulation.periodic import (
    RETURNING,
    SETTLED,
    Found,
    Lines,
    Period,
    Steady,
    linear_start,
    steps_of_period,
    watched,
)
from synth.effects.simulation.skin import KelvinVoigt, Relaxation, SkinLaw
from synth.effects.simulation.skin_balance import VELOCITY, Z
from synth.effects.simulation.skin_steps import SkinState, SkinStepper
from synth.effects.simulation.terms import Skin

CUT = 8.0  # periods: a time constant is no longer than this at first; longer takes more periods to settle
FORGOTTEN = 6.0  # of the slowest time constants that are run at first: e^-6 of a start is left
COARSE, MIDDLE = 240, 960  # steps of a ridge's crossing, to settle first and for the rounds
MOST_ROUNDS = 20
FINE = 0.02  # of the tolerance: what a round may still correct of an indentation, relative to the peak-to-peak of z
LEAST, MOST = 0.2, 1.0  # of a correction that is made
FIRST = 0.7  # of the first one
MOST_MOVES = 8  # of Newton's method between two rounds
NUDGE = 1e-4  # of the peak-to-peak of z: for the differences of Newton's method
WORN = 0.3  # of a residual: a period that leaves more asks for a move, a move that leaves more for new differences
PARTS = (1.0, 0.3, 0.1)  # of a move: the first that makes the residual smaller
LATER = 0.05  # s after which the motion is compared with its beginning, whole periods
ASTRAY = 0.02  # of the peak-to-peak: where a period still moves z by more, the motion does not repeat with the texture
MOST_FALLING = 0.9  # of a correction is left by a round, at most: the sum of those to come is ten times the last then


def steady_of_skin(
    stepper: SkinStepper,
    turns: float,
    load: float,
    rate: int,
    stiffness: float,
    crossings: float,
    tolerance: float,
    near: Steady | None = None,
) -> Found:
    """Return the steady motion of viscous skin.

    stiffness: dF/dz (N/m) of the relaxed contact. crossings: ridges that a texture period passes. tolerance: of z,
    relative to its peak-to-peak. near: the motion of the same skin at other points, or in other steps.
    """
    lean = replace(stepper, with_static=False, with_force=False)
    steps, ridges = steps_of_period(turns, rate), max(1, round(crossings))
    own = Period.of(turns, load, steps)
    coarse, middle = (Period.of(turns, load, min(steps, count * ridges)) for count in (COARSE, MIDDLE))
    state = _cut_and_settled(lean, coarse, stiffness) if near is None else _at_points(near, stepper.points.count)
    state, falling = _corrected(lean, state, middle, FINE * tolerance)
    before = _balanced(lean, _on(lean, state, own, 1), own, FINE * tolerance)
    led = lean.resumed(before, own.step)
    steady = own.recorded(lean, led)
    if _astray(lean, led, own):
        return watched(lean, own, _on(lean, led, own, math.ceil(SETTLED / own.seconds)))
    later = _on(lean, led, own, math.ceil(LATER / own.seconds))
    _correct(lean.law, led, _correction(lean, before, led, own), 1.0)
    corrected = _balanced(lean, _on(lean, led, own, 1), own, FINE * tolerance)
    others = tuple(Steady(((0, state),), turns, load) for state in (corrected, later))
    return Found(steady, others, 1.0 / (1.0 - falling))


def _at_points(steady: Steady, count: int) -> SkinState:
    """Return the state at phase 0, its elements at `count` points of the same length."""
    state: SkinState = steady.places[0][1].copied()
    places, known = np.linspace(0.0, 1.0, count), np.linspace(0.0, 1.0, state.elements.shape[-1])
    state.elements = np.apply_along_axis(lambda row: np.interp(places, known, row), -1, state.elements)
    return state


def _astray(stepper: SkinStepper, led: SkinState, period: Period) -> bool:
    """Return whether a period moves a mass by more than rounding and creep do, or a disturbance of it grows."""
    if stepper.mass == 0.0:
        return False
    on, rest, extent = _led(stepper, led, period)
    growth = np.linalg.eigvals(_jacobian(stepper, led, on, period, extent))
    return abs(rest[0]) > ASTRAY * extent or float(np.max(np.abs(growth))) > RETURNING


def _on(stepper: SkinStepper, state: SkinState, period: Period, count: int) -> SkinState:
    """Return the state some periods later."""
    state = stepper.resumed(state, period.step)
    for _ in range(count):
        period.run(stepper, state)
    return state


def _cut_and_settled(stepper: SkinStepper, period: Period, stiffness: float) -> SkinState:
    """Return the state of skin whose time constants end at CUT periods, settled."""
    law, longest = stepper.law, CUT * period.seconds
    if isinstance(law, Relaxation):
        law = replace(law, times=tuple(min(time, longest) for time in law.times))
        slowest = Skin(law.times, law.weights).slowest
    else:
        assert isinstance(law, KelvinVoigt)
        law = replace(law, time=min(law.time, longest))
        slowest = law.time
    short = replace(stepper, law=law)
    begin = short.start(0, period.load, period.turns, period.step)
    if stepper.mass > 0.0:
        still = replace(short, mass=0.0, damping=0.0)
        begin = _on(still, begin, period, 1)
        heights = np.roll(period.run(still, begin), 1)
        pulses = np.arange(len(heights) // 2 + 1, dtype=float) * (2.0 * math.pi * abs(period.turns))
        hard = stiffness * hardness(law, pulses)
        place = linear_start(heights, period.turns, hard, stepper.mass, stepper.damping)
        begin = _moved(begin, *(place / [stepper.points.height_scale, 1.0] - _place(begin)))
    return _on(short, begin, period, max(2, math.ceil(FORGOTTEN * slowest / period.seconds)))


def hardness(law: SkinLaw, pulses: Array) -> Lines:
    """Return the complex stiffness of skin that is held, relative to its relaxed one, at `pulses` (rad/s)."""
    if isinstance(law, Relaxation):
        turned = 1j * np.multiply.outer(pulses, np.array(law.times))
        return np.asarray(1.0 + turned / (1.0 + turned) @ np.array(law.weights) / law.relaxed_part)
    assert isinstance(law, KelvinVoigt)
    return np.asarray(1.0 + 1j * pulses * law.time)


def _corrected(stepper: SkinStepper, state: SkinState, period: Period, enough: float) -> tuple[SkinState, float]:
    """Return the state after rounds of corrections, and what a round leaves of a correction."""
    scale = stepper.points.height_scale
    part, last, falling, size = FIRST, None, 0.0, math.inf
    for number in range(MOST_ROUNDS):
        before = _balanced(stepper, _on(stepper, state, period, 1), period, enough)
        state = stepper.resumed(before, period.step)
        extent = float(np.ptp(period.run(stepper, state)))
        correction = _correction(stepper, before, state, period)
        largest = scale * float(np.max(np.abs(correction)))
        if number:
            falling = min(largest / size, MOST_FALLING) if size > 0.0 else 0.0
        size = largest
        if size <= enough * extent:
            break
        if last is not None:
            apart = correction - last
            part = min(max(-part * float(np.sum(last * apart)) / float(np.sum(apart * apart)), LEAST), MOST)
        _correct(stepper.law, state, correction, part)
        last = correction
    return state, falling


def _balanced(stepper: SkinStepper, state: SkinState, period: Period, enough: float) -> SkinState:
    """Return the state with z and its velocity where a period leads them back to; as it is without a mass."""
    if stepper.mass == 0.0:
        return state
    pulse = _pulse(stepper, period)
    led, rest, extent = _led(stepper, state, period)
    size, jacobian = _size(rest, pulse), None
    for _ in range(MOST_MOVES):
        if size <= enough * extent:
            break
        before, state = size, led  # a period rings down by itself, or else Newton's method goes on from there
        led, rest, extent = _led(stepper, state, period)
        size = _size(rest, pulse)
        if size <= WORN * before:
            continue
        jacobian = _jacobian(stepper, state, led, period, extent) if jacobian is None else jacobian
        move = np.linalg.lstsq(np.eye(2) - jacobian, rest)[0]
        for part in PARTS:
            trial = _moved(led, *(part * move - rest))
            led_on, rest_on, extent_on = _led(stepper, trial, period)
            if _size(rest_on, pulse) < size:
                jacobian = None if _size(rest_on, pulse) > WORN * size else jacobian
                state, led, rest, extent, size = trial, led_on, rest_on, extent_on, _size(rest_on, pulse)
                break
    return state


def _led(stepper: SkinStepper, state: SkinState, period: Period) -> tuple[SkinState, Array, float]:
    """Return the state a period later, by how much z and its velocity moved, and the peak-to-peak of z."""
    led = stepper.resumed(state, period.step)
    extent = float(np.ptp(period.run(stepper, led))) / stepper.points.height_scale
    return led, _place(led) - _place(state), extent


def _pulse(stepper: SkinStepper, period: Period) -> float:
    """Return the velocity (m/s) of a line of a1 + a2 at the fundamental."""
    return 2.0 * math.pi / period.seconds * stepper.points.height_scale


def _jacobian(stepper: SkinStepper, state: SkinState, led: SkinState, period: Period, extent: float) -> Array:
    """Return by how much z and its velocity a period later, `led`, move with those of `state`."""
    nudges = NUDGE * extent * np.diag([1.0, _pulse(stepper, period)])
    moved = [_place(_led(stepper, _moved(state, *one), period)[0]) - _place(led) for one in nudges]
    return np.stack(moved, axis=1) / np.diag(nudges)


def _size(rest: Array, pulse: float) -> float:
    return float(max(abs(rest[0]), abs(rest[1]) / pulse))


def _place(state: SkinState) -> Array:
    """Return z (of a1 + a2) and its velocity (m/s)."""
    return state.numbers[[Z, VELOCITY]]


def _moved(state: SkinState, height: float, velocity: float) -> SkinState:
    """Return the state with the finger higher and faster by that much; dashpots stay where they are."""
    state = state.copied()
    state.numbers[Z : Z + 4] += height
    state.numbers[VELOCITY] += velocity
    state.elements[0] -= height
    return state


def _correction(stepper: SkinStepper, before: SkinState, after: SkinState, period: Period) -> Array:
    """Return by how much each dashpot of each point is still to move, relative to a1 + a2: float64 [memories, points].

    Both states are a period apart. A point has the state of skin that is held where the surface presses it in further
    than it would be free.
    """
    old, new, law = before.elements, after.elements, stepper.law
    pressed = new[0, 0] > new[1, 0]
    if isinstance(law, Relaxation):
        moved = np.where(pressed, *((new[i, :1] - new[i, 1:]) - (old[i, :1] - old[i, 1:]) for i in range(2)))
        return np.asarray(moved / -np.expm1(-period.seconds / np.array(law.times))[:, np.newaxis])
    assert isinstance(law, KelvinVoigt)
    moved = np.where(pressed, 0.0, new[1, 0] - old[1, 0])
    return np.asarray(moved / -math.expm1(-period.seconds / law.time))[np.newaxis]


def _correct(law: SkinLaw, state: SkinState, correction: Array, part: float) -> None:
    """Move the dashpots of `state`: where skin is free it moves with them, where it is held it stays."""
    held, free = state.elements
    if isinstance(law, Relaxation):
        moved = np.array(law.weights) @ correction
        free[0] += part * moved
        free[1:] += part * (moved - correction)
        held[1:] -= part * correction
    else:
        free[0] += part * correction[0]
