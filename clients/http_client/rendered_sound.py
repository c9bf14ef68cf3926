"""Reads the answer to a render into a `synth.Sound`.

float32 formats hold value / full scale; integer formats are read as n / 2**(bits - 1).
"""

from __future__ import annotations

import io
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from clients.client_errors import ProtocolError
from clients.pcm_buffer import SAMPLE_TYPES, Block, PcmBuffer
from synth.encode.sound import Sound


def read_sound(body: bytes, headers: Mapping[str, str], scene: Mapping[str, Any]) -> Sound:
    """Return the sound in an answer; raises ProtocolError if the headers do not describe it."""
    try:
        shape = read_shape(headers)
        full_scale = tuple(float(value) for value in headers["ridgewave-full-scale"].split(","))
        quantities = tuple(value.strip() for value in headers["ridgewave-quantities"].split(","))
    except (KeyError, ValueError) as error:
        raise ProtocolError("the headers of the answer do not describe its samples") from error
    warning = headers.get("ridgewave-warning")
    frames = _decode(body, shape.sound_format, shape.channels)
    return Sound(frames, shape.sample_rate, full_scale, quantities, scene, () if warning is None else (warning,))


@dataclass(frozen=True, slots=True)
class Shape:
    """The header Ridgewave-Format: the form of the samples."""

    sound_format: str
    sample_rate: int
    channels: int


def read_shape(headers: Mapping[str, str]) -> Shape:
    """Read Ridgewave-Format, such as `f32le;rate=48000;channels=1`; raises KeyError, ValueError."""
    sound_format, *rest = headers["ridgewave-format"].split(";")
    named = dict(part.strip().split("=") for part in rest)
    return Shape(sound_format, int(named["rate"]), int(named["channels"]))


def _decode(body: bytes, sound_format: str, channels: int) -> Block:
    if sound_format in SAMPLE_TYPES:
        return _raw(body, sound_format, channels)
    import soundfile

    try:
        frames, _ = soundfile.read(io.BytesIO(body), dtype="float32", always_2d=True)
    except soundfile.LibsndfileError as error:
        raise ProtocolError(f"the answer is not a {sound_format} file") from error
    return np.asarray(frames, dtype=np.float32)


def _raw(body: bytes, sample_format: str, channels: int) -> Block:
    buffer = PcmBuffer(sample_format, channels)
    if len(body) % buffer.frame_bytes:
        raise ProtocolError("the answer ends within a frame")
    buffer.append(body)
    return buffer.take(buffer.frames)
