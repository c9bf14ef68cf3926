"""The safety limiter: its output, when it changes nothing, how its gain moves, and its reports."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from synth.arrays import Block
from synth.voice.limiter import LOOK_AHEAD, RELEASE_TIME, Limiter, look_ahead
from tests.reference import slow_limiter

RATE = 48000
AHEAD = look_ahead(RATE)
RECOVERED = round(4.7 * RELEASE_TIME * RATE)  # frames until the gain is 1 again, as stated in the module
DENORMAL = 2.0**-126
PROBE = 2.0**-20  # level of a quiet channel that shows the gain of the others

Wave = npt.NDArray[np.float64]


def noise(frames: int, channels: int, loudness: float, seed: int = 0) -> Block:
    return (loudness * np.random.default_rng(seed).uniform(-1, 1, (frames, channels))).astype(np.float32)


def gain_over(sound: Wave, ahead: int = AHEAD) -> Wave:
    """Return the gain that each frame of `sound` [frames] leaves with, to the 24 bits of a float32."""
    both = np.stack([np.append(sound, np.zeros(ahead)), np.full(len(sound) + ahead, PROBE)], axis=1)
    given_out = Limiter(2, RATE, ahead).process(both.astype(np.float32))[ahead:]
    return given_out[:, 1].astype(float) / PROBE


@pytest.mark.parametrize("ahead", [0, 1, AHEAD])
def test_what_is_within_full_scale_passes_bit_for_bit(ahead: int) -> None:
    block = noise(5000, 2, 1.0)
    block[17, 0], block[18, 1], block[19, 0] = 1.0, -1.0, DENORMAL
    limiter = Limiter(2, RATE, ahead)
    passed = limiter.process(block)
    assert np.array_equal(passed[ahead:].view(np.uint32), block[: len(block) - ahead].view(np.uint32))
    assert not passed[:ahead].any()
    assert limiter.take_reduction() == 0.0


@pytest.mark.parametrize("ahead", [0, AHEAD])
def test_after_a_peak_the_sound_is_bit_exact_again_in_the_stated_time(ahead: int) -> None:
    block = noise(RATE, 2, 0.9)
    block[5000, 1] = 1e6
    limiter = Limiter(2, RATE, ahead)
    passed = limiter.process(block)[ahead:]
    changed = np.flatnonzero((passed != block[: len(passed)]).any(axis=1))
    assert 5000 - ahead <= changed[0] <= 5000
    assert 0.8 * RECOVERED < changed[-1] - 5000 < RECOVERED + ahead
    limiter.take_reduction()
    limiter.process(block[:1])
    assert limiter.take_reduction() == 0.0


@pytest.mark.parametrize("ahead", [0, AHEAD])
@pytest.mark.parametrize("loudness", [1.0001, 3.0, 1e6, 1e30])
def test_nothing_ever_leaves_beyond_full_scale(loudness: float, ahead: int) -> None:
    block = noise(20_000, 3, loudness)
    block[:5000] *= np.float32(1e-3 / loudness)
    limited = Limiter(3, RATE, ahead).process(block)
    assert 0.999 < np.max(np.abs(limited)) <= 1.0


SAMPLES = st.one_of(
    st.floats(-1, 1, width=32),
    st.floats(width=32),
    st.sampled_from([0.0, 1.0, -1.0, float(np.nextafter(np.float32(1), np.float32(2))), np.inf, np.nan, 1e-40, 3e38]),
)


@settings(max_examples=150)
@given(
    samples=st.lists(SAMPLES, min_size=1, max_size=90),
    channels=st.integers(1, 3),
    ahead=st.integers(0, 12),
    rate=st.sampled_from([1000, RATE, 192_000]),
    lengths=st.lists(st.integers(0, 30), max_size=8),
)
def test_it_is_its_slow_twin_however_the_blocks_are_cut(
    samples: list[float], channels: int, ahead: int, rate: int, lengths: list[int]
) -> None:
    block = np.resize(np.array(samples, dtype=np.float32), (len(samples), channels))
    wanted, gains = slow_limiter.limited(block, rate, ahead)
    limiter, done, parts = Limiter(channels, rate, ahead), 0, []
    for length in [*lengths, len(block)]:
        parts.append(limiter.process(block[done : done + length]))
        done += length
    whole = np.concatenate(parts)
    assert np.array_equal(whole, wanted)
    assert np.isfinite(whole).all() and np.max(np.abs(whole)) <= 1.0
    assert not ((whole != 0) & (np.abs(whole) < DENORMAL)).any(), "a denormal left"
    assert limiter.frames_not_finite == np.count_nonzero(~np.isfinite(block).all(axis=1))
    assert limiter.take_reduction() == pytest.approx(-20.0 * np.log10(min(gains)), rel=1e-9, abs=1e-12)


def test_a_block_may_be_limited_in_its_place() -> None:
    block = noise(3000, 2, 2.5)
    block[800:] *= np.float32(0.3)
    wanted = Limiter(2, RATE, AHEAD).process(block)
    limiter = Limiter(2, RATE, AHEAD)
    for first in range(0, 3000, 500):
        here = block[first : first + 500].copy()
        limiter.process_into(here, here)
        assert np.array_equal(here, wanted[first : first + 500])


def test_channels_are_turned_down_together() -> None:
    block = np.full((400, 2), 0.5, dtype=np.float32)
    block[140, 0] = 4.0
    limited = Limiter(2, RATE, AHEAD).process(block)[AHEAD:]
    assert limited[140].tolist() == [1.0, 0.125]
    others = np.delete(limited, 140, axis=0)
    assert np.array_equal(others[:, 0], others[:, 1])


def peaks(*at: int, height: float = 10.0, frames: int = 3 * AHEAD) -> Wave:
    sound = np.zeros(frames)
    sound[list(at)] = height
    return sound


CURVES: dict[str, Wave] = {
    "ten times": peaks(100),
    "at frame 0": peaks(0),
    "a train": peaks(*range(100, 20_000, 480), frames=24_000),
    "closer than the look-ahead": np.maximum(peaks(100, height=2.0), peaks(130, 131, height=30.0)),
    "higher and higher": np.linspace(0.0, 50.0, 4000),
    "a tone": 4.0 * np.sin(np.arange(20_000) / 80.0),
    "what is not finite": peaks(100, height=np.nan),
    "noise": 10.0 * np.random.default_rng(5).uniform(-1, 1, 20_000) ** 9,
}


@pytest.mark.parametrize("name", CURVES)
def test_the_gain_has_no_step_and_no_corner(name: str) -> None:
    """Two averages of n frames bound the gain's change to 1 / n per frame, and the change of that to 2 / n^2."""
    gain = gain_over(CURVES[name])
    frames, rounding = AHEAD // 2 + 1, 2.0**-23
    assert np.max(np.abs(np.diff(gain))) <= 1.0 / frames + rounding
    assert np.max(np.abs(np.diff(gain, 2))) <= 2.0 / frames**2 + 2 * rounding
    assert np.max(np.abs(np.nan_to_num(CURVES[name]) * gain)) <= 1.0 + 1e-6, "this gain is not what holds the sound"


