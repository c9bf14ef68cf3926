"""Which method a plan takes: the cheapest, by predicted time, of those that hold the tolerance.

Stage   2, used by `preparation` and `channels`.
Model   Cost is predicted from the constants below, never timed, so that the same scene gives the same samples. A steady
        reader is chosen for a second of sound: its set-up, and a second's frames. A solver is chosen for the phases
        that the tolerance will take, what it takes to measure its error included.
        The error e of sampled phases is measured at PROBES phases, against the exact solver. A series of H harmonics
        and its k-th derivative over theta then err by at most (2 pi H)^k times UNSEEN e (Bernstein, 1912), which goes
        into the error of the series.
Limits  the constants are medians on one core of one machine with AVX-512; elsewhere the choice may cost more than
        another would, but holds the tolerance all the same.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from synth.arrays import Array
from synth.contact.balance import Contact
from synth.contact.sampled import SampledGrid
from synth.response.phase_cells import CUBIC, LINEAR, fitted_table
from synth.response.spectrum import (
    GOLDEN,
    Complex,
    Demand,
    Spectrum,
    changes,
    curves,
    harmonics_of,
    points_for,
    solve_spectrum,
)
from synth.response.steady import SteadyHarmonics, SteadyReader, SteadyTable

# Nanoseconds, `python -m tests.bench methods`; a wrong one makes a plan dearer, not worse.
CUBIC_FRAME, LINEAR_FRAME = 1.0, 0.8
HARMONICS_FRAME, HARMONIC_FRAME = 1.15, 0.14  # a frame, and a harmonic of it
TABLE_SETUP, CELL_SETUP = 60e3, 150.0  # of a table, and of each of its cells
EXACT_CELL, SAMPLED_PIECE = 8.0, 1.1  # of a phase
SAMPLING_SETUP = 200e3  # what it costs to consider sampling at all

EXACT_FAMILY = "exact"  # of solvers: a sampled one would stand in for nothing else
JUDGED_PHASES = 2048  # at most: at which a discretisation is judged, 4 a harmonic where there are fewer
JUDGED_WORK = 1 << 26  # phases times cells: a fraction of a second
POINTS_A_RIDGE = (8, 16, 32, 64, 128, 256, 512)
PROBES = 16  # phases at which sampling is compared with the exact solver
BETWEEN_PLACES = 1.1  # times the largest error of a table at the quarters of its cells: what it may be between them
UNSEEN = 2.0  # times the largest error at the probes
SAMPLED_SHARE = 0.3  # of the tolerance of a series: what sampling may use of it


@dataclass(frozen=True, slots=True)
class Reading:
    """A reader of a channel, and its largest error relative to the peak-to-peak."""

    reader: SteadyReader
    error: float


def cheapest_reader(series: Complex, tolerance: float, rate: int) -> Reading:
    """Return the cheapest reader of `series` (its mean left out) that errs by at most `tolerance` of its extent."""
    count = len(series) - 1
    cells = {degree: _expected_cells(series, degree, tolerance) for degree in (LINEAR, CUBIC)}
    costs = {
        0: rate * (HARMONICS_FRAME + HARMONIC_FRAME * count),
        LINEAR: TABLE_SETUP + CELL_SETUP * cells[LINEAR] + rate * LINEAR_FRAME,
        CUBIC: TABLE_SETUP + CELL_SETUP * cells[CUBIC] + rate * CUBIC_FRAME,
    }
    degree = min(costs, key=lambda one: costs[one])
    if degree == 0:
        return Reading(SteadyHarmonics(series), 4e-16 * count)
    fitted = fitted_table(series, degree, (0,), tolerance / BETWEEN_PLACES)
    return Reading(SteadyTable(fitted.coefficients), BETWEEN_PLACES * fitted.errors[0])


def _expected_cells(series: Complex, degree: int, tolerance: float) -> float:
    """Return about how many cells a table of `degree` takes: h^2 / 8 max |y''|, or h^4 / 384 max |y''''|."""
    curve = curves(series, degree + 1, points_for(len(series) - 1))
    extent = float(np.ptp(curves(series, 0, points_for(len(series) - 1))))
    largest = float(np.max(np.abs(curve))) / max(extent, 1e-300)
    factor = 8.0 if degree == LINEAR else 384.0
    return 2.0 ** math.ceil(math.log2(max((largest / (factor * tolerance)) ** (1.0 / (degree + 1)), 16.0)))


def expected_phases(demand: Demand) -> float:
    """Return about how many phases a series of `demand` takes: a prediction of cost alone."""
    least = 2.0 * demand.highest if max(demand.orders) else 32.0
    return float(max(least, 128.0 * (1e-2 / demand.tolerance) ** 0.4))


def cheapest_spectrum(contact: Contact, load: float, demand: Demand, keep: int) -> Spectrum:
    """Return the series of z at `load` (N) that keeps `demand`; see `solve_spectrum`.

    The sampled solver is taken where it is cheaper and its error is within SAMPLED_SHARE of the demand's tolerance.
    """
    alone = contact.closed(load) is not None or not contact.of_one_shape or contact.grid.family != EXACT_FAMILY
    sampled = None if alone else _sampled(contact, load, demand)
    if sampled is not None:
        coarse, error = sampled
        rest = Demand(demand.highest, demand.orders, (1.0 - SAMPLED_SHARE) * demand.tolerance)
        spectrum = solve_spectrum(coarse, load, rest, keep)
        added = _sampling_errors(spectrum, demand, error)
        errors = tuple(one + other for one, other in zip(spectrum.errors, added, strict=True))
        if max(errors) <= demand.tolerance:
            return replace(spectrum, errors=errors)
    return solve_spectrum(contact, load, demand, keep)


def fine_enough(contact: Contact, loads: tuple[float, ...], demand: Demand) -> Contact:
    """Return `contact` on a discretisation that keeps its share of `demand` at each of `loads` (N), or the best that a
    bound on work allows; `contact` itself where its solver has none.

    What reads the contact at places and loads of its own (frames, simulations) takes this one; a series refines further
    by itself where it must.
    """
    finer = contact.refined()
    phases = min(points_for(demand.highest), JUDGED_PHASES)
    theta = np.arange(phases) / phases
    seen = Demand(min(demand.highest, phases // 4), demand.orders, demand.tolerance)
    while finer is not None:
        good = True
        for load in loads:
            before, after = (harmonics_of(one.approach(theta, load)[0], seen.highest) for one in (contact, finer))
            good = good and changes(before, after, seen, finer.scale_at(load))[1]
        contact = finer
        spent = len(loads) * phases * contact.work_at(max(loads)) > JUDGED_WORK
        finer = None if good or spent else contact.refined()
    return contact


def _sampled(contact: Contact, load: float, demand: Demand) -> tuple[Contact, float] | None:
    """Return the contact with the fewest points that may hold the demand and are cheaper, and their error (m).

    Twice the points leave a quarter of the error, so numbers that will not hold are passed over.
    """
    affordable = [points for points in POINTS_A_RIDGE if _saves(contact, demand, points)]
    if not affordable:
        return None
    probes = np.sort((GOLDEN * np.arange(1, PROBES + 1)) % 1.0)
    exact, _slope = contact.approach(probes, load)
    extent, error = float(np.ptp(exact)), 0.0
    for place, points in enumerate(affordable):
        if place and not _may_hold(0.2 * error * (affordable[place - 1] / points) ** 2, extent, demand):
            error *= (affordable[place - 1] / points) ** 2
            continue
        coarse = Contact.of(contact.geometry, contact.stiffness, SampledGrid.of_geometry(contact.geometry, points))
        height, _slope = coarse.approach(probes, load)
        error = UNSEEN * float(np.max(np.abs(height - exact)))
        if _may_hold(error, extent, demand):
            return coarse, error
    return None


def _saves(contact: Contact, demand: Demand, points: int) -> bool:
    """Return whether so many points a ridge are cheaper than the exact solver, what it takes to try them included."""
    exact = EXACT_CELL * contact.cells
    sampled = SAMPLED_PIECE * points * max(contact.geometry.ridges, 1.0)
    return expected_phases(demand) * (exact - sampled) > SAMPLING_SETUP + PROBES * (exact + sampled)


def _may_hold(error: float, extent: float, demand: Demand) -> bool:
    """Return whether sampling may hold the demand; a derivative swings 4 times as far as what it is taken of."""
    allowed = SAMPLED_SHARE * demand.tolerance * extent
    return all(_carried(error, demand.highest, order) <= allowed * 4.0**order for order in demand.orders)


def _carried(error: float, highest: int, order: int) -> float:
    """Return what an error (m) of z may be in a derivative over theta of its first `highest` harmonics."""
    return float((2.0 * math.pi * highest) ** order * error)


def _sampling_errors(spectrum: Spectrum, demand: Demand, error: float) -> tuple[float, ...]:
    """Return what sampling adds to the errors of the demand's orders, relative to each peak-to-peak."""
    points = points_for(demand.highest)
    errors = []
    for order in demand.orders:
        curve: Array = curves(spectrum.harmonics[: demand.highest + 1], order, points)
        extent = float(np.ptp(curve))
        errors.append(_carried(error, demand.highest, order) / extent if extent > 0.0 else 0.0)
    return tuple(errors)
