"""The curve of a series equals the series at any place and along any steady scan, in any blocks, without denormals."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest

from synth.response.series_curve import SeriesCurve
from tests.synth.engine_cases import Real

PHASE, STEP, FRAMES = 0xFEDCBA9876543210, 0x0123456789ABCDEF, 3000
ROUNDING = 6e-8  # of the largest value: half a unit of float32


def series(count: int, fall: float = 2.5, mean: float = 0.0) -> Any:
    """Return a series whose harmonics fall as those of a contact: as n^-2.5, its acceleration as n^-0.5."""
    n = np.arange(1, count + 1)
    return np.concatenate([[mean], n**-fall * np.exp(2j * np.pi * np.random.default_rng(count).random(count))])


def summed(harmonics: Any, theta: Real, order: int = 0) -> Real:
    """Return the `order`-th derivative over theta of the series without its mean, term by term."""
    n = np.arange(1, len(harmonics))
    terms = harmonics[1:] * (2j * np.pi * n) ** order
    return np.asarray(2.0 * (np.exp(2j * np.pi * np.outer(theta, n)) @ terms).real)


def read(curve: SeriesCurve, frames: int, gain: float = 1.0) -> Real:
    out = np.full((frames, 2), np.nan, dtype=np.float32)
    curve.read(PHASE, STEP, gain, out, 1)
    assert np.isnan(out[:, 0]).all()
    return out[:, 1].astype(float)


@pytest.mark.parametrize("fall", [2.5, 0.5])
@pytest.mark.parametrize("count", [1, 2, 3, 8, 17, 512, 4096])
def test_what_is_read_is_the_series_to_float32(count: int, fall: float) -> None:
    harmonics = series(count, fall)
    every = max(1, count // 256)  # of the frames, since each takes a sum over all harmonics
    theta = np.array([(PHASE + frame * STEP) % 2**64 / 2**64 for frame in range(0, FRAMES, every)])
    wanted = summed(harmonics, theta)
    found = read(SeriesCurve(harmonics), FRAMES)[::every]
    assert np.max(np.abs(found - wanted)) <= 1.1 * ROUNDING * np.max(np.abs(wanted))


@pytest.mark.parametrize("count", [1, 8, 64])
def test_the_last_harmonic_errs_by_no_more_than_what_is_told(count: int) -> None:
    """The last harmonic alone, at the fewest cells per harmonic: 1.4e-8 of itself."""
    harmonics = np.zeros(count + 1, complex)
    harmonics[count] = 0.3 - 0.4j
    theta = np.random.default_rng(1).random(3000)
    error = np.max(np.abs(SeriesCurve(harmonics).heights(theta, theta) - summed(harmonics, theta)))
    assert error <= 1.5e-8 and (count == 1 or error >= 1e-9)


def test_any_place_is_read_with_the_mean() -> None:
    harmonics = series(40, mean=-3e-3)
    theta = np.random.default_rng(6).uniform(-3.0, 3.0, 500)
    wanted = -3e-3 + summed(harmonics, theta)
    assert np.max(np.abs(SeriesCurve(harmonics).heights(theta, np.ones(500)) - wanted)) <= 1e-8 * np.ptp(wanted)


def test_harmonics_that_are_zero_take_no_memory() -> None:
    padded = np.concatenate([series(9), np.zeros(4000)])
    assert SeriesCurve(padded).nbytes == SeriesCurve(series(9)).nbytes
    still = SeriesCurve(np.zeros(5, complex))
    assert still.name == "series of 0 harmonics" and not read(still, 10).any()


def test_blocks_do_not_matter() -> None:
    curve = SeriesCurve(series(9))
    whole = read(curve, FRAMES)
    for a, b in itertools.pairwise([0, 1, 2, 66, 67, 547, 2000, FRAMES]):
        out = np.empty((b - a, 1), np.float32)
        curve.read((PHASE + a * STEP) % 2**64, STEP, 1.0, out, 0)
        assert np.array_equal(out[:, 0], whole[a:b])


def test_what_would_be_denormal_leaves_as_zero() -> None:
    size = np.abs(read(SeriesCurve(series(9)), FRAMES, 1e-38))
    assert not ((size > 0.0) & (size < 1.17e-38)).any()
    assert (size == 0.0).any() and (size > 0.0).any()
