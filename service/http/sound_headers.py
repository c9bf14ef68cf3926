"""The description of a sound: headers of its answer, and metadata inside its file."""

from __future__ import annotations

from service.engine import Sounding
from synth.encode.formats import Metadata, SoundFormat


def describe(voice: Sounding, sound_format: SoundFormat) -> dict[str, str]:
    """Return the headers of an answer with sound.

    Ridgewave-Format: for example `f32le;rate=48000;channels=1`.
    Ridgewave-Full-Scale: the SI value of a sample of 1.0, one per channel, separated by commas.
    Ridgewave-Quantities: the quantity of each channel, separated by commas.
    """
    return {
        "Ridgewave-Format": f"{sound_format};rate={voice.sample_rate};channels={voice.channels}",
        "Ridgewave-Full-Scale": ", ".join(f"{value:.17g}" for value in voice.full_scale),
        "Ridgewave-Quantities": ", ".join(voice.quantities),
        "Cache-Control": "no-store",
    }


def metadata_of(voice: Sounding, scene: bytes) -> Metadata:
    """Return the metadata inside the file. scene: its JSON, as `scene_text` makes it."""
    return Metadata(tuple(voice.full_scale), tuple(voice.quantities), scene)
