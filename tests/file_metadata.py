"""What ridgewave wrote into a sound file beside the samples, read back without the engine's own code for files."""

from __future__ import annotations

import json
import struct
from pathlib import Path

from synth.encode.sound_metadata import Metadata


def read_metadata(source: Path | bytes) -> Metadata | None:
    """Return the metadata of a WAV, RF64 or FLAC file (a path, or its first bytes), None where it has none."""
    file = source if isinstance(source, bytes) else source.read_bytes()
    if file.startswith(b"fLaC"):
        at = file.find(b"comment=")
        (size,) = struct.unpack_from("<I", file, at - 4) if at >= 0 else (0,)
        text = file[at : at + size].removeprefix(b"comment=")
    else:
        named = file.find(b'"scene_in":"ISBJ"')
        at = file.find(b"ICMT") if named < 0 else file.find(b"ISBJ", named + 17)
        (size,) = struct.unpack_from("<I", file, at + 4) if at >= 0 else (0,)
        text = file[at + 8 : at + 8 + size].rstrip(b"\0")
    if at < 0:
        return None
    document = json.loads(text)
    assert document["version"] == 2
    return Metadata(
        full_scale=tuple(channel["full_scale"] for channel in document["channels"]),
        quantities=tuple(channel["quantity"] for channel in document["channels"]),
        scene=document["scene"],
        generator=document["generator"],
    )
