"""What a sound file says about itself: the physical full scale of each channel, its quantity, and the whole scene.

Stage: part of STAGE 4 (encode), pure.
Model: one ASCII JSON text that common tools show, {"version", "generator", "channels": [{"quantity", "full_scale",
    "unit"}], "scene"}: in WAV the ICMT (comment) entry of a LIST INFO chunk that stands before the samples, with the
    generator alone in ISFT; in FLAC the Vorbis comment COMMENT, with the generator in SOFTWARE (libsndfile adds its own
    version there). Endless WAV has it too; raw formats have no room for it. Numbers are written so that they read back
    to the same float64.
Limits: libsndfile and soundfile show a WAV comment only below 2 kB (the sound they read all the same); ffprobe and sox
    show any length. A FLAC comment ends at 16 MB.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

VERSION = 2  # of the JSON text; a first one had none, and its scenes had the full band where they named no bandwidth

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

    def text(self) -> bytes:
        """Return the JSON text, ASCII, without spaces to spare; NaN or infinity in it is our bug (ValueError)."""
        channels = [
            {"quantity": quantity, "full_scale": float(full_scale), "unit": UNITS[quantity]}
            for quantity, full_scale in zip(self.quantities, self.full_scale, strict=True)
        ]
        document = {"version": VERSION, "generator": self.generator, "channels": channels, "scene": self.scene}
        return json.dumps(document, allow_nan=False, separators=(",", ":")).encode("ascii")