def test_a_peak_is_approached_evenly_and_reaches_full_scale() -> None:
    gain = gain_over(peaks(500, height=5.0, frames=2000))
    assert np.all(gain[: 500 - AHEAD] == 1.0)
    down = gain[500 - AHEAD - 1 : 501]
    assert np.all(np.diff(down) <= 0) and down[-1] == pytest.approx(0.2, abs=1e-6)
    assert np.all(np.diff(gain[501:]) >= 0)
    assert np.argmin(np.diff(down)) == pytest.approx(AHEAD / 2, abs=1.5)


def test_without_look_ahead_the_gain_falls_at_once_and_comes_back_over_the_release_time() -> None:
    gain = gain_over(peaks(1000, height=2.0, frames=RATE), ahead=0)
    assert np.all(gain[:1000] == 1.0) and gain[1000] == 0.5
    after = 1000 + round(RELEASE_TIME * RATE)
    assert gain[after] == pytest.approx(1.01 - 0.51 * np.exp(-1), rel=1e-3)
    assert gain[-1] == 1.0


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("ahead", [0, AHEAD])
def test_what_is_not_finite_leaves_as_silence_and_is_counted(bad: float, ahead: int) -> None:
    block = noise(RATE, 2, 0.9)
    block[1000, 1] = bad
    limiter = Limiter(2, RATE, ahead)
    limited = limiter.process(block)[ahead:]
    assert np.isfinite(limited).all()
    assert np.max(np.abs(limited[1000])) < 1e-9
    assert np.array_equal(limited[1000 + RECOVERED + ahead :], block[1000 + RECOVERED + ahead : len(limited)])
    assert limiter.frames_not_finite == 1


