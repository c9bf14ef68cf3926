"""What the tests of contacts share whose shape depends on the load: their slope, series and rows against an oracle."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from synth.contact.balance import Contact
from synth.response.load_rows import FINEST, Rows
from synth.response.spectrum import Demand, curves, points_for, solve_spectrum
from tests.reference.shaped_contact_oracle import Pressed
from tests.synth.engine_cases import Real

ORDERS = (0, 1, 2)
THETA = np.arange(16) / 16
HIGHEST = 40


def differences(contact: Contact, load: float, share: float = 1e-5) -> Real:
    """Return dz/dw at THETA from z at loads to both sides."""
    step = share * load
    above, below = contact.approach(THETA, load + step)[0], contact.approach(THETA, load - step)[0]
    return np.asarray((above - below) / (2 * step))


def check_series(contact: Contact, load: float, oracle: Callable[[float], Pressed]) -> None:
    """Check the series at `load` against far more phases, and against `oracle`, which takes theta."""
    series, many = solve_spectrum(contact, load, Demand(HIGHEST, ORDERS, 1e-3)), 1 << 13
    everything = np.fft.rfft(contact.approach(np.arange(many) / many, load)[0]) / many
    truth, left_out = everything[: HIGHEST + 1], 2.0 * float(np.sum(np.abs(everything[HIGHEST + 1 :])))
    points = points_for(HIGHEST)
    for order in ORDERS:
        error = np.max(np.abs(curves(series.harmonics - truth, order, points)))
        assert error <= series.errors[order] * np.ptp(curves(truth, order, points))
        assert series.errors[order] <= 1e-3
    theta = np.random.default_rng(3).uniform(0, 1, 3)
    wanted = [oracle(one).approach for one in theta.tolist()]
    waves = np.exp(2j * np.pi * np.outer(theta, np.arange(1, HIGHEST + 1)))
    read = series.harmonics[0].real + 2 * (waves @ series.harmonics[1:]).real
    moved = float(np.ptp(curves(truth, 0, points)))
    assert left_out <= 0.2 * moved
    assert np.max(np.abs(read - wanted)) <= 1e-3 * moved + left_out


def between(rows: Rows, load: float, theta: Real) -> Real:
    """Return z at `load` and `theta`, as the cubic of its interval says."""
    place = rows.interval_of(load)
    low, high = float(rows.edges[place]), float(rows.edges[place + 1])
    s = (load - low) / (high - low)
    a, b, c, d = rows.cubic(low, high, rows.keep)
    series = a + s * (b + s * (c + s * d))
    waves = np.exp(2j * np.pi * np.outer(theta, np.arange(1, rows.keep + 1)))
    return np.asarray(series[0].real + 2 * (waves @ series[1:]).real)


def check_rows(contact: Contact, tolerance: float, oracle: Callable[[float, float], Pressed]) -> None:
    """Check rows of load against `oracle`, which takes theta and load, at phases and loads off every grid."""
    rows = Rows(contact, Demand(48, (0,), tolerance / 4), 48, 2.5e-4, tolerance)
    rows.cover(0.25, 0.4, FINEST)
    assert 0 < rows.errors[0] <= tolerance
    random = np.random.default_rng(4)
    for load in random.uniform(0.25, 0.4, 4).tolist():
        theta = random.uniform(0, 1, 4)
        wanted = np.array([oracle(one, load).approach for one in theta.tolist()])
        moved = np.ptp(contact.approach(np.arange(64) / 64, load)[0])
        apart = between(rows, load, theta) - wanted
        left_out = moved * tolerance  # the harmonics above the highest
        assert np.max(np.abs(apart - apart.mean())) <= 2 * (rows.errors[0] + rows.row_error[0]) * moved + left_out
