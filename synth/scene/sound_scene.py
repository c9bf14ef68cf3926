"""Find what ridgewave wrote about a sound into its WAV or FLAC file: the JSON text of `encode.sound_metadata`.

Stage: before 1 (SCENE): a sound file of ridgewave is a scene, as a JSON file is.
Model: the content decides what a file is, not its name. WAV (also RF64 and endless): the ISBJ entry of a LIST INFO
    chunk, or ICMT without one. FLAC: the Vorbis comment COMMENT. The samples are not read.
Source: Microsoft, Multimedia Programming Interface and Data Specifications 1.0 (1991); EBU Tech 3306 (2009); RFC 9639.
Limits: an entry of more than LARGEST_TEXT bytes is not ours.
"""

from __future__ import annotations

import json
import os
import struct
from collections.abc import Iterator
from typing import Any, BinaryIO

from synth.errors import Fault, SceneError, shown
from synth.scene.merge import scene_before_bands

LARGEST_TEXT = 256 * 2**20  # bytes; a log of a live session takes 128 MB at most
UNKNOWN = 0xFFFFFFFF
ENDLESS = 1 << 63  # bytes of samples of an endless WAV: up to the end of the file, whatever its length
HEAD_BYTES = 12  # as many as `is_sound` looks at
CALLED = "a JSON file, or a sound file of ridgewave"


def is_sound(head: bytes) -> bool:
    """Return whether a file that begins with `head` is WAV, RF64 or FLAC."""
    return head[:4] == b"fLaC" or (head[:4] in (b"RIFF", b"RF64") and head[8:12] == b"WAVE")


def metadata_in(file: BinaryIO) -> dict[str, Any] | None:
    """Return the JSON object in a sound file, or None without one. The file is read from its beginning."""
    file.seek(0)
    head = file.read(HEAD_BYTES)
    try:
        text = _flac_comment(file) if head[:4] == b"fLaC" else _wav_comment(file)
        found = None if text is None else json.loads(text.rstrip(b"\0"))
    except (struct.error, ValueError, RecursionError):  # a damaged file, or the comment of another program
        return None
    return found if isinstance(found, dict) and isinstance(found.get("channels"), list) else None


def declared_frames(file: BinaryIO) -> int | None:
    """Return how many frames the header of a WAV file says it has; None for an endless WAV and for other files."""
    file.seek(0)
    if file.read(HEAD_BYTES)[8:] != b"WAVE":
        return None
    frame_bytes = 0
    try:
        for name, size in _chunks(file):
            if name == b"fmt ":
                (frame_bytes,) = struct.unpack("<12xH", file.read(14))
            elif name == b"data":
                return size // frame_bytes if frame_bytes and size != ENDLESS else None
    except struct.error:
        return None
    return None


def document_in_sound(file: BinaryIO, name: str) -> dict[str, object]:
    """Return the scene in a sound file, or the recording from which it was rendered.

    name: of the file, for the error. Raises SceneError if the file has neither.
    """
    metadata = metadata_in(file)
    if metadata is None:
        hint = "Another program wrote it, or removed what ridgewave wrote. Use the scene itself."
        raise SceneError([Fault("/scene", shown(name), CALLED, f"This sound has no scene in it. {hint}")])
    found = scene_of_metadata(metadata)
    if found is None:
        hint = "This sound has its scale only; another program wrote it again. Use the scene itself."
        raise SceneError([Fault("/scene", shown(name), CALLED, hint)])
    return found


def scene_of_metadata(metadata: dict[str, Any]) -> dict[str, object] | None:
    """Return the recording or the scene in the JSON object of a file, in today's form, or None without them."""
    recording, scene = metadata.get("recording"), metadata.get("scene")
    if isinstance(recording, dict):
        return recording
    if not isinstance(scene, dict):
        return None
    return scene if "version" in metadata else scene_before_bands(scene)


def _wav_comment(file: BinaryIO) -> bytes | None:
    entries: dict[bytes, bytes] = {}
    for name, size in _chunks(file):
        if name == b"LIST" and size <= LARGEST_TEXT and file.read(4) == b"INFO":
            entries |= _info(file.read(size - 4))
    return entries.get(b"ISBJ", entries.get(b"ICMT"))


def _chunks(file: BinaryIO) -> Iterator[tuple[bytes, int]]:
    """Yield the name and size of each chunk. The file then stands at the chunk's body."""
    end, at, long_data = file.seek(0, os.SEEK_END), HEAD_BYTES, UNKNOWN
    while at + 8 <= end:
        file.seek(at)
        name, size = struct.unpack("<4sI", file.read(8))
        if name == b"ds64":
            (long_data,) = struct.unpack("<8xQ", file.read(16))
            file.seek(at + 8)
        if name == b"data" and size == UNKNOWN:
            size = ENDLESS if long_data == UNKNOWN else long_data
        yield name, size
        at += 8 + size + (size & 1)


def _info(body: bytes) -> dict[bytes, bytes]:
    entries, at = {}, 0
    while at + 8 <= len(body):
        name, size = struct.unpack_from("<4sI", body, at)
        entries[name] = body[at + 8 : at + 8 + size]
        at += 8 + size + (size & 1)
    return entries


def _flac_comment(file: BinaryIO) -> bytes | None:
    file.seek(4)
    while True:
        head = file.read(4)
        if len(head) < 4:
            return None
        size = int.from_bytes(head[1:], "big")
        if head[0] & 0x7F == 4:
            return _vorbis_comment(file.read(size))
        if head[0] & 0x80:
            return None
        file.seek(size, os.SEEK_CUR)


def _vorbis_comment(block: bytes) -> bytes | None:
    (vendor,) = struct.unpack_from("<I", block)
    (count,) = struct.unpack_from("<I", block, 4 + vendor)
    at = 8 + vendor
    for _ in range(count):
        (size,) = struct.unpack_from("<I", block, at)
        name, _, value = block[at + 4 : at + 4 + size].partition(b"=")
        if name.lower() == b"comment":
            return value
        at += 4 + size
    return None
