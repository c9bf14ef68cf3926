"""Rows of load: what lies between them against the exact solver, and how they come to be."""

from __future__ import annotations

import threading
import time
from itertools import pairwise

import numpy as np
import pytest

from synth.plan.usual_hand import HAND_LOADS
from synth.response.load_rows import COARSE, FINEST, LARGEST_LOAD, Rows
from synth.response.spectrum import Demand, curves, points_for, solve_spectrum
from synth.voice.row_solver import RowSolver
from tests.reference.stiffness_oracle import contact_in_metres
from tests.synth.engine_cases import Real, contact_of, scene_of, touch_of

HIGHEST = 12
BASE = 2.5e-4  # N


def rows_of(tolerance: float = 1e-3, highest: int = HIGHEST) -> Rows:
    return Rows(contact_of(scene_of()), Demand(highest, (0,), tolerance), highest, BASE)


def between(rows: Rows, load: float) -> Real:
    """Return z about its mean over a period at `load`, as the cubic of its interval says."""
    place = rows.interval_of(load)
    low, high = rows.edges[place], rows.edges[place + 1]
    s = (load - low) / (high - low)
    a, b, c, d = rows.cubic(low, high, HIGHEST)
    return curves(a + s * (b + s * (c + s * d)), 0, points_for(HIGHEST))


def exact(load: float) -> Real:
    """Return the same from the oracle."""
    points = points_for(HIGHEST)
    z = contact_in_metres(touch_of(scene_of()), np.arange(512) / 512, load, dtype=np.float64).approach
    series = np.fft.rfft(np.asarray(z, dtype=float))[: HIGHEST + 1] / 512
    return curves(series, 0, points)


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3])
def test_between_the_rows_the_tolerance_holds(tolerance: float) -> None:
    rows = rows_of(tolerance)
    rows.cover(0.05, 2.0, 1 / 128)
    assert rows.errors[0] <= tolerance
    random = np.random.default_rng(1)
    for load in np.exp(random.uniform(np.log(0.05), np.log(2.0), 16)):
        wanted = exact(float(load))
        assert np.max(np.abs(between(rows, float(load)) - wanted)) <= 1.5 * tolerance * np.ptp(wanted)


def test_the_lightest_loads_are_covered_down_to_none() -> None:
    rows = rows_of()
    rows.cover(0.0, 1e-3, COARSE)
    assert rows.edges[0] == 0.0
    for load in (1e-9, 1e-6, 1e-4, 2.4e-4, 9e-4):
        wanted = exact(load)
        assert np.max(np.abs(between(rows, load) - wanted)) <= 2e-3 * np.ptp(wanted)


def test_edges_rise_and_hold_what_was_asked_for() -> None:
    rows = rows_of()
    rows.cover(0.3, 0.3, COARSE)
    assert rows.edges[0] <= 0.3 < rows.edges[-1]
    rows.cover(1.5, 1.5, COARSE)
    assert rows.edges[0] <= 0.3 and rows.edges[-1] > 1.5
    assert np.all(np.diff(rows.edges) > 0)


def test_the_order_of_asking_does_not_matter() -> None:
    up, down = rows_of(1e-2), rows_of(1e-2)
    for load in (0.1, 0.3, 0.8):
        up.cover(load, load, COARSE)
    for load in (0.8, 0.3, 0.1):
        down.cover(load, load, COARSE)
    assert np.array_equal(up.edges, down.edges)
    assert np.max(np.abs(between(up, 0.27) - between(down, 0.27))) <= 1e-2 * np.ptp(between(up, 0.27))


def test_a_finer_demand_refines_and_a_coarser_one_changes_nothing() -> None:
    rows = rows_of(1e-5)
    rows.cover(0.3, 0.3, COARSE)
    coarse = rows.edges
    rows.cover(0.3, 0.3, 1 / 64)
    fine = rows.edges
    assert len(fine) > len(coarse)
    assert set(coarse.tolist()) <= set(fine.tolist())
    rows.cover(0.3, 0.3, COARSE)
    assert np.array_equal(rows.edges, fine)


def test_full_contact_needs_no_solving() -> None:
    rows = rows_of()
    rows.cover(300.0, 300.0, COARSE)
    assert rows.spectrum(float(rows.edges[0])).closed
    assert rows.spectrum(float(rows.edges[-1])).closed
    assert rows.errors[0] < 1e-3


def test_every_load_of_a_scene_can_be_covered() -> None:
    rows = rows_of()
    rows.cover(LARGEST_LOAD, LARGEST_LOAD, COARSE)
    assert rows.edges[0] <= LARGEST_LOAD <= rows.edges[-1]


def test_covering_stops_when_it_is_told_to() -> None:
    rows = rows_of()
    rows.cover(0.1, 0.1, COARSE)
    before = rows.edges
    rows.cover(0.2, 3.0, COARSE, lambda: True)
    assert rows.edges is before


