"""Sound out: float32 blocks into WAV, FLAC and PCM, as files, as whole bodies and as endless streams.

STAGE 4 (encode). Pure but for `open_writer`, which writes files.
Model: one integer rule for every format (`synth.encode.samples`), headers written by hand (`synth.encode.riff`), FLAC
    by libsndfile (`synth.encode.flac`), the scene and the physical full scale in each file
    (`synth.encode.sound_metadata`), files that appear only when complete (`synth.encode.file_writer`,
    `synth.encode.part_file`). The same blocks give the same bytes: no time stamps, no dither.
Limits: L16 is refused above 48 kHz (the media type's own bound); raw formats carry no metadata; FLAC does not stream.
"""

from __future__ import annotations

import io
from pathlib import Path

from synth.encode.file_writer import Writer, open_writer
from synth.encode.riff import wav_header
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

L16_RATE_LIMIT_HZ = 48000  # RFC 4856: the largest rate of audio/L16 outside RTP

# For each ending of a file: the sample types that it has, the default first.
ENDINGS: dict[str, dict[str, SoundFormat]] = {
    ".wav": {"float": SoundFormat.WAV, "pcm16": SoundFormat.WAV16, "pcm24": SoundFormat.WAV24},
    ".flac": {"pcm24": SoundFormat.FLAC},
    ".raw": {"float": SoundFormat.F32LE},
    ".f32": {"float": SoundFormat.F32LE},
    ".pcm": {"float": SoundFormat.F32LE},
    ".l16": {"pcm16": SoundFormat.L16},
}


def choose_format(path: str | Path, subtype: str | None = None) -> SoundFormat:
    """Return the format that the ending of `path` and a subtype ask for; raises InvalidRequest for anything else.

    .wav: float (default), pcm16, pcm24. .flac: pcm24. .raw, .f32, .pcm: float, little-endian. .l16: pcm16, big-endian.
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
    """Return the Content-Type of `sound_format`; raises InvalidRequest for L16 above 48 kHz, which has none."""
    if sound_format is SoundFormat.L16:
        if sample_rate > L16_RATE_LIMIT_HZ:
            hint = "Ask for format wav16 or f32le, or for a lower rate."
            allowed = f"at most {L16_RATE_LIMIT_HZ} Hz for audio/L16"
            raise InvalidRequest([Fault("/output/sample_rate", str(sample_rate), allowed, hint)])
        return f"audio/L16;rate={sample_rate};channels={channels}"
    return {"wav": "audio/wav", "flac": "audio/flac", "raw": "application/octet-stream"}[sound_format.container]


def encode_all(block: Block, sound_format: SoundFormat, sample_rate: int, metadata: Metadata | None = None) -> bytes:
    """Return a whole file, exact sizes, of `block` float32 [frames, channels]: the bytes that a writer would write."""
    body = io.BytesIO()
    with open_writer(body, sound_format, sample_rate, block.shape[1], metadata, frames=len(block)) as writer:
        writer.write(block)
    return body.getvalue()


def stream_header(
    sound_format: SoundFormat, sample_rate: int, channels: int, metadata: Metadata | None = None
) -> bytes:
    """Return what opens an endless stream of `block_bytes`: a WAV header without an end, nothing for raw formats.

    Raises InvalidRequest for FLAC, whose header counts its frames.
    """
    if sound_format is SoundFormat.FLAC:
        streams = ", ".join(kind for kind in SoundFormat if kind is not SoundFormat.FLAC)
        raise InvalidRequest([Fault("/format", "flac", f"{streams} for a stream", "Ask for wav24: the same samples.")])
    if sound_format.container == "raw":
        return b""
    return wav_header(sound_format, sample_rate, channels, metadata, None)
