"""The metadata of a sound file: the quantity and physical full scale of each channel, and the whole scene.

Stage: part of STAGE 4 (encode), pure.
Model: the metadata is an ASCII JSON text, which common tools show as a comment:
    {"version", "generator", "channels": [{"quantity", "full_scale", "unit"}], "scene"}
    - WAV, endless WAV included: the ICMT (comment) entry of a LIST INFO chunk before the samples. ISFT has the
      generator.
    - FLAC: the Vorbis comment COMMENT. SOFTWARE has the generator, to which libsndfile adds its own version.
    - Raw formats have no metadata.
    Numbers are written so that they read back to the same float64.
Limits: libsndfile and soundfile show a WAV comment only below 2 kB, but read the sound in any case. ffprobe and sox
    show any length. A FLAC comment has 16 MB at most.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import Any

from synth.scene.effects_section import unit_of

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
        tuple would be read back as a list.
    generator: name and version of the program.
    """

    full_scale: tuple[float, ...]
    quantities: tuple[str, ...]
    scene: dict[str, Any]
    generator: str = field(default_factory=generator_name)

    def __post_init__(self) -> None:
        assert len(self.full_scale) == len(self.quantities), "a full scale and a quantity for each channel"

    def text(self) -> bytes:
        """Return the JSON text in ASCII, without unnecessary spaces.

        NaN or infinity in it is a bug in ridgewave and raises ValueError.
        """
        channels = [
            {"quantity": quantity, "full_scale": float(full_scale), "unit": unit_of(quantity)}
            for quantity, full_scale in zip(self.quantities, self.full_scale, strict=True)
        ]
        document = {"version": VERSION, "generator": self.generator, "channels": channels, "scene": self.scene}
        return json.dumps(document, allow_nan=False, separators=(",", ":")).encode("ascii")
