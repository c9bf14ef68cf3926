"""The compiled loop and its readable twin read a table alike, in any blocks, along any motion."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from synth.contact.scene_contact import contact_of
from synth.response.mip_levels import WIDTH, MipLevels
from synth.response.phases import turns_to_phase
from synth.response.reading_filter import reading_filter
from synth.response.table import ResponseTable
from synth.response.table_reader import TableReader
from tests.reference import slow_table_reading as slow
from tests.synth.engine_cases import Real, scene_of
from tests.synth.response.table_study import table_of

RATE = 48000
QUANTITIES = ("displacement", "velocity", "acceleration", "approach")
Moves = tuple[Real, Real]  # places (m), motion


@cache
def table() -> ResponseTable:
    """Return the table of the default scene."""
    return table_of(scene_of())


def moves(speed: Real | float, load: Real | float, frames: int, start: float = 0.0) -> Moves:
    """Return the places and the motion of a speed (m/s) and a load (N), numbers or [frames], on the default texture."""
    motion = np.zeros((5, frames))
    motion[0], motion[2] = speed, load
    places = start + np.concatenate([[0.0], np.cumsum(0.5 * (motion[0, 1:] + motion[0, :-1]))]) / RATE
    return places, motion


def wild(frames: int) -> Moves:
    """Return a motion that turns, crosses the levels, lifts, and reaches full contact."""
    t = np.arange(frames) / RATE
    speed = 0.08 + 0.3 * np.sin(2 * np.pi * 30 * t)
    load = np.abs(1.5 + 4.5 * np.sin(2 * np.pi * 20 * t)) + 0.02 * np.sin(2 * np.pi * 400 * t) - 0.01
    return moves(speed, load, frames)


def read(quantity: str, moved: Moves, rate: int = RATE, table_of_it: ResponseTable | None = None) -> Real:
    """Return the quantity of a whole motion in one block, with the reader's delay."""
    reader = TableReader.of(table_of_it or table(), quantity, rate)
    places, motion = moved
    out = np.empty((len(places), 1), np.float32)
    reader.read(reader.start(), motion, places, 0, out, 0)
    return out[:, 0].astype(float)


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_the_loop_reads_what_its_twin_reads(quantity: str) -> None:
    places, motion = wild(1500)
    reader = TableReader.of(table(), quantity, RATE)
    twin = slow.read(
        table().header,
        table().tensors,
        quantity,
        turns_to_phase(places / table().period),
        motion,
        reader.filter.weights,
        reader.filter.hold,
    )
    assert np.max(np.abs(read(quantity, (places, motion)) - twin)) <= 1e-7 * np.max(np.abs(twin))


@pytest.mark.parametrize("load", [0.0, 0.3, 40.0])
def test_a_finger_that_stands_still_is_exact_silence(load: float) -> None:
    stood = moves(0.0, load, 400, start=1.234e-3)
    assert not np.any(read("velocity", stood))
    assert not np.any(read("acceleration", stood))
    displacement = read("displacement", stood)
    assert np.all(displacement == displacement[0])
    assert (displacement[0] == 0.0) == (load == 0.0)


def test_no_load_is_exact_silence_and_a_landing_begins_smoothly() -> None:
    frames = 4800
    load = 0.3 * np.linspace(0.0, 1.0, frames) ** 2
    load[: frames // 4] = 0.0
    moved = moves(0.08, load, frames)
    for quantity in QUANTITIES:
        assert not np.any(read(quantity, moved)[: frames // 4])


@pytest.mark.parametrize("speed", [0.75, 1.2, 10.0, -10.0, 0.0008 * RATE])
def test_what_is_too_fast_for_the_band_is_silent(speed: float) -> None:
    frames = 2000
    moved = moves(speed, 0.3, frames)
    found = read("acceleration", moved)
    turns = abs(speed) / (table().period * table().band)
    assert np.any(found[100:]) == (turns < 1.4)
    assert np.all(np.isfinite(found))


def test_a_motion_that_is_no_number_is_silent_and_passes() -> None:
    places, motion = moves(0.08, 0.3, 2000)
    motion[2, 500:600] = np.nan
    found = read("acceleration", (places, motion))
    assert np.all(np.isfinite(found))
    assert np.array_equal(found[700:], read("acceleration", moves(0.08, 0.3, 2000))[700:])


def test_a_changing_load_counts_with_all_of_its_terms() -> None:
    """Against differences of the exact approach along the motion, where only few harmonics sound."""
    scene, frames = scene_of(), 1200
    t = np.arange(frames) / RATE
    load = 0.3 + 0.1 * np.sin(2 * np.pi * 25.0 * t)
    speed = np.full(frames, 0.32)
    places, motion = moves(speed, load, frames)
    contact, series, known = contact_of(scene), np.arange(128) / 128, np.linspace(0.2, 0.4, 101)
    solved = np.array([np.fft.rfft(contact.approach(series, float(one))[0]) / 128 for one in known])
    harmonics = CubicSpline(known, solved)(load)
    highest = 2  # at 0.32 m/s the fundamental is at 400 Hz
    turns = 2.0 * np.pi * np.arange(1, highest + 1) * (np.cumsum(speed) - speed[0])[:, np.newaxis] / RATE / 0.0008
    z = 2.0 * np.real(np.sum(harmonics[:, 1 : highest + 1] * np.exp(1j * turns), axis=1))
    delay = TableReader.of(table(), "acceleration", RATE).delay
    exact = (z[2:] - 2.0 * z[1:-1] + z[:-2]) * RATE**2  # off by (2 pi 800 / 48000)^2 / 12: 9e-4
    found = read("acceleration", (places, motion))[delay + 1 :]
    middle = slice(200, 1000)
    assert np.max(np.abs(found[middle] - exact[middle])) <= 3e-3 * np.ptp(exact[middle])


def test_beyond_full_contact_the_approach_is_the_closed_form() -> None:
    contact = contact_of(scene_of())
    for load in (6.0, 100.0, 1000.0):
        places, motion = moves(0.0, load, 40, start=3.1e-4)
        exact = contact.approach(np.array([3.1e-4 / table().period]), load)[0][0]
        assert read("approach", (places, motion))[-1] == pytest.approx(exact, rel=2e-6)


@pytest.mark.parametrize("rate", [8000, 44100, 48000, 96000, 192000])
@pytest.mark.parametrize("quantity", QUANTITIES)
def test_a_filter_errs_little_and_looks_ahead_a_third_of_a_millisecond(quantity: str, rate: int) -> None:
    found = reading_filter(quantity, rate, 1000.0)
    assert found.error <= 5e-4
    assert found.delay / rate <= 0.51e-3
    assert rate / found.stride >= 8000


@pytest.mark.parametrize("harmonics", [1, 2, 3, 10, 64, 200])
def test_gains_of_levels_are_one_in_the_band_and_zero_above_it(harmonics: int) -> None:
    levels = MipLevels.up_to(harmonics)
    n = np.arange(1, harmonics + 1)
    for turns in np.geomspace(1e-3, 3.0, 300):
        gains = levels.gains(float(turns))
        assert np.all(gains[n * turns <= 1.0] == pytest.approx(1.0))
        assert np.all(gains[n * turns >= WIDTH] == 0.0)
        assert np.all((gains >= 0.0) & (gains <= 1.0 + 1e-12))
        assert np.count_nonzero(levels.shares(float(turns))) <= 2
