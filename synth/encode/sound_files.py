"""Read a sound file into a `Sound`: WAV, FLAC, and what else libsndfile reads.

Stage: part of STAGE 4 (encode). libsndfile reads the samples.
Model: a file of ridgewave has its full scale, quantities and scene (`sound_metadata`), so that its values are known in
    SI. Integers are read as n / 2**(bits - 1). A file of another program has samples without a scale.
Limits: the samples of a float WAV are those of the render, bit for bit; of integers, within half a step. A program that
    changes the level of a file and keeps its comment makes the scale wrong, which cannot be seen.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from synth.encode.flac import NO_LIBRARY
from synth.encode.formats import ENDINGS
from synth.encode.scaled_frames import UNSCALED
from synth.encode.sound import Sound
from synth.errors import CannotRender, Fault, InvalidRequest, shown
from synth.scene.sound_scene import metadata_in, scene_of_metadata
from synth.voice.fades import reduction_warning

RAW = [ending for ending, formats in ENDINGS.items() if next(iter(formats.values())).container == "raw"]


def load(path: Path) -> Sound:
    """Return the sound in a file, with its scale and its scene if ridgewave wrote it.

    Raises InvalidRequest for a file that is no sound, CannotRender if libsndfile is missing, OSError.
    """
    frames, sample_rate, metadata = _read(path)
    scale = None if metadata is None else _scale(metadata, frames.shape[1])
    if metadata is None or scale is None:
        sentence = f"{path} has no scale of ridgewave: its values are samples, not in SI units, and it has no scene."
        channels = frames.shape[1]
        return Sound(frames, sample_rate, (1.0,) * channels, (UNSCALED,) * channels, None, (sentence,))
    reduction = metadata.get("gain_reduction_db", 0.0)
    told = reduction_warning(reduction) if isinstance(reduction, int | float) else ()
    asked = metadata.get("scene")
    scene = scene_of_metadata({**metadata, "recording": None}) if isinstance(asked, dict) else None
    return Sound(frames, sample_rate, *scale, scene, told, None, _recording(metadata))


def _read(path: Path) -> tuple[Any, int, dict[str, Any] | None]:
    try:
        import soundfile
    except (ImportError, OSError) as error:
        raise CannotRender(NO_LIBRARY) from error
    if path.suffix.lower() in RAW:
        _refuse(path, f"A {path.suffix} file has samples only: read it with numpy.fromfile.")
    try:
        with path.open("rb") as file:
            metadata = metadata_in(file)
            file.seek(0)
            frames, sample_rate = soundfile.read(file, dtype="float32", always_2d=True)
    except FileNotFoundError:
        _refuse(path, "There is no such file. Check the path.")
    except IsADirectoryError:
        _refuse(path, "This is a folder. Name a file in it.")
    except soundfile.LibsndfileError as error:
        _refuse(path, f"libsndfile says: {error.error_string}")
    return frames, int(sample_rate), metadata


def _scale(metadata: dict[str, Any], channels: int) -> tuple[tuple[float, ...], tuple[str, ...]] | None:
    """Return the full scales and quantities in the metadata, or None if they are not those of `channels` channels."""
    try:
        scales = tuple(float(channel["full_scale"]) for channel in metadata["channels"])
        quantities = tuple(str(channel["quantity"]) for channel in metadata["channels"])
    except (KeyError, TypeError, ValueError):
        return None
    fits = len(scales) == channels and all(0.0 < scale < np.inf for scale in scales)
    return (scales, quantities) if fits else None


def _recording(metadata: dict[str, Any]) -> dict[str, Any] | None:
    found = metadata.get("recording")
    return found if isinstance(found, dict) else None


def _refuse(path: Path, hint: str) -> NoReturn:
    raise InvalidRequest([Fault("/path", shown(str(path)), "a WAV or FLAC file", hint)])
