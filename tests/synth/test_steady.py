"""Reading a steady scan: tables and sums of harmonics give the series, in any blocks, without denormals."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from synth.response.phase_cells import CUBIC, LINEAR, polynomials
from synth.response.steady import SteadyHarmonics, SteadyReader, SteadyTable
from tests.reference import slow_reading

PHASE, STEP, FRAMES = 0xFEDCBA9876543210, 0x0123456789ABCDEF, 3000


def series(count: int) -> np.ndarray:
    """Return a series whose harmonics fall as those of a kink do."""
    random = np.random.default_rng(count)
    n = np.arange(1, count + 1)
    return np.concatenate([[0.0], n**-2.5 * np.exp(2j * np.pi * random.random(count))])


def phases(frames: int) -> np.ndarray:
    """Return the phases of the frames in turns, from exact integers."""
    return np.array([(PHASE + frame * STEP) % 2**64 / 2**64 for frame in range(frames)])


def summed(harmonics: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """Return the series at `theta`, term by term."""
    angles = 2.0 * np.pi * np.outer(theta, np.arange(len(harmonics)))
    return np.asarray(2.0 * (np.cos(angles) @ harmonics.real - np.sin(angles) @ harmonics.imag))


def read(reader: SteadyReader, frames: int, gain: float = 1.0) -> np.ndarray:
    out = np.full((frames, 2), np.nan, dtype=np.float32)
    reader.read(PHASE, STEP, gain, out, 1)
    assert np.isnan(out[:, 0]).all()
    return out[:, 1]


@pytest.mark.parametrize("degree", [LINEAR, CUBIC])
def test_a_table_equals_its_twin(degree: int) -> None:
    table = polynomials(series(9), degree, 64)
    wanted = 0.5 * slow_reading.steady(np.pad(table, ((0, 0), (0, 4 - table.shape[1]))), PHASE, STEP, FRAMES)
    assert np.max(np.abs(read(SteadyTable(table), FRAMES, 0.5) - wanted)) <= 1e-7 * np.max(np.abs(wanted))


@pytest.mark.parametrize("count", [1, 2, 3, 17, 512])
def test_a_sum_of_harmonics_is_the_series(count: int) -> None:
    harmonics = series(count)
    wanted = summed(harmonics, phases(FRAMES))
    assert np.max(np.abs(read(SteadyHarmonics(harmonics), FRAMES) - wanted)) <= 7e-8 * np.max(np.abs(wanted))


@pytest.mark.parametrize("turn", range(8))
def test_a_harmonic_is_a_cosine_at_every_eighth_of_a_turn(turn: int) -> None:
    """Quarter turns are exact; the eighths between are where the polynomials change over."""
    near = [turn * 2**61 + shift for shift in (-(2**40), -1, 0, 1, 2**40)]
    reader = SteadyHarmonics(np.array([0.0, 0.5 - 0.5j]))
    for phase in near:
        out = np.empty((1, 1), np.float32)
        reader.read(phase % 2**64, 0, 1.0, out, 0)
        angle = 2.0 * np.pi * (phase / 2**64)
        assert out[0, 0] == pytest.approx(np.cos(angle) + np.sin(angle), abs=1e-7)


@pytest.mark.parametrize("degree", [1, 3, 5])
def test_each_degree_converges_at_its_order(degree: int) -> None:
    """The errors of tables of twice the cells stand as 2^(degree + 1)."""
    harmonics = np.array([0.0, 0.3 + 0.1j, -0.2j, 0.05])
    theta = (np.arange(4096) + 0.5) / 4096
    errors = []
    for cells in (32, 64):
        table = polynomials(harmonics, degree, cells)
        cell = np.floor(theta * cells).astype(int)
        place = theta * cells - cell
        value = sum(table[cell, power] * place**power for power in range(degree + 1))
        errors.append(np.max(np.abs(value - summed(harmonics, theta))))
    assert errors[0] / errors[1] == pytest.approx(2.0 ** (degree + 1), rel=0.1)


READERS = [
    SteadyTable(polynomials(series(9), CUBIC, 64)),
    SteadyTable(polynomials(series(9), LINEAR, 64)),
    SteadyHarmonics(series(9)),
]


@pytest.mark.parametrize("reader", READERS, ids=lambda reader: reader.name)
def test_blocks_do_not_matter(reader: SteadyReader) -> None:
    whole = read(reader, FRAMES)
    cuts = [0, 1, 2, 66, 67, 547, 2000, FRAMES]
    for a, b in itertools.pairwise(cuts):
        out = np.empty((b - a, 1), np.float32)
        reader.read((PHASE + a * STEP) % 2**64, STEP, 1.0, out, 0)
        assert np.array_equal(out[:, 0], whole[a:b])


@pytest.mark.parametrize("reader", READERS, ids=lambda reader: reader.name)
def test_what_would_be_denormal_leaves_as_zero(reader: SteadyReader) -> None:
    quiet = read(reader, FRAMES, 1e-38)
    size = np.abs(quiet)
    assert not ((size > 0.0) & (size < 1.17e-38)).any()
    assert (size == 0.0).any() and (size > 0.0).any()
