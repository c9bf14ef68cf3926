"""The contact oracle against closed forms, symmetries, 40 digits, and patches too small for any grid."""

from __future__ import annotations

import ast
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.reference.contact_oracle import Contact, pieces_of, solve_contact
from tests.reference.contact_oracle_mpmath import ExactContact, solve_exactly
from tests.reference.sampled_baseline import sampled_approach

PHI = math.sqrt(2.0)
TYPES = [pytest.param(np.longdouble, 3e-18, id="longdouble"), pytest.param(np.float64, 1e-14, id="float64")]


def random_cases(count: int, seed: int, most_waves: float = np.inf) -> Any:
    """Rows tau, Lambda, A, W, theta over the whole range in use; every fourth has W/tau from 1e-14 to 100."""
    random = np.random.default_rng(seed)

    def spread(low: float, high: float) -> Any:
        return np.exp(random.uniform(math.log(low), math.log(high), count))

    tau, period, amplitude = spread(0.3, 60), spread(0.02, 50), spread(0.01, 20)
    tau = np.minimum(tau, most_waves / (1 + 1 / period))
    pressed = np.where(np.arange(count) % 4 == 0, spread(1e-14, 100), spread(1e-6, 3))
    return np.column_stack([tau, period, amplitude, tau * pressed, random.uniform(0, 1, count)])


def solve_all(cases: Any, dtype: Any = np.longdouble) -> Contact:
    """The contacts of ``random_cases``."""
    tau, period, amplitude, load, theta = cases.T
    return solve_contact(tau, period, amplitude, load, theta, PHI, dtype=dtype)


def solve_all_exactly(cases: Any) -> list[ExactContact]:
    """The same in 40 digits."""
    return [solve_exactly(tau, period, size, load, theta, PHI) for tau, period, size, load, theta in cases]


def wide(number: Any) -> Any:
    """An mpmath number as long double, to its last digits."""
    high = float(number)
    return np.longdouble(high) + np.longdouble(float(number - high))


def worst_error(cases: Any, exact: list[ExactContact], dtype: Any) -> float:
    """Largest |Z - Z_exact| / (1 + A + |Z|)."""
    found = solve_all(cases, dtype).approach
    truth = np.array([wide(one.approach) for one in exact])
    return float(np.max(np.abs(found - truth) / (1 + cases[:, 2] + np.abs(truth))))


@pytest.mark.thorough
def test_both_precisions_agree_with_forty_digits_over_the_whole_range() -> None:
    cases = random_cases(4, seed=7, most_waves=30)
    exact = solve_all_exactly(cases)
    assert worst_error(cases, exact, np.longdouble) < 2e-18
    assert worst_error(cases, exact, np.float64) < 2e-15
    contact = solve_all(cases)
    pressed = np.flatnonzero(cases[:, 3] / cases[:, 0] >= 1e-6)
    for row in pressed:
        length, slope = wide(exact[row].contact_length), wide(exact[row].phase_slope)
        assert abs(contact.contact_length[row] / length - 1) < 1e-14
        assert abs(contact.phase_slope[row] - slope) < 1e-14 * cases[row, 2]
        assert contact.load_slope[row] * contact.contact_length[row] == pytest.approx(-1, abs=1e-15)


def test_float64_agrees_with_long_double_on_200_random_scenes() -> None:
    cases = random_cases(200, seed=11)
    slow = solve_all(cases)
    fast = solve_all(cases, np.float64)
    scale = 1 + cases[:, 2] + np.abs(slow.approach)
    assert np.max(np.abs(slow.approach - fast.approach) / scale) < 5e-15


@pytest.mark.parametrize(("dtype", "bound"), TYPES)
def test_full_contact_is_the_mean_less_the_indentation_and_moves_as_sinc(dtype: Any, bound: float) -> None:
    tau, period, amplitude, load = 20.3, 1.7, 0.5, 20.3 * 2.0
    theta = np.arange(16) / 16
    contact = solve_contact(tau, period, amplitude, load, theta, PHI, dtype=dtype)
    pi = 4 * np.arctan(np.longdouble(1))
    share = pi * np.longdouble(tau) / np.longdouble(period)
    moving = amplitude * np.sin(share) / share * np.cos(share + np.longdouble(PHI) - 2 * pi * theta)
    still = -np.sin(2 * pi * np.longdouble(tau)) / (2 * pi * tau) - np.longdouble(load) / tau
    assert np.max(np.abs(contact.approach - moving - still)) < 2 * bound
    assert np.max(np.abs(contact.contact_length - tau)) < 10 * bound
    assert np.ptp(contact.approach) == pytest.approx(2 * amplitude * abs(float(np.sin(share) / share)), rel=0.02)


