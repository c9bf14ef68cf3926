"""Write FLAC block by block, with libsndfile, to a stream that can seek.

Stage: part of STAGE 4 (encode). libsndfile is loaded when the first FLAC is written.
Model: samples are 24 bit integers by the rule of `synth.encode.samples`. A FLAC therefore decodes to the integers of
    the 24 bit WAV. 24 bits are better than 16, because a render can be quiet for long (light touch, lifted finger).
    They cost little, because FLAC uses no bits for leading zeros.
Limits: 8 channels. Rates above 65535 Hz must be multiples of 10, and 655350 Hz is the highest: the header of a frame
    holds no others (RFC 9639, 9.1.2 and 9.1.3). The target must be able to seek, because the header of the file has the
    number of frames.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable
from typing import BinaryIO

import numpy as np

from synth.encode.samples import Block, SoundFormat, quantise
from synth.encode.sound_metadata import FLAC_COMMENT_BYTES, Metadata
from synth.errors import CannotRender, Fault, InvalidRequest

MOST_CHANNELS = 8
HIGHEST_HZ = 65_535
HIGHEST_TENS_HZ = 655_350
NO_LIBRARY = "FLAC needs libsndfile. Run: pip install soundfile. If it brings no library: apt-get install libsndfile1."


class FlacEncoder:
    """Writes FLAC to `stream`. If the stream fails, `write` or `finish` raises the stream's own error."""

    def __init__(self, stream: BinaryIO, sample_rate: int, channels: int, metadata: Metadata | None) -> None:
        """Open the encoder.

        Raises InvalidRequest for a rate or a number of channels that FLAC cannot hold, and CannotRender if libsndfile
        is missing or refuses.
        """
        comment = "" if metadata is None else metadata.text().decode("ascii")
        check_flac(sample_rate, channels)
        if len(comment) > FLAC_COMMENT_BYTES:
            raise CannotRender(
                f"the scene is {len(comment)} bytes of JSON, and a FLAC file holds 16 MB at most. Write WAV."
            )
        try:
            import soundfile
        except (ImportError, OSError) as error:  # OSError: soundfile is installed, but libsndfile is missing
            raise CannotRender(NO_LIBRARY) from error
        self._keeper = _FaultKeeper(stream)
        try:
            self._file = soundfile.SoundFile(
                self._keeper, "w", samplerate=sample_rate, channels=channels, format="FLAC", subtype="PCM_24"
            )
        except soundfile.LibsndfileError as error:
            self._keeper.raise_fault()
            raise CannotRender(f"cannot write FLAC at {sample_rate} Hz: {error.error_string}") from error
        if metadata is not None:
            self._file.software = metadata.generator
            self._file.comment = comment

    def write(self, block: Block) -> None:
        """Encode `block` [frames, channels]."""
        if len(block):  # libsndfile keeps the upper 24 of 32 bits
            integers = np.left_shift(quantise(block, SoundFormat.FLAC.bits), 8)
            self._guarded(lambda: self._file.write(integers))

    def finish(self) -> None:
        """Write the frames that libFLAC has buffered, and the final header."""
        self._guarded(self._file.close)

    def discard(self) -> None:
        """Free libsndfile's memory after a failure. What it has not written yet is discarded."""
        self._keeper.fault = self._keeper.fault or CannotRender("the file is given up")
        with contextlib.suppress(RuntimeError):  # it may raise the same error again
            self._file.close()

    def _guarded(self, action: Callable[[], object]) -> None:
        """Run `action`. If the stream failed in it, raise the stream's own error instead of libsndfile's."""
        try:
            action()
        except (RuntimeError, AssertionError):  # libsndfile's "system error", or soundfile's count of the frames
            self._keeper.raise_fault()
            raise
        self._keeper.raise_fault()


class _FaultKeeper:
    """A stream for libsndfile's callbacks, which must not raise.

    The first exception is kept, and later calls do nothing. Position 0 is the initial position of `stream`.
    """

    def __init__(self, stream: BinaryIO) -> None:
        self._stream = stream
        self._start = stream.tell()
        self.fault: BaseException | None = None

    def write(self, samples: bytes) -> int:
        return self._kept(lambda: self._stream.write(samples))

    def seek(self, offset: int, whence: int = 0) -> int:
        from_start = self._start if whence == os.SEEK_SET else 0
        return self._kept(lambda: self._stream.seek(offset + from_start, whence) - self._start)

    def tell(self) -> int:
        return self._kept(lambda: self._stream.tell() - self._start)

    def raise_fault(self) -> None:
        """Raise the first exception, if there was one."""
        if self.fault is not None:
            raise self.fault

    def _kept(self, action: Callable[[], int]) -> int:
        if self.fault is None:
            try:
                return action()
            except BaseException as error:  # a KeyboardInterrupt must not get lost in C
                self.fault = error
        return 0


def check_flac(sample_rate: int, channels: int) -> None:
    """Raise InvalidRequest for a rate (Hz) or a number of channels that FLAC cannot hold."""
    faults = []
    if channels > MOST_CHANNELS:
        hint = "Write WAV, which allows more channels, or write fewer channels."
        faults.append(Fault("/output/channels", f"{channels} channels", f"1 to {MOST_CHANNELS} in FLAC", hint))
    if not holds_rate(sample_rate):
        allowed = f"in FLAC up to {HIGHEST_HZ} Hz, and multiples of 10 Hz up to {HIGHEST_TENS_HZ} Hz"
        nearest = min(max(round(sample_rate / 10) * 10, 1), HIGHEST_TENS_HZ)
        hint = f"Write WAV, which allows every rate, or {nearest} Hz."
        faults.append(Fault("/output/sample_rate", f"{sample_rate} Hz", allowed, hint))
    if faults:
        raise InvalidRequest(faults)


def holds_rate(sample_rate: int) -> bool:
    """Return whether FLAC can hold a rate, in Hz."""
    return 0 < sample_rate <= HIGHEST_HZ or (sample_rate % 10 == 0 and 0 < sample_rate <= HIGHEST_TENS_HZ)


def fits_flac(sample_rate: int, channels: int) -> bool:
    """Return whether FLAC can hold a rate (Hz) and a number of channels."""
    return holds_rate(sample_rate) and channels <= MOST_CHANNELS