def test_rows_that_are_ready_stay_so_while_others_are_solved() -> None:
    rows = rows_of()
    rows.cover(0.3, 0.3, COARSE)
    seen = [rows.edges]

    def watched() -> bool:
        seen.append(rows.edges)
        return False

    rows.cover(0.05, 3.0, COARSE, watched)
    assert len({len(edges) for edges in seen}) > 4
    for before, after in pairwise([*seen, rows.edges]):
        assert np.isin(before, after).all()


def test_errors_and_bytes_are_told() -> None:
    rows = rows_of()
    rows.cover(0.3, 0.3, COARSE)
    assert rows.errors[0] > 0.0
    assert 0.0 < rows.row_error[0] <= 1e-3
    assert rows.memory_bytes >= 2 * 16 * (HIGHEST + 1) * len(rows.edges)


def test_the_solver_thread_covers_the_usual_loads_and_ends() -> None:
    rows = rows_of(1e-2)
    rows.cover(0.3, 0.3, COARSE)
    solver = RowSolver(rows)
    hand = solver.follow(0.3)
    try:
        assert solver.wait(60)
        assert solver.usual_range_ready
        assert rows.edges[0] <= HAND_LOADS[0] and rows.edges[-1] >= HAND_LOADS[1]
    finally:
        hand.leave()
    assert not [thread for thread in threading.enumerate() if thread.name == "ridgewave-rows"]


def test_the_solver_thread_follows_the_hand() -> None:
    rows = rows_of(1e-2, 4)
    rows.cover(0.3, 0.3, COARSE)
    arrived = threading.Event()
    cover = rows.cover

    def watched(low: float, high: float, finest: float, *stop: object) -> None:
        cover(low, high, finest, *stop)  # type: ignore[arg-type]
        if rows.edges[-1] >= 9.0:
            arrived.set()

    rows.cover = watched  # type: ignore[method-assign, assignment]
    solver = RowSolver(rows)
    hand = solver.follow(0.3)
    try:
        assert solver.wait(60)
        hand.now_at(9.0)
        assert arrived.wait(60)
    finally:
        hand.leave()


def test_rows_are_made_fine_only_where_the_load_is() -> None:
    rows = rows_of(1e-7)
    rows.cover(0.3, 0.3, COARSE)
    coarse = rows.edges
    rows.cover(0.3, 0.3, FINEST)
    place = int(np.searchsorted(coarse, 0.3, side="right")) - 1
    added = np.setdiff1d(rows.edges, coarse)
    assert added.size > 0
    assert coarse[place] < added.min() and added.max() < coarse[place + 1]


def test_where_rows_are_fine_the_error_told_is_that_of_the_acceleration() -> None:
    highest, orders = 60, (2,)
    rows = Rows(contact_of(scene_of()), Demand(highest, orders, 5e-4), highest, 0.3, 3e-4)
    rows.cover(0.3, 0.32, FINEST)
    told = rows.errors[0] + rows.row_error[0]
    assert 0.0 < rows.errors[0] <= 3e-4
    random = np.random.default_rng(5)
    worst = 0.0
    for load in random.uniform(0.3, 0.32, 12):
        place = rows.interval_of(float(load))
        low, high = rows.edges[place], rows.edges[place + 1]
        s = (load - low) / (high - low)
        a, b, c, d = rows.cubic(low, high, highest)
        truth = solve_spectrum(rows.contact, float(load), Demand(highest, orders, 1e-5)).harmonics
        apart = curves(a + s * (b + s * (c + s * d)) - truth, 2, points_for(highest))
        worst = max(worst, float(np.max(np.abs(apart)) / np.ptp(curves(truth, 2, points_for(highest)))))
    assert 0.05 * told <= worst <= 1.5 * told


def test_the_solver_thread_rests_when_the_hand_does() -> None:
    rows = rows_of(1e-3, 4)
    rows.cover(0.3, 0.3, COARSE)
    solver = RowSolver(rows)
    hand = solver.follow(0.3)
    try:
        assert solver.wait(60)
        hand.now_at(3.0)  # beyond the usual loads
        assert not solver.resting
        until = time.monotonic() + 60
        while not solver.resting and time.monotonic() < until:
            hand.now_at(3.002)  # close by: no new work
            time.sleep(0.01)
        assert solver.resting
        assert hand.fine[0] <= 3.0 <= hand.fine[1]
    finally:
        hand.leave()


def test_a_load_next_to_the_end_of_an_octave_lies_in_the_octave_that_holds_it() -> None:
    """A recording that came to 0.3 N less 1e-14 waited for ever for rows that began at 0.3 N."""
    rows = rows_of()
    for number in range(1, 13):
        low, high = rows.bounds(number)
        assert [rows.octave(load) for load in (low, np.nextafter(high, 0.0), high)] == [number, number, number + 1]
    low = float(np.nextafter(rows.bounds(5)[0], 0.0))
    rows.cover(low, low, COARSE)
    assert rows.edges[0] <= low < rows.edges[-1]
