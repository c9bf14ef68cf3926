"""The spring of the pulp in the steps: SciPy on the same equation, energy, rest, slow scans, adhesion, no ringing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from synth.effects.inertia import EFFECT
from synth.effects.simulation.pulp import Pulp, attracted_mean
from synth.effects.simulation.steps import ATTACHED, HEIGHT, REACTION, ROWS, SPEED, Z
from synth.effects.simulation.steps import LOAD as LOAD_NOW
from synth.effects.simulation.table_steps import TableStepper
from synth.response.mean_approach import heights_of_mean, mean_of
from synth.response.phases import turns_to_phase
from tests.few import thorough
from tests.synth.effects.simulation.table_cases import (
    LOAD,
    PHASE,
    energy,
    read,
    released,
    run,
    scanned,
    stepper,
    stiffness_at,
    table_of,
)
from tests.synth.engine_cases import Real

MASS, DAMPING, SPRING = 1e-4, 2.4, 1e3  # kg, N s/m, N/m: the defaults of the effect
OLD = (5e-3, 3.0, 0.0)  # a whole finger on its contact
Motion = Callable[[float], tuple[float, float]]


def with_pulp(steps: TableStepper, spring: float = SPRING, loads: tuple[float, float] = (LOAD, LOAD)) -> TableStepper:
    """Return `steps` on a spring, which is at rest at the mean of z at the present load."""
    mean = mean_of(heights_of_mean(table_of("default")[0]), loads, LOAD, 1e-3)
    return replace(steps, pulp=Pulp(spring, mean))


def rest_at(steps: TableStepper, load: float) -> float:
    """Return z_w (m)."""
    return float(steps.pulp.rests(load, np.empty(0), 0.0)[0])


def integrated(steps: TableStepper, motion: Motion, begin: tuple[float, float], times: Real) -> Real:
    """Return z (m) at `times` (s) by SciPy, from z and z' at 0; motion: turns and load (N) at a time (s)."""

    def rate(t: float, y: Real) -> list[float]:
        turns, load = motion(t)
        depth = float(steps.table.read(np.array([turns % 1.0]), y[:1].copy())[0, 0])
        spring = steps.pulp.stiffness * (float(y[0]) - rest_at(steps, load))
        force = stiffness_at(steps, load) * depth - load - spring - steps.damping * float(y[1])
        return [float(y[1]), force / steps.mass]

    found = solve_ivp(rate, (0.0, times[-1]), begin, "DOP853", times, rtol=1e-9, atol=[1e-15, 1e-11], max_step=5e-5)
    assert found.success
    return np.asarray(found.y[0])


