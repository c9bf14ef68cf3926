"""Make WAV headers. They are made here to allow endless streams, and so that the same sound gives the same bytes.

Stage: part of STAGE 4 (encode), pure.
Model: the chunks are RIFF or RF64, WAVE, [JUNK or ds64], fmt, [fact], LIST INFO, data. There is no PEAK chunk, to which
    libsndfile adds the time.
    - Known length: the sizes are exact. 36 bytes (JUNK) are reserved for the ds64 chunk of RF64, which is needed above
      4 GiB. The header therefore has the same length for every length of the sound.
    - Endless: both size fields are 0xFFFFFFFF, and so is the number of frames in the fact chunk.
    - The fact chunk has the number of frames. Every format code but 1 has one.
    - One or two channels: the format codes are 1 (integer, also for 24 bit, which every reader accepts) and 3 (float).
    - More channels: WAVE_FORMAT_EXTENSIBLE with an empty channel mask, because the channels are quantities, not
      loudspeakers. With the simple codes, players would assume quadraphonic sound. Python's `wave` reads these files
      from 3.12 on.
Source: Microsoft, Multimedia Programming Interface and Data Specifications 1.0 (1991); Microsoft, Multiple Channel
    Audio Data and WAVE Files (2007); EBU Tech 3306 (2009) for RF64.
Limits: 65535 bytes per frame at most. Neither sox 14.4 nor `wave` reads RF64.
"""

from __future__ import annotations

import struct

from synth.encode.samples import SoundFormat
from synth.encode.sound_metadata import Metadata

UNKNOWN = 0xFFFFFFFF  # in a 32 bit size field: endless (RIFF) or "see ds64" (RF64); 0 would mean an empty sound
RF64_ABOVE = 0xFFFFFFFE  # largest size of a RIFF file; only tests change it

SIMPLE_CHANNELS = 2  # the most without WAVE_FORMAT_EXTENSIBLE
FORMAT_PCM = 1
FORMAT_FLOAT = 3
FORMAT_EXTENSIBLE = 0xFFFE
SUBFORMAT_TAIL = bytes.fromhex("000000001000800000aa00389b71")  # KSDATAFORMAT_SUBTYPE GUID without its 16 bit code


def wav_header(
    sound_format: SoundFormat,
    sample_rate: int,
    channels: int,
    metadata: Metadata | None,
    frames: int | None,
    reserve: bool | None = None,
) -> bytes:
    """Return the bytes before the samples of a WAV file.

    frames: number of frames; None for an endless file.
    reserve: whether to leave room for ds64; None leaves room if the number of frames is known.

    The length of the header depends only on the format, the channels, the metadata and `reserve`.
    """
    reserve = frames is not None if reserve is None else reserve
    chunks = _format_chunk(sound_format, sample_rate, channels)
    if sound_format.is_float or channels > SIMPLE_CHANNELS:
        chunks += _chunk(b"fact", struct.pack("<I", UNKNOWN if frames is None else min(frames, UNKNOWN)))
    if metadata is not None:
        chunks += _info_chunk(metadata)
    return _sized(chunks, frames, channels * sound_format.bytes_per_sample, reserve)


def padding(data_bytes: int) -> bytes:
    """Return the padding after `data_bytes` bytes: chunks have an even length."""
    return b"\0" * (data_bytes & 1)


def _sized(chunks: bytes, frames: int | None, frame_bytes: int, reserve: bool) -> bytes:
    """Return the header with `chunks` in it, as RIFF, RF64, or endless RIFF."""
    room = _chunk(b"JUNK", bytes(28)) if reserve else b""
    if frames is None:
        return struct.pack("<4sI4s", b"RIFF", UNKNOWN, b"WAVE") + room + chunks + struct.pack("<4sI", b"data", UNKNOWN)
    data_bytes = frames * frame_bytes
    riff_bytes = 4 + len(room) + len(chunks) + 8 + data_bytes + len(padding(data_bytes))
    if riff_bytes <= RF64_ABOVE:
        opening = struct.pack("<4sI4s", b"RIFF", riff_bytes, b"WAVE") + room
        return opening + chunks + struct.pack("<4sI", b"data", data_bytes)
    sizes = _chunk(b"ds64", struct.pack("<QQQI", riff_bytes, data_bytes, frames, 0))
    return struct.pack("<4sI4s", b"RF64", UNKNOWN, b"WAVE") + sizes + chunks + struct.pack("<4sI", b"data", UNKNOWN)


def _format_chunk(sound_format: SoundFormat, sample_rate: int, channels: int) -> bytes:
    code = FORMAT_FLOAT if sound_format.is_float else FORMAT_PCM
    frame_bytes = channels * sound_format.bytes_per_sample
    shape = struct.pack("<HIIHH", channels, sample_rate, sample_rate * frame_bytes, frame_bytes, sound_format.bits)
    if channels > SIMPLE_CHANNELS:
        subformat = struct.pack("<HHIH", 22, sound_format.bits, 0, code) + SUBFORMAT_TAIL
        return _chunk(b"fmt ", struct.pack("<H", FORMAT_EXTENSIBLE) + shape + subformat)
    extension = struct.pack("<H", 0) if sound_format.is_float else b""
    return _chunk(b"fmt ", struct.pack("<H", code) + shape + extension)


def _info_chunk(metadata: Metadata) -> bytes:
    entries = (_chunk(name, text + b"\0") for name, text in metadata.wav_entries())
    return _chunk(b"LIST", b"INFO" + b"".join(entries))


def _chunk(name: bytes, body: bytes) -> bytes:
    return struct.pack("<4sI", name, len(body)) + body + padding(len(body))
