"""What describes a sound to its reader: the answer's headers, and the metadata inside the file."""

from __future__ import annotations

from typing import Protocol

from synth.encode.formats import Metadata, SoundFormat
from synth.scene.scene import Scene, scene_document


class Sounding(Protocol):
    """What a voice and a session say about their sound; see `service.engine.Voice`."""

    @property
    def sample_rate(self) -> int:
        """Return frames a second."""

    @property
    def channels(self) -> int:
        """Return samples a frame."""

    @property
    def full_scale(self) -> tuple[float, ...]:
        """Return the SI value of a sample of 1.0, one a channel."""

    @property
    def quantities(self) -> tuple[str, ...]:
        """Return the quantity of each channel."""


def describe(voice: Sounding, sound_format: SoundFormat) -> dict[str, str]:
    """Return the headers that raw samples need and every answer has.

    Ridgewave-Format: `f32le;rate=48000;channels=1`. Ridgewave-Full-Scale: the SI value of a sample of 1.0, and
    Ridgewave-Quantities what it is a value of, one a channel, separated by commas.
    """
    return {
        "Ridgewave-Format": f"{sound_format};rate={voice.sample_rate};channels={voice.channels}",
        "Ridgewave-Full-Scale": ", ".join(f"{value:.17g}" for value in voice.full_scale),
        "Ridgewave-Quantities": ", ".join(voice.quantities),
        "Cache-Control": "no-store",
    }


def metadata_of(voice: Sounding, scene: Scene) -> Metadata:
    """Return what the file says about itself."""
    return Metadata(tuple(voice.full_scale), tuple(voice.quantities), scene_document(scene))
