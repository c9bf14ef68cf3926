"""Read a sound file into a `Sound`: WAV, FLAC, and what else libsndfile reads.

Stage: part of STAGE 4 (encode). libsndfile reads the samples.
Model: a file of ridgewave has its full scale, quantities and scene (`sound_metadata`), so that its values are known in
    SI. Integers are read as n / 2**(bits - 1). A file of another program has samples without a scale.
Limits: the samples of a float WAV are those of the render, bit for bit; of integers, within half a step. A program that
    changes the level of a file and keeps its comment makes the scale wrong, which cannot be seen.
"""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import Any, BinaryIO, NoReturn

import numpy as np

from synth.encode.flac import NO_LIBRARY
from synth.encode.formats import ENDINGS
from synth.encode.scaled_frames import UNSCALED
from synth.encode.sound import Sound
from synth.errors import CannotRender, Fault, InvalidRequest, shown
from synth.scene.sound_scene import HEAD_BYTES, declared_frames, is_sound, metadata_in, scene_of_metadata
from synth.voice.fades import reduction_warning

RAW = [ending for ending, formats in ENDINGS.items() if next(iter(formats.values())).container == "raw"]


def load(source: Path | BinaryIO) -> Sound:
    """Return the sound in a file, with its scale and its scene if ridgewave wrote it.

    source: a path, or a binary file that is open for reading and can seek.
    Raises InvalidRequest for a file that is no sound, CannotRender if libsndfile is missing, OSError.
    """
    frames, sample_rate, metadata, declared = _read(source)
    scale = None if metadata is None else _scale(metadata, frames.shape[1])
    if metadata is None or scale is None:
        called = _called(source)
        sentence = f"{called} has no scale of ridgewave: its values are samples, not in SI units, and it has no scene."
        channels = frames.shape[1]
        return Sound(frames, sample_rate, (1.0,) * channels, (UNSCALED,) * channels, None, (sentence,))
    reduction = metadata.get("gain_reduction_db", 0.0)
    told = reduction_warning(reduction) if isinstance(reduction, int | float) else ()
    if declared is not None and len(frames) < declared:
        told = (f"{_called(source)} is incomplete: its header says {declared} frames, and it has {len(frames)}.", *told)
    asked = metadata.get("scene")
    scene = scene_of_metadata({**metadata, "recording": None}) if isinstance(asked, dict) else None
    return Sound(frames, sample_rate, *scale, scene, told, None, _recording(metadata))


def _read(source: Path | BinaryIO) -> tuple[Any, int, dict[str, Any] | None, int | None]:
    """Return the frames, the sample rate, the metadata, and the number of frames that the header of a WAV says."""
    try:
        import soundfile
    except (ImportError, OSError) as error:
        raise CannotRender(NO_LIBRARY) from error
    if isinstance(source, Path) and source.suffix.lower() in RAW:
        _refuse(source, f"A {source.suffix} file has samples only: read it with numpy.fromfile.")
    head = b""
    try:
        with source.open("rb") if isinstance(source, Path) else nullcontext(source) as file:
            file.seek(0)
            head, metadata, declared = file.read(HEAD_BYTES), metadata_in(file), declared_frames(file)
            file.seek(0)
            frames, sample_rate = soundfile.read(file, dtype="float32", always_2d=True)
    except FileNotFoundError:
        _refuse(source, "There is no such file. Check the path.")
    except IsADirectoryError:
        _refuse(source, "This is a folder. Name a file in it.")
    except soundfile.LibsndfileError as error:
        cut = "The file is incomplete or damaged: copy it again. " if is_sound(head) else ""
        _refuse(source, f"{cut}libsndfile says: {error.error_string}" if head else "The file is empty.")
    return frames, int(sample_rate), metadata, declared


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


def _called(source: Path | BinaryIO) -> str:
    return str(source) if isinstance(source, Path) else "The file"


def _refuse(source: Path | BinaryIO, hint: str) -> NoReturn:
    value = shown(str(source)) if isinstance(source, Path) else "an open file"
    raise InvalidRequest([Fault("/path", value, "a WAV or FLAC file", hint)])