@pytest.mark.parametrize("pressed", [1e-9, 1e-4, 0.05, 0.4])
def test_locked_equal_periods_follow_the_closed_form_of_one_ridge(pressed: float) -> None:
    amplitude, theta = 0.5, np.array([0.0, 0.11, 0.37, 0.8])
    crest = np.abs(amplitude * np.exp(1j * (PHI - 2 * np.pi * theta)) - 1)
    contact = solve_contact(7, 1, amplitude, 7 * pressed, theta, PHI)
    for row, height in enumerate(crest):
        wanted = pressed * np.pi / height
        half = brentq(lambda b, w=wanted: np.sin(b) - b * np.cos(b) - w, 0, np.pi, xtol=1e-15)
        assert float(contact.approach[row]) == pytest.approx(height * np.cos(half), abs=3e-15)
        assert float(contact.contact_length[row]) == pytest.approx(7 * half / np.pi, rel=1e-6)


def test_locked_surfaces_that_fit_into_each_other_leave_nothing_to_move() -> None:
    theta = PHI / (2 * np.pi) + np.array([0.0, 1e-15, 1e-11, 1e-6, 0.5])
    contact = solve_contact(7, 1, 1, 7e-3, theta, PHI)
    amplitude = 2 * np.abs(np.sin(np.pi * (theta - PHI / (2 * np.pi))))
    assert np.all(contact.crest.astype(float) <= amplitude + 1e-15)
    assert np.max(np.abs(contact.approach[:4].astype(float) + 1e-3)) < 1e-14
    assert contact.contact_length[:4].astype(float) == pytest.approx(7, abs=1e-12)


def test_a_texture_much_longer_than_the_contact_is_followed_at_every_load() -> None:
    theta = np.arange(32) / 32
    profile = 0.8 * np.cos(PHI - 2 * np.pi * theta)
    for pressed in (1e-6, 0.05, 2.0):
        approach = solve_contact(8, 8e6, 0.8, 8 * pressed, theta, PHI).approach
        assert np.max(np.abs(approach - approach.mean() - profile)) < 1e-5


@pytest.mark.parametrize("amplitude", [0.0, 0.5, 6.0])
def test_without_load_the_approach_is_the_highest_point(amplitude: float) -> None:
    contact = solve_contact(5.3, 0.77, amplitude, 0.0, 0.21, PHI)
    x = np.linspace(0, 5.3, 200_001)
    height = amplitude * np.cos(2 * np.pi * (x / 0.77 - 0.21) + PHI) - np.cos(2 * np.pi * x)
    bend = (2 * np.pi) ** 2 * (1 + amplitude / 0.77**2) * (x[1] / 2) ** 2 / 2
    assert height.max() - 1e-14 <= float(contact.approach) <= height.max() + bend
    assert float(contact.contact_length) == 0
    lightly = solve_contact(5.3, 0.77, amplitude, 1e-13, 0.21, PHI)
    assert 0 < float(contact.approach - lightly.approach) < 1e-7


def test_a_smooth_texture_does_not_move_and_a_smooth_finger_is_one_cosine() -> None:
    still = solve_contact(20, 1.6, 0.0, 0.5, np.arange(8) / 8, PHI)
    assert np.ptp(still.approach) == 0
    assert np.all(still.phase_slope == 0)
    smooth = solve_contact(6, 1, 1.0, 0.3, 0.25, PHI, ridge=0.0)
    ridged = solve_contact(6, 50, 0.0, 0.3, 0.25, PHI)
    assert float(smooth.approach) == pytest.approx(float(ridged.approach), abs=1e-15)
    flat = solve_contact(6, 1, 0.0, 0.3, 0.25, PHI, ridge=0.0)
    assert float(flat.approach) == pytest.approx(-0.05, abs=1e-15)


def test_whole_turns_the_mirror_and_repeated_cells_change_nothing() -> None:
    theta = np.array([0.1, 0.45, 0.9375])
    tau, period, amplitude, load = 12, 1.5, 0.7, 0.9
    base = solve_contact(tau, period, amplitude, load, theta, PHI).approach
    turned = solve_contact(tau, period, amplitude, load, 0.9375 + np.array([0.0, 2.0**40, -(2.0**30)]), PHI).approach
    assert np.ptp(turned) == 0
    assert turned[0] == base[2]
    angle = PHI - 2 * np.pi * theta
    mirrored = solve_contact(tau, period, amplitude, load, 0.0, -angle - 2 * np.pi * tau / period).approach
    assert np.max(np.abs(mirrored - base)) < 1e-14
    half = solve_contact(tau / 2, period, amplitude, load / 2, theta, PHI).approach
    assert np.max(np.abs(half - base)) < 1e-17