def check_against_scipy(steps: TableStepper, motion: Motion, seconds: float, rate: float, first: float) -> None:
    """Assert that z is that of SciPy within 1e-6 of its peak-to-peak; first: load (N) before 0."""
    count = round(seconds * rate)
    times = np.arange(1, count + 1) / rate
    state = steps.start(0, first, 0.0, 1.0 / rate)
    state.numbers[LOAD_NOW] = motion(0.0)[1]
    begin = (float(state.numbers[0]), float(state.numbers[1]))
    turns, loads = np.array([motion(t) for t in times]).T
    z = run(steps, state, turns, loads)[HEIGHT]
    some = slice(count // 400 - 1, None, count // 400)
    exact = integrated(steps, motion, begin, times[some])
    assert np.max(np.abs(z[some] - exact)) <= 1e-6 * np.ptp(exact)


@pytest.mark.parametrize("after", [0.6, thorough(0.1)])
def test_a_step_of_the_load_is_that_of_scipy(after: float) -> None:
    steps = with_pulp(stepper(MASS, DAMPING, lightest=0.1, heaviest=0.6), loads=(0.1, 0.6))
    check_against_scipy(steps, lambda _t: (0.0, after), 2e-3, 8e6, LOAD)


@pytest.mark.parametrize(("mass", "damping"), [(MASS, DAMPING), thorough(1e-3, 0.5)])
def test_a_sweep_over_the_texture_under_a_swinging_load_is_that_of_scipy(mass: float, damping: float) -> None:
    """The scan speeds up from 0 to 1 kHz while the load swings at 70 Hz."""
    steps = with_pulp(stepper(mass, damping, lightest=0.1, heaviest=0.6), loads=(0.1, 0.6))

    def motion(t: float) -> tuple[float, float]:
        return 0.5 * 1e3 / 8e-3 * t * t, 0.35 - 0.05 * np.cos(2 * np.pi * 70.0 * t)

    check_against_scipy(steps, motion, 8e-3, 6e6, LOAD)


def gain_of(mass: float, damping: float, spring: float, turn: float, highest: float = 8e3) -> tuple[Real, Real]:
    """Return frequencies from 10 Hz (Hz), and |z| over |force| there relative to 10 Hz, for small motions at a phase.

    It is the spectrum of the motion after an impulse.
    """
    steps, rate, count = with_pulp(stepper(mass, damping), spring), 192000, 19200
    state = steps.start(int(turns_to_phase(np.array([turn]))[0]), LOAD, 0.0, 1.0 / rate)
    rest = float(state.numbers[Z])
    state.numbers[SPEED] = 1e-5
    z = run(steps, state, np.full(count, turn), LOAD)[HEIGHT] - rest
    assert abs(z[-1]) <= 1e-6 * np.max(np.abs(z))
    kept = np.arange(1, round(highest * count / rate))
    gain = np.abs(np.fft.rfft(z))[kept]
    return kept * rate / count, gain / gain[0]


PLACES = np.arange(16) / 16


def test_the_default_contact_has_no_resonance_above_100_hz() -> None:
    """On the stiffest phases of the texture the gain is up to 4 % above that of slow motions, on the mean 2 %."""
    settings = EFFECT.settings()
    gains = []
    for turn in PLACES:
        frequency, gain = gain_of(settings.mass, settings.damping, settings.stiffness, float(turn))
        gains.append(np.max(gain[frequency > 100.0]))
    assert np.max(gains) <= 1.05 and np.mean(gains) <= 1.03


def test_a_whole_finger_on_its_contact_rings_at_425_hz() -> None:
    found = [gain_of(*OLD, float(turn)) for turn in PLACES]
    peaks = np.array([(frequency[np.argmax(gain)], np.max(gain)) for frequency, gain in found])
    assert np.mean(peaks[:, 0]) == pytest.approx(425.0, rel=0.03)
    assert np.max(peaks[:, 1]) == pytest.approx(4.7, rel=0.02) and np.min(peaks[:, 1]) > 4.0


def test_without_damping_the_energy_stays() -> None:
    """The spring has its part of it: m v^2 / 2 + k E + k_p (z - z_w)^2 / 2 + w z."""
    steps, rate = with_pulp(stepper(MASS), 2e4), 48000
    state, _floor = released(steps, rate, 1e-6)
    home = rest_at(steps, LOAD)

    def total() -> float:
        return energy(steps, state, LOAD) + 0.5 * steps.pulp.stiffness * (float(state.numbers[Z]) - home) ** 2

    still = steps.start(PHASE, LOAD, 0.0, 1.0 / rate)
    floor = energy(steps, still, LOAD) + 0.5 * steps.pulp.stiffness * (float(still.numbers[Z]) - home) ** 2
    begin, out = total() - floor, np.zeros((ROWS, rate))
    for _second in range(3):
        steps.run(state, np.full(rate, PHASE, dtype=np.uint64), np.full(rate, LOAD), out)
        assert abs(total() - floor - begin) <= 2e-8 * begin
    assert np.ptp(out[HEIGHT]) > 1e-6


def test_a_finger_at_rest_is_balanced_and_stays_bit_for_bit() -> None:
    steps = with_pulp(stepper(MASS, DAMPING))
    for phase in np.random.default_rng(3).integers(0, 1 << 64, 20, dtype=np.uint64):
        state = steps.start(int(phase), LOAD, 0.0, 1.0 / 48000)
        z, out = float(state.numbers[Z]), np.zeros((ROWS, 50))
        reaction = stiffness_at(steps, LOAD) * read(steps, int(phase), z)[0]
        assert reaction == pytest.approx(LOAD + SPRING * (z - rest_at(steps, LOAD)), rel=1e-12)
        steps.run(state, np.full(50, phase), np.full(50, LOAD), out)
        assert np.all(out[HEIGHT] == z)


def test_a_slow_scan_is_elastic_but_for_the_part_that_the_spring_takes() -> None:
    """The spring takes k_p / (k_p + k l) of each small motion, 3 % here, and leaves the mean where it is."""
    steps = with_pulp(stepper(MASS, DAMPING))
    slow, still = (scanned(one, 48000, 1.0, 1.0)[HEIGHT] for one in (steps, steps.elastic))
    touching = np.mean(steps.table.read(np.arange(48000) / 48000, still)[1])
    part = SPRING / (SPRING + stiffness_at(steps, LOAD) * float(touching))
    assert 0.02 < part < 0.04
    home = rest_at(steps, LOAD)
    assert abs(np.mean(slow) - home) <= 5e-3 * np.ptp(still)
    assert np.max(np.abs((slow - home) - (1.0 - part) * (still - home))) <= 6e-3 * np.ptp(still)


def test_runs_of_any_lengths_give_the_same_bits_under_a_varying_load() -> None:
    steps, random = with_pulp(stepper(MASS, DAMPING), loads=(0.0, 1.0)), np.random.default_rng(5)
    turns, loads = np.cumsum(random.uniform(-0.01, 0.02, 300)), random.uniform(0.0, 1.0, 300)
    once = run(steps, steps.start(0, 0.3, 0.0, 1e-5), turns, loads)
    state, parts = steps.start(0, 0.3, 0.0, 1e-5), []
    for begin, end in ((0, 1), (1, 40), (40, 41), (41, 300)):
        parts.append(run(steps, state, turns[begin:end], loads[begin:end]))
    assert np.array_equal(np.concatenate(parts, axis=1), once)


def test_a_contact_that_is_thrown_off_is_brought_back_by_the_pulp() -> None:
    """In flight m z'' + c z' + k_p (z - z_w) = -w: a damped return to z_w - w / k_p, far below the surface."""
    steps, rate, height = with_pulp(stepper(MASS, DAMPING, forces=True)), 192000, 200e-6
    state, _floor = released(steps, rate, height)
    stands, target = float(state.numbers[Z]) - height, rest_at(steps, LOAD) - LOAD / SPRING
    out = run(steps, state, np.full(4000, PHASE / 2**64), LOAD)
    flying = int(np.argmax(out[REACTION] > 0.0))
    assert flying > 50
    t, (fast, slow) = np.arange(1, flying + 1) / rate, np.roots([MASS, DAMPING, SPRING])
    falls = (slow * np.exp(fast * t) - fast * np.exp(slow * t)) / (slow - fast)
    assert out[HEIGHT, :flying] == pytest.approx(target + (stands + height - target) * falls, abs=1e-3 * height)
    assert out[HEIGHT, -1] == pytest.approx(stands, abs=1e-9)


def test_with_adhesion_a_finger_on_the_pulp_lets_go_where_one_without_mass_does() -> None:
    """The mean of z of a held finger is where the spring rests; with that of eq. 1, the spring would pull too."""
    plain = stepper(pull=0.5, reach=5e-6, below=20e-6)
    light = replace(plain, mass=MASS, damping=DAMPING, pulp=Pulp(SPRING, attracted_mean(plain, -0.05, LOAD)))
    wrong = replace(light, pulp=with_pulp(plain, loads=(0.0, LOAD)).pulp)
    count = 48000
    loads, turns = np.linspace(0.05, -0.05, count), np.arange(1, count + 1) * 100.0 / 48000
    let_go = []
    for one in (plain, light, wrong):
        out = run(one, one.start(0, 0.05, 0.0, 1.0 / 48000), turns, loads)
        gone = int(np.argmin(out[ATTACHED]))
        assert gone > 0 and not np.any(out[ATTACHED, gone:])
        let_go.append(float(loads[gone]))
    assert let_go[0] < -4e-3
    assert let_go[1] == pytest.approx(let_go[0], abs=3e-4)
    assert abs(let_go[2] - let_go[0]) > 2e-3
