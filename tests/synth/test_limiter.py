"""The safety limiter and the fades of a finite render."""

from __future__ import annotations

import numpy as np
import pytest

from synth.output import RELEASE_TIME, Block, Limiter, fade_envelope

RATE = 48000


def noise(frames: int, channels: int, loudness: float, seed: int = 0) -> Block:
    return (loudness * np.random.default_rng(seed).uniform(-1, 1, (frames, channels))).astype(np.float32)


def test_what_is_within_full_scale_passes_bit_for_bit() -> None:
    block = noise(5000, 2, 1.0)
    block[17, 0], block[18, 1] = 1.0, -1.0
    limiter = Limiter(2, RATE)
    assert np.array_equal(limiter.process(block.copy()).view(np.uint32), block.view(np.uint32))
    assert limiter.reduction_db == 0.0


@pytest.mark.parametrize("loudness", [1.0001, 3.0, 1e6, 1e30])
def test_nothing_ever_leaves_beyond_full_scale(loudness: float) -> None:
    block = noise(20_000, 3, loudness)
    block[:5000] *= np.float32(1e-3 / loudness)
    limited = Limiter(3, RATE).process(block.copy())
    assert np.max(np.abs(limited)) <= 1.0
    assert np.max(np.abs(limited)) > 0.999
    assert np.isfinite(limited).all()


def test_blocks_do_not_matter() -> None:
    block = noise(6000, 2, 2.5)
    whole = Limiter(2, RATE).process(block.copy())
    limiter, random, parts, done = Limiter(2, RATE), np.random.default_rng(1), [], 0
    while done < len(block):
        count = int(random.integers(0, 400))
        parts.append(limiter.process(block[done : done + count].copy()))
        done += count
    assert np.array_equal(np.concatenate(parts), whole)


def test_channels_are_turned_down_together() -> None:
    block = np.full((100, 2), 0.5, dtype=np.float32)
    block[40, 0] = 4.0
    limited = Limiter(2, RATE).process(block.copy())
    assert limited[40].tolist() == [1.0, 0.125]
    assert np.array_equal(limited[:40], block[:40])
    assert np.array_equal(limited[41:, 0], limited[41:, 1])


def test_the_gain_comes_back_over_the_release_time() -> None:
    block = np.full((RATE, 1), 0.5, dtype=np.float32)
    block[0] = 2.0
    limiter = Limiter(1, RATE)
    limited = limiter.process(block.copy())[:, 0]
    assert np.all(np.diff(limited[1:]) >= 0)
    after = round(RELEASE_TIME * RATE)
    assert limited[after] / 0.5 == pytest.approx(1 - 0.5 * np.exp(-1), rel=1e-3)
    assert limited[-1] == 0.5
    assert limiter.reduction_db == 0.0


def test_a_reduction_is_told_in_decibels() -> None:
    limiter = Limiter(1, RATE)
    limiter.process(np.array([[10.0]], dtype=np.float32))
    assert limiter.reduction_db == pytest.approx(20.0)


def test_a_block_of_other_channels_is_refused() -> None:
    with pytest.raises(ValueError, match="3 channels"):
        Limiter(2, RATE).process(noise(4, 3, 0.1))


def test_fades_rise_from_nothing_and_end_in_nothing() -> None:
    whole = fade_envelope(0, 1000, 1000, 100)
    assert whole[0] < 1e-3 and whole[-1] < 1e-3
    assert np.all(whole[100:900] == 1.0)
    assert np.array_equal(whole, whole[::-1])
    assert np.all(np.diff(whole[:100]) > 0)
    parts = [fade_envelope(first, 125, 1000, 100) for first in range(0, 1000, 125)]
    assert np.array_equal(np.concatenate(parts), whole)


AHEAD = 72


@pytest.mark.parametrize("loudness", [0.9, 1.5, 40.0])
def test_looking_ahead_delays_and_stays_within(loudness: float) -> None:
    block = noise(8000, 2, loudness)
    limited = Limiter(2, RATE, AHEAD).process(block)
    assert not limited[:AHEAD].any()
    assert np.max(np.abs(limited)) <= 1.0
    if loudness < 1.0:
        assert np.array_equal(limited[AHEAD:], block[:-AHEAD])


def test_looking_ahead_in_blocks_equals_one_block() -> None:
    block = noise(6000, 2, 2.5)
    block[2000:4000] *= np.float32(0.1)
    whole = Limiter(2, RATE, AHEAD).process(block)
    limiter, random, parts, done = Limiter(2, RATE, AHEAD), np.random.default_rng(2), [], 0
    while done < len(block):
        count = int(random.integers(0, 200))
        parts.append(limiter.process(block[done : done + count]))
        done += count
    assert np.array_equal(np.concatenate(parts), whole)


def test_looking_ahead_the_gain_comes_down_without_a_step() -> None:
    block = np.full((4000, 1), 0.5, dtype=np.float32)
    block[1000] = 5.0
    limited = Limiter(1, RATE, AHEAD).process(block)[AHEAD:, 0]
    around = np.delete(limited, 1000)
    assert limited[1000] == pytest.approx(1.0, abs=1e-6)
    assert np.max(np.abs(np.diff(around))) <= 1.1 * 0.5 * 0.8 / AHEAD
    assert np.array_equal(limited[: 1000 - AHEAD], block[: 1000 - AHEAD, 0])


def test_a_primed_limiter_is_not_late() -> None:
    block = noise(3000, 2, 0.9)
    limiter = Limiter(2, RATE, AHEAD)
    limiter.prime(block[:AHEAD])
    assert np.array_equal(limiter.process(block[AHEAD:]), block[:-AHEAD])