@pytest.mark.parametrize("case", [(20, 1.6, 0.5, 0.5), (7.3, 0.31, 2.0, 0.01), (33.3, 6.1, 0.2, 40.0)])
def test_slopes_agree_with_differences(case: tuple[float, float, float, float]) -> None:
    tau, period, amplitude, load = case
    theta, step = 0.3217, np.longdouble(2.0**-24)
    contact = solve_contact(tau, period, amplitude, load, theta, PHI)
    shifted = solve_contact(tau, period, amplitude, load, theta + step * np.array([-1, 1]), PHI).approach
    turned = float((shifted[1] - shifted[0]) / (2 * step))
    assert turned == pytest.approx(float(contact.phase_slope), rel=1e-8, abs=1e-9)
    loads = np.longdouble(load) * (1 + step * np.array([-1, 1]))
    lowered = solve_contact(tau, period, amplitude, loads, theta, PHI).approach
    pressed = float((lowered[1] - lowered[0]) / (loads[1] - loads[0]))
    assert pressed == pytest.approx(float(contact.load_slope), rel=1e-8)


def test_a_patch_a_ten_thousandth_of_a_ridge_wide_is_found() -> None:
    tau, period, amplitude, theta = 6.0, 1.37, 0.5, 0.2
    positions = pieces_of(tau, period, amplitude, theta, PHI).astype(float)
    heights = amplitude * np.cos(2 * np.pi * (positions / period - theta) + PHI) - np.cos(2 * np.pi * positions)
    inside = (heights[1:-1] > heights[:-2]) & (heights[1:-1] > heights[2:])
    third = np.sort(heights[1:-1][inside])[-3]
    target, load = third - 6e-8, 1e-3
    for _ in range(40):
        contact = solve_contact(tau, period, amplitude, load, theta, PHI)
        load += float((contact.approach - target) * contact.contact_length)
    before = solve_exactly(tau, period, amplitude, 0.9999 * load, theta, PHI)
    after = solve_exactly(tau, period, amplitude, load, theta, PHI)
    assert after.patches == before.patches + 1
    narrow = solve_contact(tau, period, amplitude, load, theta, PHI)
    above = solve_contact(tau, period, amplitude, load, theta, PHI).approach - np.longdouble(third)
    assert float(above) == pytest.approx(-6e-8, rel=1e-3)
    assert abs(wide(after.approach) - narrow.approach) < 1e-18
    assert abs(wide(after.contact_length) - narrow.contact_length) < 1e-12
    grown = narrow.contact_length - solve_contact(tau, period, amplitude, 0.9999 * load, theta, PHI).contact_length
    assert 0.5e-4 < grown < 3e-4


def test_the_sampled_baseline_comes_near_and_nearer() -> None:
    exact = float(solve_contact(20, 1.6, 0.5, 0.5, 0.3, PHI).approach)
    errors = [abs(sampled_approach(20, 1.6, 0.5, 0.5, 0.3, PHI, points) - exact) for points in (25, 400, 6400)]
    assert errors[0] < 1e-2
    assert errors[2] < 1e-6
    assert errors[2] < errors[0]


@pytest.mark.parametrize(
    ("tau", "period", "amplitude", "load", "theta"),
    [(0, 1, 1, 1, 0), (1, 0, 1, 1, 0), (1, 1, -1, 1, 0), (1, 1, 1, -1, 0), (1, 1, 1, np.nan, 0), (1, 1, 1, 1, np.inf)],
)
def test_what_the_model_does_not_cover_is_refused(
    tau: float, period: float, amplitude: float, load: float, theta: float
) -> None:
    with pytest.raises(ValueError, match="must be finite"):
        solve_contact(tau, period, amplitude, load, theta)


def test_no_reference_imports_the_engine() -> None:
    for module in Path(__file__).parent.glob("*.py"):
        for node in ast.walk(ast.parse(module.read_text(encoding="utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            assert not {name.split(".")[0] for name in names} & {"ridgewave", "synth", "service", "clients"}, (
                module.name
            )
