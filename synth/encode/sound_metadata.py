"""The metadata of a sound file: the quantity and physical full scale of each channel, and the whole scene.

Stage: part of STAGE 4 (encode), pure.
Model: the metadata is an ASCII JSON text, which common tools show as a comment:
    {"version", "generator", "channels": [{"quantity", "full_scale", "unit"}], "scene"}, and where they apply
    "recording" (of a live session, which was rendered) and "gain_reduction_db" (largest reduction by the limiter).
    - WAV, endless WAV included: the ICMT (comment) entry of a LIST INFO chunk before the samples. libsndfile skips an
      entry of 2 kB or more. A longer text is therefore in ISBJ (subject), and ICMT then has all but the scene and the
      recording, with "scene_in": "ISBJ". ISFT has the generator.
    - FLAC: the Vorbis comment COMMENT. SOFTWARE has the generator, to which libsndfile adds its own version.
    - Raw formats have no metadata.
    Numbers are written so that they read back to the same float64. `scene.sound_scene` finds the text.
Limits: ffprobe, sox and exiftool show any length. A FLAC comment has 16 MB at most.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from synth.scene.effects_section import unit_of
from synth.scene.text import json_text

WAV_COMMENT_BYTES = 2046  # libsndfile skips an INFO entry of 2048 bytes or more, with its NUL and its padding
LONGER = "ISBJ"
VERSION = 2  # of the JSON text. Version 1 had no version field, and its scenes without a bandwidth had the full band

FLAC_COMMENT_BYTES = 2**24 - 4096  # the size of a FLAC metadata block has 24 bits, and other entries take some bytes


def generator_name() -> str:
    """Return the name and version of this program, such as "ridgewave 0.1.0"."""
    from importlib import metadata

    try:
        return f"ridgewave {metadata.version('ridgewave')}"
    except metadata.PackageNotFoundError:
        return "ridgewave (not installed)"


@dataclass(frozen=True)
class Metadata:
    """The metadata of a file.

    full_scale: SI value of a sample of 1.0, one per channel.
    quantities: quantity of each channel, such as "acceleration".
    scene: the scene as a JSON document in SI numbers, as `scene_document` makes it. It contains only JSON types: a
        tuple would be read back as a list. Or its JSON, as `scene_text` makes it.
    generator: name and version of the program.
    recording: document of the live session that was rendered, or None.
    gain_reduction_db: largest reduction by the limiter, where it is known before the file is written.
    """

    full_scale: tuple[float, ...]
    quantities: tuple[str, ...]
    scene: dict[str, Any] | bytes
    generator: str = field(default_factory=generator_name)
    recording: Mapping[str, Any] | None = None
    gain_reduction_db: float = 0.0

    def __post_init__(self) -> None:
        assert len(self.full_scale) == len(self.quantities), "a full scale and a quantity for each channel"

    def text(self) -> bytes:
        """Return the JSON text in ASCII, without unnecessary spaces.

        NaN or infinity in it is a bug in ridgewave and raises ValueError.
        """
        scene = self.scene if isinstance(self.scene, bytes) else json_text(self.scene)
        recording = b"" if self.recording is None else b',"recording":' + json_text(self.recording)
        return b"".join((json_text(self._scale())[:-1], b',"scene":', scene, recording, b"}"))

    def wav_entries(self) -> list[tuple[bytes, bytes]]:
        """Return the entries of a LIST INFO chunk: names, and texts without their NUL."""
        text = self.text()
        software = b"ISFT", self.generator.encode("ascii", "replace")
        if len(text) + 1 <= WAV_COMMENT_BYTES:
            return [software, (b"ICMT", text)]
        scale = json_text({**self._scale(), "scene_in": LONGER})
        return [software, (b"ICMT", scale), (LONGER.encode(), text)]

    def _scale(self) -> dict[str, Any]:
        """Return everything but the scene and the recording."""
        channels = [
            {"quantity": quantity, "full_scale": float(full_scale), "unit": unit_of(quantity)}
            for quantity, full_scale in zip(self.quantities, self.full_scale, strict=True)
        ]
        scale = {"version": VERSION, "generator": self.generator, "channels": channels}
        return scale | ({"gain_reduction_db": round(self.gain_reduction_db, 2)} if self.gain_reduction_db else {})