def test_the_largest_reduction_is_told_once() -> None:
    limiter = Limiter(1, RATE, AHEAD)
    limiter.process(np.array([[10.0]] + [[0.1]] * (20 * AHEAD), dtype=np.float32))
    assert limiter.take_reduction() == pytest.approx(20.0)
    assert limiter.take_reduction() == 0.0
    limiter.process(noise(1, 1, 0.1))
    assert 0.0 < limiter.take_reduction() < 15.0, "it does not come back"


def test_blocks_that_do_not_fit_are_refused() -> None:
    limiter = Limiter(2, RATE)
    with pytest.raises(ValueError, match="3 channels"):
        limiter.process(noise(4, 3, 0.1))
    with pytest.raises(ValueError, match="and be contiguous"):
        limiter.process_into(noise(4, 2, 0.1), noise(5, 2, 0.1))
    with pytest.raises(ValueError, match="and be contiguous"):
        limiter.process_into(noise(4, 2, 0.1), noise(8, 2, 0.1)[::2])


def test_a_primed_limiter_is_not_late_and_knows_of_a_peak_at_its_first_frame() -> None:
    block = noise(3000, 2, 0.9)
    block[0] = block[2 * AHEAD] = 8.0
    late, limiter = Limiter(2, RATE, AHEAD), Limiter(2, RATE, AHEAD)
    limiter.process(block[:AHEAD])
    limited = limiter.process(block[AHEAD:])
    assert np.array_equal(limited, late.process(block)[AHEAD:])
    assert limited[0].tolist() == [1.0, 1.0]


@pytest.mark.parametrize("lengths", [(3000,), (1, 2, 3, 2994), (AHEAD, 3000 - AHEAD), (10,), ()])
def test_a_finite_sound_keeps_its_length_and_is_not_late(lengths: tuple[int, ...]) -> None:
    block = noise(sum(lengths), 2, 2.0)
    parts = np.split(block, np.cumsum(lengths)[:-1]) if lengths else []
    limited = np.concatenate([block[:0], *Limiter(2, RATE, AHEAD).limited(parts)])
    padded = np.concatenate([block, np.zeros((AHEAD, 2), dtype=np.float32)])
    assert np.array_equal(limited, Limiter(2, RATE, AHEAD).process(padded)[AHEAD:])


def test_a_finite_sound_with_what_is_not_finite_is_our_bug() -> None:
    block = noise(200, 1, 0.5)
    block[100] = np.nan
    with pytest.raises(AssertionError, match="a voice rendered NaN"):
        list(Limiter(1, RATE, AHEAD).limited([block]))


def test_a_finite_sound_comes_in_no_empty_blocks() -> None:
    parts = [noise(1, 1, 0.5)] * 200
    assert all(len(part) for part in Limiter(1, RATE, AHEAD).limited(parts))


def test_the_look_ahead_is_the_same_time_at_every_rate() -> None:
    assert [look_ahead(rate) for rate in (1000, 8000, RATE, 192_000)] == [2, 12, 72, 288]
    assert LOOK_AHEAD < 0.02, "a stop is to be silent within 20 ms"
