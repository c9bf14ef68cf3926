"""Newton's method never runs long: hundreds of contacts, the extreme ones on purpose, and what they took at most."""

from __future__ import annotations

import math

import numpy as np

from synth.contact.exact_solver import MOST_ITERATIONS, SMALLEST_INDENTATION, Grid
from synth.contact.geometry import Geometry
from tests.reference.contact_oracle import solve_contact
from tests.synth.engine_cases import spread

BOUND = 40  # 37 were seen at most; a cold start at the smallest load takes log3(1e12) = 25 for a crest, 30 at an end
KINDS = 6


def contact(number: int, random: np.random.Generator) -> Geometry:
    """Return a contact in units of its ridges: any, or one of those in which h is nearly flat or nearly a line."""
    kind = number % KINDS
    tau, period, amplitude = spread(random, 1e-2, 300), spread(random, 3e-3, 300), spread(random, 1e-9, 1e9)
    ridge, phase = 1.0, float(random.uniform(0, 6.28))
    if kind == 1:
        ridge, amplitude = 0.0, 1.0
    elif kind == 2:
        period, amplitude = 1.0, spread(random, 0.5, 2.0)
    elif kind == 3:
        period, amplitude, phase = 1.0 + spread(random, 1e-12, 1e-3), 1.0, math.pi
    elif kind == 4:
        period, amplitude, phase = 1.0, 1.0 + spread(random, 1e-15, 1e-3), math.pi
    elif kind == 5:
        tau = spread(random, 1e-3, 0.2)
    return Geometry(ridge, 1.0, amplitude, max(period, tau / 1000), phase, tau)


def test_iterations_are_bounded_over_a_thousand_contacts() -> None:
    random = np.random.default_rng(60)
    most = 0
    for number in range(1200):
        geometry = contact(number, random)
        lightest = SMALLEST_INDENTATION
        pressed = spread(random, 1e-22, 1e3) if number % 2 else spread(random, lightest, 1e6 * lightest)
        phases = random.uniform(0, 1, 6)  # in no order: each begins far from where the one before has ended
        found = Grid.of_geometry(geometry).solve(phases, pressed * geometry.height_scale)
        most = max(most, int(found.iterations.max()))
        assert np.all(np.isfinite(found.height))
    assert most <= BOUND < MOST_ITERATIONS


def test_what_took_longest_is_solved_and_not_cut_short() -> None:
    """The contacts in which iterations are most, against the oracle: it is not the bound that ended them."""
    random = np.random.default_rng(61)
    for number in range(60):
        geometry = contact(number, random)
        if geometry.texture_periods > 300 or geometry.ridges > 100:
            continue
        pressed, phase = SMALLEST_INDENTATION * spread(random, 1.0, 100.0) * geometry.height_scale, random.uniform(0, 1)
        found = Grid.of_geometry(geometry).solve(np.array([phase]), pressed)
        wanted = solve_contact(
            geometry.contact_length, geometry.texture_period, geometry.texture_amplitude,
            geometry.contact_length * np.longdouble(pressed), phase, geometry.texture_phase,
            ridge=geometry.ridge_amplitude,
        )  # fmt: skip
        assert found.iterations[0] <= BOUND
        assert abs(found.height[0] - wanted.approach[()]) <= 2e-13 * geometry.height_scale


def test_a_guess_far_off_takes_no_longer() -> None:
    random = np.random.default_rng(62)
    most = 0
    for number in range(300):
        geometry = contact(number, random)
        pressed = spread(random, 1e-18, 10.0) * geometry.height_scale
        guess = random.uniform(-50, 50, 4) * geometry.height_scale
        found = Grid.of_geometry(geometry).solve(random.uniform(0, 1, 4), pressed, guess)
        most = max(most, int(found.iterations.max()))
    assert most <= BOUND
