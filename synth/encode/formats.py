"""Encode float32 blocks as WAV, FLAC and PCM: to files, to bytes, or as endless streams.

STAGE 4 (encode). All functions are pure, except `open_writer`, which writes files.
Model: every format uses the same rule for integers (`synth.encode.samples`). What surrounds the samples is in
    `synth.encode.containers`. WAV headers are written here (`synth.encode.riff`), and FLAC by libsndfile
    (`synth.encode.flac`). Each file contains the scene and the physical
    full scale (`synth.encode.sound_metadata`). A file appears only when it is complete (`synth.encode.file_writer`,
    `synth.encode.part_file`). The same blocks give the same bytes: there are no time stamps and no dither.
Limits: L16 is refused above 48 kHz, the limit of its media type. Raw formats have no metadata. FLAC cannot be streamed.
"""

from __future__ import annotations

import io
from pathlib import Path

from synth.encode.containers import ENDINGS, media_types, opening
from synth.encode.file_writer import Writer, open_writer
from synth.encode.flac import check_flac
from synth.encode.samples import Block, SoundFormat, block_bytes, quantise
from synth.encode.sound_metadata import Metadata
from synth.errors import Fault, InvalidRequest, shown

__all__ = [
    "ENDINGS",
    "L16_RATE_LIMIT_HZ",
    "Block",
    "Metadata",
    "SoundFormat",
    "Writer",
    "block_bytes",
    "choose_format",
    "encode_all",
    "media_type",
    "open_writer",
    "quantise",
    "stream_header",
]

L16_RATE_LIMIT_HZ = 48000  # largest rate of audio/L16 outside RTP (RFC 4856)


def choose_format(path: str | Path, subtype: str | None = None) -> SoundFormat:
    """Return the format for the ending of `path` and a subtype. Raises InvalidRequest if there is none.

    .wav: float (default), pcm16, pcm24
    .flac: pcm24
    .raw, .f32, .pcm: float, little-endian
    .l16: pcm16, big-endian
    """
    ending = Path(path).suffix.lower()
    if ending not in ENDINGS:
        allowed = f"a name that ends in {', '.join(ENDINGS)}"
        raise InvalidRequest([Fault("/output", shown(str(path)), allowed, "Write, for instance, out.wav.")])
    subtypes = ENDINGS[ending]
    chosen = next(iter(subtypes)) if subtype is None else subtype
    if chosen not in subtypes:
        others = sorted(other for other, kinds in ENDINGS.items() if chosen in kinds)
        hint = f"Write {chosen} to a {' or '.join(others)} file." if others else f"Write {next(iter(subtypes))}."
        raise InvalidRequest([Fault("/subtype", shown(chosen), f"{' or '.join(subtypes)} in a {ending} file", hint)])
    return subtypes[chosen]


def media_type(sound_format: SoundFormat, sample_rate: int, channels: int) -> str:
    """Return the Content-Type of `sound_format`.

    Raises InvalidRequest for L16 above 48 kHz, which has none, and for a rate or channels that FLAC cannot hold.
    """
    if sound_format is SoundFormat.FLAC:
        check_flac(sample_rate, channels)
    if sound_format is SoundFormat.L16:
        if sample_rate > L16_RATE_LIMIT_HZ:
            hint = "Request the format wav16 or f32le, or a lower rate."
            allowed = f"at most {L16_RATE_LIMIT_HZ} Hz for audio/L16"
            raise InvalidRequest([Fault("/output/sample_rate", str(sample_rate), allowed, hint)])
        return f"{media_types(sound_format)[0]};rate={sample_rate};channels={channels}"
    return media_types(sound_format)[0]


def encode_all(block: Block, sound_format: SoundFormat, sample_rate: int, metadata: Metadata | None = None) -> bytes:
    """Return the bytes of a whole file, with exact sizes, for `block`, float32 [frames, channels]."""
    body = io.BytesIO()
    with open_writer(body, sound_format, sample_rate, block.shape[1], metadata, frames=len(block)) as writer:
        writer.write(block)
    return body.getvalue()


def stream_header(
    sound_format: SoundFormat,
    sample_rate: int,
    channels: int,
    metadata: Metadata | None = None,
    frames: int | None = None,
) -> bytes:
    """Return the header of a stream of `block_bytes`: a WAV header, or nothing for raw formats.

    frames: number of frames; None for an endless stream.
    Raises InvalidRequest for FLAC, whose header contains sizes that are known at the end.
    """
    if sound_format is SoundFormat.FLAC:
        streams = ", ".join(kind for kind in SoundFormat if kind is not SoundFormat.FLAC)
        raise InvalidRequest(
            [Fault("/format", "flac", f"{streams} for a stream", "Use wav24: it has the same samples.")]
        )
    return opening(sound_format, sample_rate, channels, metadata, frames)
