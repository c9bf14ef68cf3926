"""The dragged skin: against an exact solver and a slow twin, its order, its energy, its onset, and any parameters."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from synth.effects.stick_slip import SURFACES, StickSlipSettings
from synth.motion.skin_drag import BEND, BRISTLE, LAG, LOAD, MASS, SPEED, SPRING, TICKS, TOLERANCE, at_rest, drag
from synth.motion.stick_slip_onset import (
    Dragged,
    dragged,
    fall_of_friction,
    most_damping,
    sticks_and_slips,
    unstable,
)
from tests.few import few, thorough
from tests.reference.stick_slip_oracle import Finger, exact, stepped

Floats = npt.NDArray[np.float64]
SMALLEST = 1e-300
CASES = [
    (Finger(), 0.5, 0.01, 48000),
    (Finger(damping=0.3), 0.5, 0.02, 8000),
    (Finger(mass=1e-4, damping=0.3, bristle=1e5, bristle_damping=0.5), 0.5, 0.01, 48000),
    (Finger(mass=5e-3, spring=500.0, bristle=2e3), 1.0, 0.01, 8000),
]
"""A finger, its load (N), its speed (m/s), and frames per second."""
GREW, SHORT, STAYED = 115, 155, 3
"""Of 200 random fingers: unstable ones; those whom the short form of the onset judges right; stable ones that stick and
slip for ever where they start stuck. docs/effects.md states them."""
TOLD, PLACE = 1e-4, 5e-4
"""Relative error of frequency and amplitude, and of the place, that docs/effects.md states."""


def parameters(finger: Finger, rise: float = 1.0, wetting: float = 0.0, drying: float = 0.0) -> Floats:
    return np.array(
        [*vars(finger).values(), rise, wetting, drying]  # in the order of the solver
    )


def run(p: Floats, rate: float, speed: Any, load: Any, sizes: Any = None, state: Floats | None = None) -> Floats:
    """Return lag, slip and force at each frame, for a hand with these speeds and loads at the frames."""
    speed, load = (np.array(one, dtype=float) for one in np.broadcast_arrays(speed, load))
    travel = 0.5 * (speed + np.concatenate([speed[:1], speed[:-1]])) / rate
    state, found, first = at_rest() if state is None else state, [], 0
    for size in [len(speed)] if sizes is None else sizes:
        part, out = slice(first, first + size), np.zeros((3, size))
        drag(p, rate, state, travel[part].copy(), speed[part].copy(), load[part].copy(), np.ones(size), out)
        found.append(out)
        first += size
    return np.concatenate(found, axis=1)


@pytest.mark.parametrize(("finger", "load", "speed", "rate"), [*CASES[:2], *(thorough(*one) for one in CASES[2:])])
def test_frequency_and_amplitude_are_those_of_an_exact_solver(
    finger: Finger, load: float, speed: float, rate: int
) -> None:
    period = 1.0 / dragged(parameters(finger), load, speed, rate).frequency
    seconds = 2.0 * finger.static * load / (finger.spring * speed) + 2.2 * period
    found, slips = exact(finger, lambda _t: speed, lambda _t: load, seconds, 3.0 * speed)
    frames = np.arange(math.floor(seconds * rate))
    force = np.array([finger.friction(load, v, f)[1] for _d, v, f in found.sol(frames / rate).T])
    lag, _slip, drawn = run(parameters(finger), rate, np.full(len(frames), speed), load)
    places = np.array([1.0, 0.0, 1.0 / finger.bristle]) @ found.sol(frames / rate)
    assert np.max(np.abs(lag - places)) < PLACE * np.ptp(places)
    cycle = slice(round(slips[-2] * rate), round(slips[-1] * rate))
    assert np.ptp(drawn[cycle]) == pytest.approx(np.ptp(force[cycle]), rel=TOLD)
    assert 1.0 / period == pytest.approx(1.0 / np.diff(slips)[-1], rel=TOLD)


@pytest.mark.parametrize(("finger", "load", "speed", "rate"), CASES[1:3])
def test_the_steps_are_those_of_the_slow_twin(finger: Finger, load: float, speed: float, rate: int) -> None:
    speeds = speed * (1.0 + 0.5 * np.sin(np.arange(80) / 5.0))
    speeds[40:] *= -1.0  # within a frame
    lag, slip, force = run(parameters(finger), rate, speeds * 10.0, load)
    states, _made = stepped(finger, speeds * 10.0, load, rate, TOLERANCE, TICKS)
    drawn = [finger.friction(load, v, f) for _d, v, f in states]
    assert lag == pytest.approx(states[:, 0] + states[:, 2] / finger.bristle, rel=1e-6, abs=1e-9)
    assert slip == pytest.approx(
        [one[1] - both[0] for one, both in zip(states, drawn, strict=True)], rel=1e-5, abs=1e-7
    )
    assert force == pytest.approx([both[1] for both in drawn], rel=1e-5, abs=1e-6)


def test_no_step_makes_energy_beyond_the_work_of_the_hand() -> None:
    for finger, load, speed, rate in CASES:
        speeds = 10.0 * speed * np.sin(np.arange(60) / 7.0)
        states, made = stepped(finger, speeds, load, rate, TOLERANCE, TICKS)
        assert np.max(made) < 1e-9 * max(map(finger.energy, states))
        assert np.sum(made) < -0.01 * max(map(finger.energy, states))  # friction takes some


def test_the_error_falls_with_the_third_power_of_the_step() -> None:
    finger, load, seconds = Finger(stribeck=0.5, bristle=2e3, damping=2.0), 0.5, 0.04

    def hand(t: Any) -> Any:
        return 0.2 + 0.02 * np.sin(2.0 * np.pi * 25.0 * t) ** 2

    begun = np.array([finger.sliding(load, 0.2) / finger.spring, 0.2, finger.sliding(load, 0.2)])
    ends = []
    for steps in (32, 64, 128, 256, 2048):
        rate = steps / seconds
        t = np.arange(steps + 1) / rate
        state = at_rest()
        state[[LAG, SPEED, BEND]], state[4:] = begun, [TICKS, 1.0, 0.2, load]
        travel = np.concatenate([[0.0], _travelled(t)])
        out = np.zeros((3, steps + 1))
        drag(
            parameters(finger),
            rate,
            state,
            travel[1:],
            hand(t[1:]),
            np.full(steps, load),
            np.ones(steps),
            out[:, 1:].copy(),
        )
        ends.append(state[[LAG, SPEED, BEND]] / begun)
    errors = [float(np.max(np.abs(end - ends[-1]))) for end in ends[:-1]]
    orders = [math.log2(one / two) for one, two in itertools.pairwise(errors)]
    assert all(2.6 < order < 3.6 for order in orders), (errors, orders)


def _travelled(t: Floats) -> Floats:
    """Return the way of the hand of the test above from each of `t` to the next."""
    turn = 2.0 * np.pi * 50.0
    return np.diff(0.2 * t + 0.02 * (0.5 * t - np.sin(turn * t) / (2.0 * turn)))


def random_finger(rng: np.random.Generator) -> Floats:
    def between(low: float, high: float) -> float:
        return float(10.0 ** rng.uniform(math.log10(low), math.log10(high)))

    kinetic = between(0.01, 3.0)
    mass, damping, spring, bristle = between(1e-6, 1.0), between(1e-3, 1e3), between(1.0, 1e6), between(10.0, 1e8)
    dampings = rng.choice([0.0, damping]), rng.choice([0.0, between(1e-4, 1e3)])
    static, stribeck, rise = kinetic * between(1.0, 10.0), between(1e-5, 1.0), between(1.0, 20.0)
    wetting, drying = between(0.01, 10.0), between(0.01, 10.0)
    return np.array([mass, dampings[0], spring, bristle, dampings[1], static, kinetic, stribeck, rise, wetting, drying])


@pytest.mark.parametrize("seed", few(range(200), 30))
def test_any_finger_speed_load_reversal_and_lift_is_finite_and_calms_down(seed: int) -> None:
    rng = np.random.default_rng(seed)
    p, rate, frames = random_finger(rng), float(rng.choice([1e3, 8e3, 48e3, 192e3])), 1200
    t = np.arange(frames) / rate
    speed = 10.0 ** rng.uniform(-6, 1) * np.sin(2.0 * np.pi * 10.0 ** rng.uniform(0, 2.6) * t)
    if seed % 3 == 0:
        speed = np.max(speed) * np.where(rng.random(frames) < 0.01, -1.0, 1.0).cumprod()
    load = 10.0 ** rng.uniform(-4, 3) * np.sin(2.0 * np.pi * 10.0 ** rng.uniform(-0.3, 2.5) * t + rng.uniform(0, 6))
    load = np.maximum(load + rng.choice([0.0, 0.5]), 0.0)
    speed[frames // 2 :] = 0.0
    state = at_rest()
    whole = run(p, rate, speed, load, state=state)
    assert np.all(np.isfinite(whole)) and np.all(np.isfinite(state))
    assert not np.any(whole[2, load == 0.0])
    assert np.max(np.abs(whole[2])) <= 2.0 * p[5] * p[8] * np.max(load) * (1.0 + 1e-9)  # bristle and its damper
    again, energies, begun = at_rest(), [], 0
    for end in range(frames // 2, frames, 50):
        travel = np.concatenate([[0.0], 0.5 * (speed[1:] + speed[:-1]) / rate])[begun:end]
        drag(
            p,
            rate,
            again,
            travel.copy(),
            speed[begun:end].copy(),
            load[begun:end].copy(),
            np.ones(end - begun),
            np.zeros((3, end - begun)),
        )
        kinetic, elastic = p[MASS] * again[SPEED] ** 2, p[SPRING] * again[LAG] ** 2 + again[BEND] ** 2 / p[BRISTLE]
        energies.append(0.5 * (kinetic + elastic))
        begun = end
    assert np.all(np.diff(energies[1:]) <= 1e-9 * max(energies) + SMALLEST)


@pytest.mark.parametrize("seed", range(4))
def test_block_splits_do_not_matter(seed: int) -> None:
    rng = np.random.default_rng(seed)
    p, t = random_finger(rng), np.arange(700) / 8e3
    speed, load = 0.05 * np.sin(60.0 * t), np.maximum(0.0, 0.5 * np.sin(90.0 * t))
    whole = run(p, 8e3, speed, load)
    assert np.array_equal(run(p, 8e3, speed, load, sizes=rng.multinomial(700, np.ones(11) / 11)), whole)


def slider(seed: int) -> tuple[Finger, float, float]:
    """Return a finger, a load and a speed whose sliding is neither nearly stable nor nearly unstable."""
    rng = np.random.default_rng(seed)
    while True:
        kinetic, stribeck, load = rng.uniform(0.1, 1.0), 10.0 ** rng.uniform(-2.7, -1.0), 10.0 ** rng.uniform(-1.3, 0.5)
        mass, spring = 10.0 ** rng.uniform(-4.0, -2.3), 10.0 ** rng.uniform(2.3, 3.5)
        bristle = spring * 10.0 ** rng.uniform(0.5, 3.0)
        speed = stribeck * 10.0 ** rng.uniform(-1.3, 0.4)
        rubbed, static = math.sqrt(bristle * mass) * rng.uniform(0.0, 1.0), kinetic * rng.uniform(1.05, 3.0)
        whole = Finger(mass, 0.0, spring, bristle, rubbed, static, kinetic, stribeck)
        damping = fall_of_friction(parameters(whole), load, speed) * 10.0 ** rng.uniform(-0.7, 0.3)
        whole = replace(whole, damping=damping)
        modes = whole.modes(load, speed)
        if abs(np.max(modes.real)) > 0.02 * np.max(np.abs(modes)):
            return whole, load, speed


def test_the_onset_is_that_of_the_modes_and_of_simulations_in_200_fingers() -> None:
    grew = short = 0
    for seed in range(200):
        finger, load, speed = slider(seed)
        p, modes = parameters(finger), finger.modes(load, speed)
        growth = float(np.max(modes.real))
        assert unstable(p, load, speed) == (growth > 0.0)
        rate = 4.0 * float(np.max(np.abs(modes)))
        frames = min(math.ceil(12.0 / abs(growth) * rate), 6000)
        state, most = at_rest(), finger.sliding(load, speed)
        begun = 1e-6 * speed
        state[:] = [most / finger.spring, speed + begun, most, 0.0, TICKS, 1.0, speed, load]
        run(p, rate, np.full(frames, speed), load, state=state)
        away = math.hypot(state[SPEED] - speed, (state[LAG] - most / finger.spring) * abs(modes[0]))
        assert (away > begun) == (growth > 0.0), (seed, away / begun, growth)
        grew += growth > 0.0
        short += (finger.damping < fall_of_friction(p, load, speed)) == (growth > 0.0)
    assert (grew, short) == (GREW, SHORT)


@pytest.mark.parametrize("surface", SURFACES)
def test_the_onset_is_that_of_the_modes_on_every_surface(surface: str) -> None:
    """From a crawl to fast sliding, at light and heavy loads: also where a middle coefficient falls below 0."""
    p = StickSlipSettings(surface=surface).parameters
    names = vars(Finger()).keys()
    finger = Finger(**dict(zip(names, p[: len(names)].tolist(), strict=True)))
    grew = set()
    for load in (0.05, 0.5, 3.0):
        for speed in np.geomspace(1e-4, 0.3, 120).tolist():
            growth = float(np.max(finger.modes(load, speed).real))
            assert unstable(p, load, speed) == (growth > 0.0), (load, speed, growth)
            grew.add(growth > 0.0)
            if growth > 0.0 and load == 0.5:
                assert sticks_and_slips(p, load, speed, 8000.0)
    assert grew == {True, False}


@pytest.mark.thorough
def test_some_fingers_that_could_slide_stick_and_slip_on_if_they_start_stuck() -> None:
    found = 0
    for seed in range(200):
        finger, load, speed = slider(seed)
        p = parameters(finger)
        found += not unstable(p, load, speed) and dragged(p, load, speed, 48000.0).frequency > 0.0
    assert found == STAYED


def test_on_a_stiff_bristle_the_onset_is_where_friction_falls_faster_than_the_damping() -> None:
    rng = np.random.default_rng(5)
    for _ in range(200):
        finger = Finger(bristle=1e9, bristle_damping=0.0, stribeck=10.0 ** rng.uniform(-2.5, -1.0))
        load, speed = 10.0 ** rng.uniform(-1.0, 0.5), finger.stribeck * 10.0 ** rng.uniform(-1.0, 0.4)
        ratio = speed / finger.stribeck
        falls = load * 0.4 * 2.0 * ratio / finger.stribeck * math.exp(-(ratio**2))
        for part in (0.98, 1.02):
            p = parameters(Finger(damping=part * falls, bristle=1e9, bristle_damping=0.0, stribeck=finger.stribeck))
            assert unstable(p, load, speed) == (part < 1.0)
        p = parameters(
            Finger(damping=1.0001 * math.sqrt(2.0 / math.e) * load * 0.4 / finger.stribeck, stribeck=finger.stribeck)
        )
        assert not any(unstable(p, load, v) for v in np.geomspace(1e-4, 10.0, 50) * finger.stribeck)
        assert most_damping(p, load) == pytest.approx(0.8578 * load * 0.4 / finger.stribeck, rel=1e-4)


def test_a_stuck_finger_does_not_creep_and_a_sliding_one_does_not_vibrate() -> None:
    finger, t = Finger(), np.arange(24000) / 48000.0
    speed = 1e-3 * np.sin(2.0 * np.pi * 20.0 * t)
    lag, slip, _force = run(parameters(finger), 48000, speed, 0.5)
    travel = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]))]) / 48000
    assert not np.any(slip)
    assert np.ptp(travel - lag) < 1e-12  # the place on the surface
    _lag, slip, force = run(parameters(finger), 48000, np.full(48000, 0.08), 0.5)
    assert np.ptp(slip[24000:]) < 1e-12 and force[-1] == pytest.approx(0.25, rel=1e-12)
    assert dragged(parameters(finger), 0.5, 0.08, 48000.0).frequency == 0.0


def test_stick_slip_is_the_textbook_saw_at_low_speed() -> None:
    """A slow hand loads the spring up to static friction; without damping a slip unloads it by twice the difference."""
    finger = Finger(damping=1e-6, bristle=1e7, bristle_damping=200.0, stribeck=1e-3)
    found: Dragged = dragged(parameters(finger), 0.5, 2e-3, 48000.0)
    lag, _slip, _force = run(parameters(finger), 48000, np.full(96000, 2e-3), 0.5)
    assert np.ptp(lag[48000:]) == pytest.approx(2.0 * 0.5 * (0.9 - 0.5) / finger.spring, rel=0.15)
    slip = math.pi * math.sqrt(finger.mass / finger.spring)
    assert found.frequency == pytest.approx(1.0 / (0.8 * 0.5 / (finger.spring * 2e-3) + slip), rel=0.1)
    assert found.slip_share == pytest.approx(slip * found.frequency, rel=0.25)


def test_moisture_raises_friction_while_the_finger_touches_and_falls_off_the_surface() -> None:
    p, rate = parameters(Finger(), rise=4.0, wetting=0.2, drying=0.5), 1000.0
    load = np.where(np.arange(30000) < 15000, 0.5, 0.0)
    load[25000:] = 0.5
    _lag, _slip, force = run(p, rate, np.full(30000, 0.2), load)
    for second in (2, 6, 14):
        wet = 1.0 - math.exp(-0.2 * second)
        assert force[1000 * second] == pytest.approx(0.25 * (1.0 + 3.0 * wet), rel=1e-3)
    left = (1.0 - math.exp(-3.0)) * math.exp(-5.0)
    assert force[27000] == pytest.approx(0.25 * (1.0 + 3.0 * (1.0 - (1.0 - left) * math.exp(-0.4))), rel=1e-3)


def test_no_load_is_no_force_and_leaves_the_skin_under_the_hand() -> None:
    state = at_rest()
    lag, slip, force = run(parameters(Finger()), 8000, np.linspace(-1.0, 1.0, 900), 0.0, state=state)
    assert not np.any(lag) and not np.any(force)
    assert np.array_equal(slip, np.linspace(-1.0, 1.0, 900)) and state[LOAD] == 0.0
