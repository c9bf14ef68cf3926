"""The containers of sound: file endings, media types, and the bytes before and after the samples.

Stage: part of STAGE 4 (encode), pure.
Model: a sound is an opening, the samples of `samples.block_bytes`, and a closing. The container of a `SoundFormat`
    makes the opening and the closing. A raw format has neither.
Limits: FLAC is not a sequence of independent blocks. It has no opening here: `synth.encode.flac` writes it as a whole.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from synth.encode.riff import padding, wav_header
from synth.encode.samples import SoundFormat
from synth.encode.sound_metadata import Metadata

# The sample types of each file ending, with the default first.
ENDINGS: dict[str, dict[str, SoundFormat]] = {
    ".wav": {"float": SoundFormat.WAV, "pcm16": SoundFormat.WAV16, "pcm24": SoundFormat.WAV24},
    ".flac": {"pcm24": SoundFormat.FLAC},
    ".raw": {"float": SoundFormat.F32LE},
    ".f32": {"float": SoundFormat.F32LE},
    ".pcm": {"float": SoundFormat.F32LE},
    ".l16": {"pcm16": SoundFormat.L16},
}


class Container(NamedTuple):
    """What surrounds the samples.

    media_types: the first is sent; a request may also name the others.
    header: returns the bytes before the samples; its arguments are those of `opening`. None: there are none.
    closing: returns the bytes after a number of bytes of samples.
    """

    media_types: tuple[str, ...]
    header: Callable[[SoundFormat, int, int, Metadata | None, int | None, bool | None], bytes] | None
    closing: Callable[[int], bytes]


def _nothing(_data_bytes: int) -> bytes:
    return b""


CONTAINERS: dict[str, Container] = {
    "wav": Container(("audio/wav", "audio/x-wav", "audio/wave", "audio/vnd.wave"), wav_header, padding),
    "flac": Container(("audio/flac", "audio/x-flac"), None, _nothing),
    "raw": Container(("application/octet-stream",), None, _nothing),
}
"""The container of each name in `SoundFormat.container`."""


def media_types(sound_format: SoundFormat) -> tuple[str, ...]:
    """Return the media types of a format, without parameters; the first one is sent."""
    return ("audio/L16",) if sound_format is SoundFormat.L16 else CONTAINERS[sound_format.container].media_types


def opening(
    sound_format: SoundFormat,
    sample_rate: int,
    channels: int,
    metadata: Metadata | None,
    frames: int | None,
    reserve: bool | None = None,
) -> bytes:
    """Return the bytes before the samples.

    sample_rate: Hz.
    frames: number of frames; None for an endless sound.
    reserve: whether the length of the opening must be the same for every number of frames; None for yes where the
        number is known.
    """
    header = CONTAINERS[sound_format.container].header
    return b"" if header is None else header(sound_format, sample_rate, channels, metadata, frames, reserve)


def closing(sound_format: SoundFormat, data_bytes: int) -> bytes:
    """Return the bytes after `data_bytes` bytes of samples."""
    return CONTAINERS[sound_format.container].closing(data_bytes)
