"""The sample formats that sound leaves in, and the one rule that turns floats into integers.

Stage: part of STAGE 4 (encode), pure.
Model: n = round_half_even(x * 2**(bits - 1)), clipped to [-2**(bits - 1), 2**(bits - 1) - 1]; no dither. So 1.0
    becomes 32767 (16 bit) or 8388607 (24 bit), -1.0 becomes -32768 or -8388608, and every file, stream and FLAC holds
    the same integers for the same samples. Dither is left out because it would put noise where the model says exact
    silence.
Limits: an integer sample is off by half a step at most inside [-1, 1 - step]: 1.5e-5 of full scale at 16 bit, 6e-8 at
    24 bit. Blocks are float32, for which x * 2**(bits - 1) is exact (a power of two), so rounding is the only error.
"""

from __future__ import annotations

from enum import StrEnum

import numpy as np
import numpy.typing as npt

Block = npt.NDArray[np.float32]


class SoundFormat(StrEnum):
    """A container with its sample type; the value is the `format` word of the HTTP calls."""

    WAV = "wav"  # WAV, float32 little-endian: what a render holds, unrounded
    WAV16 = "wav16"  # WAV, 16 bit integers
    WAV24 = "wav24"  # WAV, 24 bit integers
    FLAC = "flac"  # FLAC, 24 bit integers, the same ones as WAV24
    L16 = "l16"  # no container, 16 bit integers big-endian (RFC 3551 audio/L16)
    F32LE = "f32le"  # no container, float32 little-endian

    @property
    def container(self) -> str:
        """Return "wav", "flac" or "raw"."""
        if self in (SoundFormat.L16, SoundFormat.F32LE):
            return "raw"
        return "flac" if self is SoundFormat.FLAC else "wav"

    @property
    def bits(self) -> int:
        """Return the bits of one sample: 16, 24 or 32."""
        if self in (SoundFormat.WAV, SoundFormat.F32LE):
            return 32
        return 16 if self in (SoundFormat.WAV16, SoundFormat.L16) else 24

    @property
    def is_float(self) -> bool:
        """Return whether samples stay float32 (no clipping, no rounding)."""
        return self.bits == 32

    @property
    def bytes_per_sample(self) -> int:
        """Return the bytes of one sample of one channel (before compression, for FLAC)."""
        return self.bits // 8


def quantise(block: Block, bits: int) -> npt.NDArray[np.int32]:
    """Return `block` [frames, channels] as integers of `bits` (16 or 24) by the rule of this module, as int32.

    Beyond full scale it clips; infinities are clipped too. NaN is our bug: an AssertionError.
    """
    assert block.dtype == np.float32, f"blocks are float32, not {block.dtype}"
    assert not np.isnan(block).any(), "a voice let NaN out"
    steps = np.float32(2 ** (bits - 1))
    with np.errstate(over="ignore"):  # a float near the largest overflows to infinity, which clips as it should
        scaled = np.multiply(block, steps)
    np.rint(scaled, out=scaled)
    np.clip(scaled, -steps, steps - np.float32(1), out=scaled)
    return scaled.astype(np.int32)


def block_bytes(block: Block, sound_format: SoundFormat) -> bytes:
    """Return the interleaved samples of `block` [frames, channels] as they stand in a WAV `data` chunk or a raw stream.

    FLAC is not a sequence of independent blocks and has no such bytes: an AssertionError.
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
    return integers.astype(">i2" if sound_format is SoundFormat.L16 else "<i2").tobytes()
