"""The one rule that turns floats into integers."""

from __future__ import annotations

from decimal import ROUND_HALF_EVEN, Decimal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from synth.encode.formats import SoundFormat, encode_all, quantise, stream_block

FLOATS = st.one_of(
    st.floats(width=32, allow_nan=False),
    st.floats(-1.5, 1.5, width=32),
    st.integers(-70000, 70000).map(lambda half_steps: half_steps / 65536),  # the ties at 16 bit
    st.sampled_from([0.0, -0.0, 1.0, -1.0, 1.401298464324817e-45, 0.9999999403953552, -1.0000001192092896]),
)


def twin(sample: float, bits: int) -> int:
    """Return the integer by exact decimal arithmetic."""
    steps = 2 ** (bits - 1)
    if np.isinf(sample):
        return int(steps - 1 if sample > 0 else -steps)
    rounded = int((Decimal(sample) * steps).to_integral_value(ROUND_HALF_EVEN))
    return int(max(-steps, min(steps - 1, rounded)))


@given(st.lists(FLOATS, min_size=1, max_size=20), st.sampled_from([16, 24]))
def test_the_rule_is_exact(samples: list[float], bits: int) -> None:
    block = np.array(samples, dtype=np.float32)[:, np.newaxis]
    assert quantise(block, bits)[:, 0].tolist() == [twin(float(sample), bits) for sample in block[:, 0]]


@given(st.lists(st.floats(-2, 2, width=32), min_size=1, max_size=50))
def test_stream_file_and_byte_order_hold_the_same_integers(samples: list[float]) -> None:
    block = np.array(samples, dtype=np.float32)[:, np.newaxis]
    little = stream_block(block, SoundFormat.WAV16)
    assert encode_all(block, SoundFormat.WAV16, 8000)[-len(little) :] == little
    big = stream_block(block, SoundFormat.L16)
    np.testing.assert_array_equal(np.frombuffer(little, "<i2"), np.frombuffer(big, ">i2"))
    packed = np.frombuffer(stream_block(block, SoundFormat.WAV24), np.uint8).reshape(-1, 3)
    wide = np.pad(packed, ((0, 0), (1, 0))).copy().view("<i4")[:, 0] >> 8
    np.testing.assert_array_equal(wide, quantise(block, 24)[:, 0])


def test_full_scale_and_beyond_clip() -> None:
    block = np.array([[1.0], [-1.0], [1.5], [-1.5], [np.inf], [3e38]], dtype=np.float32)
    assert quantise(block, 16)[:, 0].tolist() == [32767, -32768, 32767, -32768, 32767, 32767]
    assert quantise(block, 24)[:, 0].tolist() == [8388607, -8388608, 8388607, -8388608, 8388607, 8388607]


def test_the_input_is_left_alone() -> None:
    block = np.array([[0.3], [2.0]], dtype=np.float32)
    for sound_format in set(SoundFormat) - {SoundFormat.FLAC}:
        stream_block(block, sound_format)
    assert block.tolist() == np.array([[0.3], [2.0]], dtype=np.float32).tolist()


@pytest.mark.parametrize("sound_format", list(SoundFormat))
def test_nan_is_our_bug_in_every_format(sound_format: SoundFormat) -> None:
    with pytest.raises(AssertionError, match="NaN"):
        encode_all(np.array([[0.0], [np.nan]], dtype=np.float32), sound_format, 8000)
