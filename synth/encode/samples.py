"""The sample formats, and the rule that converts floats to integers.

Stage: part of STAGE 4 (encode), pure.
Model: n = round_half_even(x * 2**(bits - 1)), clipped to [-2**(bits - 1), 2**(bits - 1) - 1], without dither. 1.0
    becomes 32767 (16 bit) or 8388607 (24 bit), and -1.0 becomes -32768 or -8388608. Every file and stream, FLAC
    included, has the same integers for the same samples. Dither would add noise where the model gives exact silence.
Limits: the error of an integer sample is at most half a step within [-1, 1 - step]: 1.5e-5 of full scale at 16 bit,
    6e-8 at 24 bit. Blocks are float32, for which x * 2**(bits - 1) is exact (a power of two), so rounding is the only
    error.
"""

from __future__ import annotations

from enum import StrEnum
from typing import Self

import numpy as np
import numpy.typing as npt

Block = npt.NDArray[np.float32]


class SoundFormat(StrEnum):
    """A container with its sample type. The value of a member is the `format` of the HTTP calls.

    container: "wav", "flac" or "raw".
    bits: bits of a sample of one channel, before compression.
    bytes_per_sample: bytes of a sample of one channel, before compression.
    is_float: whether samples are float32, without clipping and rounding.
    """

    container: str
    bits: int
    bytes_per_sample: int
    is_float: bool

    def __new__(cls, word: str, container: str = "", bits: int = 0) -> Self:
        """Make a member. Later calls look a member up by its word."""
        member = str.__new__(cls, word)
        member._value_ = word
        member.container, member.bits = container, bits
        member.bytes_per_sample, member.is_float = bits // 8, bits == 32
        return member

    WAV = "wav", "wav", 32  # WAV, float32 little-endian: the samples of a render, unrounded
    WAV16 = "wav16", "wav", 16  # WAV, integers
    WAV24 = "wav24", "wav", 24
    FLAC = "flac", "flac", 24  # FLAC, the integers of WAV24
    L16 = "l16", "raw", 16  # no container, integers big-endian (RFC 3551 audio/L16)
    F32LE = "f32le", "raw", 32  # no container, float32 little-endian


def quantise(block: Block, bits: int) -> npt.NDArray[np.int32]:
    """Return `block` [frames, channels] as integers of `bits` (16 or 24) bits, in int32, by the rule of this module.

    Samples beyond full scale are clipped, including infinities. NaN is a bug in ridgewave and raises AssertionError.
    """
    assert block.dtype == np.float32, f"blocks are float32, not {block.dtype}"
    assert not np.isnan(block).any(), "a voice let NaN out"
    steps = np.float32(2 ** (bits - 1))
    with np.errstate(over="ignore"):  # a float near the largest overflows to infinity, which is then clipped
        scaled = np.multiply(block, steps)
    np.rint(scaled, out=scaled)
    np.clip(scaled, -steps, steps - np.float32(1), out=scaled)
    return scaled.astype(np.int32)


def block_bytes(block: Block, sound_format: SoundFormat) -> bytes:
    """Return the interleaved samples of `block` [frames, channels] for a WAV `data` chunk or a raw stream.

    Raises AssertionError for FLAC, which is not a sequence of independent blocks, and for a format without a packing.
    """
    assert block.ndim == 2, f"a block is [frames, channels], not {block.ndim}-dimensional"
    if sound_format.is_float:
        assert block.dtype == np.float32, f"blocks are float32, not {block.dtype}"
        assert np.isfinite(block).all(), "a voice let NaN or infinity out"
        return block.astype("<f4", copy=False).tobytes()
    assert sound_format is not SoundFormat.FLAC, "FLAC is written through a writer"
    integers = quantise(block, sound_format.bits)
    if sound_format is SoundFormat.WAV24:
        little = integers.astype("<i4", copy=False)
        return little.view(np.uint8).reshape(-1, 4)[:, :3].tobytes()
    assert sound_format.bytes_per_sample == 2, f"{sound_format} has no packing here"
    return integers.astype(">i2" if sound_format is SoundFormat.L16 else "<i2").tobytes()
