"""`Sound`: what a render gave, as samples with their scale, and the file that it becomes.

Stage: encode, backwards (from the service's answer), and forwards again (`save`).
Model: float32 formats hold value / full scale as they were rendered; integer ones come back as n / 2**(bits - 1).
"""

from __future__ import annotations

import io
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from clients.client_errors import ProtocolError
from clients.pcm import SAMPLE_TYPES, Block, PcmBuffer


@dataclass(frozen=True, slots=True, eq=False)
class Sound:
    """A finite sound.

    frames: float32 [frames, channels], in units of `full_scale`. full_scale: the SI value of a sample of 1.0, one a
    channel. quantities: what it is a value of. scene: what was asked for. warnings: what a listener should know.
    """

    frames: Block
    sample_rate: int
    full_scale: tuple[float, ...]
    quantities: tuple[str, ...]
    scene: Mapping[str, Any]
    warnings: tuple[str, ...] = ()

    @property
    def seconds(self) -> float:
        """Return how long it lasts."""
        return len(self.frames) / self.sample_rate

    @property
    def values(self) -> npt.NDArray[np.float64]:
        """Return the samples in SI units, float64 [frames, channels]."""
        return np.multiply(self.frames, np.asarray(self.full_scale, dtype=np.float64))

    def save(self, path: str | Path, subtype: str | None = None) -> Path:
        """Write a sound file and return its path; ending and subtype are those of `ridgewave render`.

        Integer sound passes the safety limiter first, because integers clip. Raises AskedWrong, CannotRender.
        """
        from clients.target import read_target
        from synth.encode import Metadata, open_writer
        from synth.output import Limiter
        from synth.scene import parse_scene, scene_document

        target = Path(path)
        sound_format = read_target(str(target.absolute()), subtype).sound_format
        frames = self.frames
        if not sound_format.is_float:
            frames = Limiter(frames.shape[1], self.sample_rate).process(frames)
        metadata = Metadata(self.full_scale, self.quantities, scene_document(parse_scene(dict(self.scene))))
        with open_writer(
            target, sound_format, self.sample_rate, frames.shape[1], metadata, frames=len(frames)
        ) as writer:
            writer.write(frames)
        return target


def read_sound(body: bytes, headers: Mapping[str, str], scene: Mapping[str, Any]) -> Sound:
    """Return the sound of an answer; raises ProtocolError where the headers do not describe it."""
    try:
        shape = read_shape(headers)
        full_scale = tuple(float(value) for value in headers["ridgewave-full-scale"].split(","))
        quantities = tuple(value.strip() for value in headers["ridgewave-quantities"].split(","))
    except (KeyError, ValueError) as error:
        raise ProtocolError("the service's answer does not say what its samples are") from error
    warning = headers.get("ridgewave-warning")
    frames = _decode(body, shape.sound_format, shape.channels)
    return Sound(frames, shape.sample_rate, full_scale, quantities, scene, () if warning is None else (warning,))


@dataclass(frozen=True, slots=True)
class Shape:
    """The samples of an answer: the header Ridgewave-Format."""

    sound_format: str
    sample_rate: int
    channels: int


def read_shape(headers: Mapping[str, str]) -> Shape:
    """Return what Ridgewave-Format says, as in `f32le;rate=48000;channels=1`; raises KeyError, ValueError."""
    sound_format, *rest = headers["ridgewave-format"].split(";")
    named = dict(part.strip().split("=") for part in rest)
    return Shape(sound_format, int(named["rate"]), int(named["channels"]))


def _decode(body: bytes, sound_format: str, channels: int) -> Block:
    """Return the samples of a whole answer."""
    if sound_format in SAMPLE_TYPES:
        return _raw(body, sound_format, channels)
    import soundfile

    try:
        frames, _ = soundfile.read(io.BytesIO(body), dtype="float32", always_2d=True)
    except soundfile.LibsndfileError as error:
        raise ProtocolError(f"the service's answer is no {sound_format} file") from error
    return np.asarray(frames, dtype=np.float32)


def _raw(body: bytes, sample_format: str, channels: int) -> Block:
    buffer = PcmBuffer(sample_format, channels)
    if len(body) % buffer.frame_bytes:
        raise ProtocolError("the service's answer does not hold whole frames")
    buffer.append(body)
    return buffer.take(buffer.frames)
