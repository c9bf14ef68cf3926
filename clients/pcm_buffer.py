"""Samples as they arrive, any number of bytes at a time, into float32 blocks of the length that is asked for.

Stage: encode, backwards.
Model: interleaved; float32 as it is, int16 as n / 32768 (the rule of `synth.encode.samples`, read backwards).
"""

from __future__ import annotations

from collections import deque
from typing import Any

import numpy as np
import numpy.typing as npt

Block = npt.NDArray[np.float32]

SAMPLE_TYPES: dict[str, np.dtype[Any]] = {"f32le": np.dtype("<f4"), "s16le": np.dtype("<i2"), "l16": np.dtype(">i2")}
"""The type of a sample of each wire format: the first two are those of the live protocol, the last is audio/L16."""
INT16_STEPS = 32768.0  # integer steps to full scale, as in synth.encode.samples; another number changes the level


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
        """Return how many whole frames there are."""
        return self._bytes // self.frame_bytes

    def append(self, samples: bytes) -> None:
        """Take the next bytes; a frame may be cut anywhere."""
        self._parts.append(samples)
        self._bytes += len(samples)

    def take(self, frames: int) -> Block:
        """Return the next `frames`, float32 [frames, channels], which are there."""
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
