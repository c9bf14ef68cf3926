"""What a sound file says about itself: the physical full scale of each channel, its quantity, and the whole scene.

Stage: part of STAGE 4 (encode), pure but for `read_metadata`, which reads a file.
Model: one ASCII JSON text that common tools show, {"version", "generator", "channels": [{"quantity", "full_scale",
    "unit"}], "scene"}: in WAV the ICMT (comment) entry of a LIST INFO chunk that stands before the samples, with the
    generator alone in ISFT; in FLAC the Vorbis comment COMMENT, with the generator in SOFTWARE (libsndfile adds its own
    version there). Endless WAV has it too; raw formats have no room for it. Numbers are written so that they read back
    to the same float64.
    Files written before had no version: their scenes had the full band where they named no bandwidth, and are read so.
Limits: libsndfile and soundfile show a WAV comment only below 2 kB (the sound they read all the same); ffprobe, sox
    and `read_metadata` show any length. A FLAC comment ends at 16 MB.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO

from synth.errors import CannotRender
from synth.scene.merge import scene_before_bands

VERSION = 2  # of the JSON text; what has none is the first

UNITS: Mapping[str, str] = {
    "approach": "m",
    "displacement": "m",
    "velocity": "m/s",
    "acceleration": "m/s^2",
    "force": "N",
    "tangential_force": "N",
}
FLAC_COMMENT_BYTES = 2**24 - 4096  # a FLAC metadata block counts its bytes in 24 bits; some are taken by other entries


def generator_name() -> str:
    """Return the name and version of this program, such as "ridgewave 0.1.0"."""
    from importlib import metadata

    try:
        return f"ridgewave {metadata.version('ridgewave')}"
    except metadata.PackageNotFoundError:
        return "ridgewave (not installed)"


@dataclass(frozen=True)
class Metadata:
    """What stands in the file beside the samples.

    full_scale: the physical value, in SI units, that a sample of 1.0 stands for; one a channel.
    quantities: the quantity of each channel, one of `UNITS`.
    scene: the scene as a JSON document in SI numbers (as `scene_document` makes it): what JSON can hold, and no tuples,
        since these would come back as lists.
    """

    full_scale: tuple[float, ...]
    quantities: tuple[str, ...]
    scene: dict[str, Any]
    generator: str = field(default_factory=generator_name)

    def __post_init__(self) -> None:
        assert len(self.full_scale) == len(self.quantities), "a full scale and a quantity for each channel"

    def document(self) -> dict[str, Any]:
        """Return the JSON document that the file holds."""
        channels = [
            {"quantity": quantity, "full_scale": float(full_scale), "unit": UNITS[quantity]}
            for quantity, full_scale in zip(self.quantities, self.full_scale, strict=True)
        ]
        return {"version": VERSION, "generator": self.generator, "channels": channels, "scene": self.scene}

    def text(self) -> bytes:
        """Return the JSON text, ASCII, without spaces to spare; NaN or infinity in it is our bug (ValueError)."""
        return json.dumps(self.document(), allow_nan=False, separators=(",", ":")).encode("ascii")


def parse_metadata(text: bytes) -> Metadata | None:
    """Return the metadata of a comment, or None where the comment is not one of ours."""
    try:
        document = json.loads(text)
        channels, scene = document["channels"], dict(document["scene"])
        return Metadata(
            full_scale=tuple(float(channel["full_scale"]) for channel in channels),
            quantities=tuple(str(channel["quantity"]) for channel in channels),
            scene=scene if "version" in document else scene_before_bands(scene),
            generator=str(document["generator"]),
        )
    except (ValueError, TypeError, KeyError):
        return None


def read_metadata(source: str | Path | bytes) -> Metadata | None:
    """Return what a WAV, RF64 or FLAC file (a path, or its first bytes) says about itself.

    None where it says nothing that ridgewave wrote. Raises CannotRender where the file cannot be read.
    """
    if isinstance(source, bytes):
        return _read(BytesIO(source))
    try:
        with open(source, "rb") as stream:
            return _read(stream)
    except OSError as error:
        raise CannotRender(f"cannot read {source}: {error.strerror or error}.") from error


def _read(stream: BinaryIO) -> Metadata | None:
    magic = stream.read(4)
    try:
        if magic in (b"RIFF", b"RF64"):
            stream.seek(12)
            comment = _wav_comment(stream)
        elif magic == b"fLaC":
            comment = _flac_comment(stream)
        else:
            comment = None
    except struct.error:  # the file ends inside a header
        return None
    return None if comment is None else parse_metadata(comment)


def _wav_comment(stream: BinaryIO) -> bytes | None:
    """Return the ICMT text of the first LIST INFO chunk ahead of the samples; `stream` stands after "WAVE"."""
    while True:
        name, size = struct.unpack("<4sI", stream.read(8))
        if name == b"data":
            return None
        body_end = stream.tell() + size + (size & 1)
        if name == b"LIST" and stream.read(4) == b"INFO":
            return _info_entry(stream.read(size - 4), b"ICMT")
        stream.seek(body_end)


def _info_entry(entries: bytes, wanted: bytes) -> bytes | None:
    position = 0
    while position + 8 <= len(entries):
        name, size = struct.unpack_from("<4sI", entries, position)
        if name == wanted:
            return entries[position + 8 : position + 8 + size].rstrip(b"\0")
        position += 8 + size + (size & 1)
    return None


def _flac_comment(stream: BinaryIO) -> bytes | None:
    """Return the COMMENT entry of the VORBIS_COMMENT block; `stream` stands after "fLaC"."""
    last = False
    while not last:
        (word,) = struct.unpack(">I", stream.read(4))
        last, kind, size = bool(word >> 31), (word >> 24) & 0x7F, word & 0xFFFFFF
        body = stream.read(size)
        if kind == 4:
            return _vorbis_entry(body, b"COMMENT")
    return None


def _vorbis_entry(body: bytes, wanted: bytes) -> bytes | None:
    (vendor,) = struct.unpack_from("<I", body, 0)
    (count,) = struct.unpack_from("<I", body, 4 + vendor)
    position = 8 + vendor
    for _ in range(count):
        (size,) = struct.unpack_from("<I", body, position)
        name, _, text = body[position + 4 : position + 4 + size].partition(b"=")
        if name.upper() == wanted:
            return text
        position += 4 + size
    return None
