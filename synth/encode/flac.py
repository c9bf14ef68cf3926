"""FLAC, through libsndfile, block after block, into anything that can seek.

Stage: part of STAGE 4 (encode). libsndfile is loaded when the first FLAC is written, not before.
Model: 24 bit integers by the rule of `synth.encode.samples`, so a FLAC decodes to the integers of the 24 bit WAV. 24
    rather than 16 because a render is quiet for long stretches (light touch, lifted finger) and FLAC spends no bits on
    leading zeros.
Limits: 8 channels, 655350 Hz; the target must seek, since the number of frames stands in the header.
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

MOST_CHANNELS = 8  # the format's own bound
NO_LIBRARY = "FLAC needs libsndfile: pip install soundfile, and where it brings no library apt-get install libsndfile1."


class FlacEncoder:
    """Writes FLAC into `stream`; where the stream fails, its own error comes out of `write` or `finish`."""

    def __init__(self, stream: BinaryIO, sample_rate: int, channels: int, metadata: Metadata | None) -> None:
        """Raise InvalidRequest for more than 8 channels, CannotRender where libsndfile is missing or refuses."""
        comment = "" if metadata is None else metadata.text().decode("ascii")
        _check(channels, comment)
        try:
            import soundfile
        except (ImportError, OSError) as error:  # OSError: the Python part is there, the library is not
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
        if len(block):  # the lowest 8 of 32 bits are zero: libsndfile keeps the upper 24
            integers = np.left_shift(quantise(block, SoundFormat.FLAC.bits), 8)
            self._guarded(lambda: self._file.write(integers))

    def finish(self) -> None:
        """Write what libFLAC still holds and the final header."""
        self._guarded(self._file.close)

    def discard(self) -> None:
        """Give libsndfile's memory back after a failure; what it would still write goes nowhere."""
        self._keeper.fault = self._keeper.fault or CannotRender("the file is given up")
        with contextlib.suppress(RuntimeError):  # it may repeat the error that brought us here
            self._file.close()

    def _guarded(self, action: Callable[[], object]) -> None:
        """Run `action`; where the stream failed under libsndfile, raise the stream's own error."""
        try:
            action()
        except (RuntimeError, AssertionError):  # libsndfile's "system error", or soundfile's count of the frames
            self._keeper.raise_fault()
            raise
        self._keeper.raise_fault()


class _FaultKeeper:
    """A stream for libsndfile's callbacks, through which no exception may pass: the first is kept, the rest is void.

    Its position 0 is where `stream` stood at the beginning.
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
        if self.fault is not None:
            raise self.fault

    def _kept(self, action: Callable[[], int]) -> int:
        if self.fault is None:
            try:
                return action()
            except BaseException as error:  # an interrupt must not be lost in C either
                self.fault = error
        return 0


def _check(channels: int, comment: str) -> None:
    if channels > MOST_CHANNELS:
        hint = "Write WAV, which takes any number, or fewer channels."
        raise InvalidRequest([Fault("/output/channels", f"{channels} channels", f"1 to {MOST_CHANNELS} in FLAC", hint)])
    if len(comment) > FLAC_COMMENT_BYTES:
        raise CannotRender(f"the scene is {len(comment)} bytes of JSON and a FLAC file holds 16 MB of it: write WAV.")
