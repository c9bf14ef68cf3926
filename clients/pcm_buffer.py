"""Collects PCM bytes, in parts of any size, and returns float32 blocks of the requested length.

Samples are interleaved. float32 samples are unchanged; int16 samples are n / 32768, the inverse of
`synth.encode.samples`.
"""

from __future__ import annotations

import operator
from collections import deque
from typing import Any

import numpy as np
import numpy.typing as npt

from synth.errors import Fault, InvalidRequest, shown

Block = npt.NDArray[np.float32]

SAMPLE_TYPES: dict[str, np.dtype[Any]] = {"f32le": np.dtype("<f4"), "s16le": np.dtype("<i2"), "l16": np.dtype(">i2")}
"""Sample type of each raw format: the first two are those of the live protocol, the last is audio/L16."""
INT16_STEPS = 32768.0  # integer steps per full scale, as in synth.encode.samples


def whole_frames(name: str, value: object) -> int:
    """Return `value` of the argument `name` as an int; raises InvalidRequest unless it is a whole number from 0."""
    try:
        whole = operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        whole = -1
    if whole < 0:
        raise InvalidRequest([Fault("/" + name, shown(value), "a whole number from 0", "Write a number of frames.")])
    return whole


class PcmBuffer:
    """First in, first out: bytes in, frames out."""

    def __init__(self, sample_format: str, channels: int) -> None:
        self._type = SAMPLE_TYPES[sample_format]
        self.channels = channels
        self.frame_bytes: int = self._type.itemsize * channels
        self._parts: deque[bytes] = deque()
        self._bytes = 0

    @property
    def frames(self) -> int:
        """The number of complete frames."""
        return self._bytes // self.frame_bytes

    def append(self, samples: bytes) -> None:
        """Append bytes, which may end within a frame."""
        self._parts.append(samples)
        self._bytes += len(samples)

    def take(self, frames: int) -> Block:
        """Remove and return the next `frames`, float32 [frames, channels]; there must be so many."""
        wanted = frames * self.frame_bytes
        assert wanted <= self._bytes, f"{frames} frames of {self.frames}"
        gathered = bytearray()
        while len(gathered) < wanted:
            part, missing = self._parts.popleft(), wanted - len(gathered)
            gathered += part[:missing]
            if len(part) > missing:
                self._parts.appendleft(part[missing:])
        self._bytes -= wanted
        return self._samples(bytes(gathered))

    def _samples(self, gathered: bytes) -> Block:
        samples: Block = np.frombuffer(gathered, self._type).astype(np.float32).reshape(-1, self.channels)
        return samples if self._type.kind == "f" else samples / np.float32(INT16_STEPS)
