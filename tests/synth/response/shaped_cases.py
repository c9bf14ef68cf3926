"""Shared checks of contacts whose shape depends on the load: slope, series and tables against an oracle."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from synth.contact.forces import Response
from synth.contact.load_balance import Contact
from synth.response.demand import Demand, curves, points_for
from synth.response.spectrum import solve_spectrum
from synth.response.table_making import TableBounds, make_table
from tests.reference.shaped_contact_oracle import Pressed
from tests.reference.slow_table_reading import sample
from tests.synth.engine_cases import Real

ORDERS = (0, 1, 2)
THETA = np.arange(16) / 16
HIGHEST = 40
PERIOD, BAND = 0.8e-3, 1000.0  # m and Hz of tables


def finer(contact: Contact, halvings: int) -> Contact:
    """Return `contact` with its segments halved `halvings` times."""
    for _ in range(halvings):
        refined = contact.refined()
        assert refined is not None
        contact = refined
    return contact


def differences(contact: Contact, load: float, share: float = 1e-5) -> Real:
    """Return dz/dw at THETA from z at loads on both sides."""
    step = share * load
    above, below = contact.approach(THETA, load + step)[0], contact.approach(THETA, load - step)[0]
    return np.asarray((above - below) / (2 * step))


def check_series(contact: Contact, load: float, oracle: Callable[[float], Pressed]) -> None:
    """Check the series at `load` against one of far more phases, and against `oracle`, a function of theta."""
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


def check_table(response: Response, oracle: Callable[[float, float], float], told_at_most: float = 5e-3) -> None:
    """Check a table of `response` against `oracle`, a function of theta and load, between the rows and places."""
    table = make_table(response, period=PERIOD, band=BAND, lift_load=1e-6, bounds=TableBounds(harmonics=HIGHEST))
    header, tensors = table.header, table.tensors
    slow = 0.5 * PERIOD * BAND / HIGHEST  # m/s: every harmonic sounds
    random = np.random.default_rng(4)
    for load in random.uniform(0.25, 0.4, 4).tolist():
        theta = random.uniform(0, 1, 4).tolist()
        wanted = np.array([oracle(one, load) for one in theta])
        read = np.array([sample(header, tensors, "approach", one, slow, load) for one in theta])
        known = response.approach(np.arange(1 << 12) / (1 << 12), load)[0]
        left_out = 2.0 * float(np.sum(np.abs(np.fft.rfft(known)[HIGHEST + 1 :]))) / len(known)
        told = table.error.at(load, "displacement", HIGHEST)
        assert told <= told_at_most
        apart = read - wanted
        assert np.max(np.abs(apart - apart.mean())) <= 2.0 * told * np.ptp(known) + left_out
