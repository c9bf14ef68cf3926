"""Save a whole sound as a file: WAV, FLAC, PCM (`formats`), or its values as NPY and CSV.

Stage: part of STAGE 4 (encode).
Limits: the whole sound is in memory.
"""

from __future__ import annotations

import io
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np

from synth.encode.formats import ENDINGS, Metadata, choose_format, open_writer
from synth.encode.part_file import write_whole
from synth.encode.scaled_frames import ScaledFrames
from synth.errors import Fault, InvalidRequest, RenderWarning, shown
from synth.voice.fades import reduction_warning

TABLES = (".npy", ".csv")


def save_frames(sound: ScaledFrames, metadata: Metadata | None, target: Path, subtype: str | None) -> Path:
    """Write `sound` to `target`, as `Sound.save` describes, and return `target`."""
    if not np.isfinite(sound.frames).all():
        frame = int(np.argwhere(~np.isfinite(sound.frames))[0, 0])
        value = f"{sound.frames[frame].tolist()} in frame {frame}"
        raise InvalidRequest([Fault("/frames", value, "finite numbers", "Correct the frames, or cut them out.")])
    if target.suffix.lower() in TABLES:
        if subtype is not None:
            raise InvalidRequest([Fault("/subtype", shown(subtype), "nothing for a table", "Leave it out.")])
        write_whole(target, _npy(sound) if target.suffix.lower() == ".npy" else _csv(sound))
        return target
    if target.suffix.lower() not in ENDINGS:
        allowed = f"a name that ends in {', '.join([*ENDINGS, *TABLES])}"
        raise InvalidRequest([Fault("/path", shown(str(target)), allowed, "Write, for instance, out.wav.")])
    sound_format = choose_format(target, subtype)
    frames, reduction = sound.frames, 0.0
    channels = frames.shape[1]
    if not sound_format.is_float:
        from synth.voice.limiter import Limiter

        limiter = Limiter(channels, sound.sample_rate)
        frames, reduction = limiter.process(frames), limiter.take_reduction()
        for sentence in reduction_warning(reduction):
            warnings.warn(sentence, RenderWarning, stacklevel=4)
    if metadata is not None:
        metadata = replace(metadata, gain_reduction_db=reduction)
    with open_writer(target, sound_format, sound.sample_rate, channels, metadata, frames=len(frames)) as writer:
        writer.write(frames)
    return target


def _npy(sound: ScaledFrames) -> bytes:
    body = io.BytesIO()
    np.save(body, sound.values)
    return body.getvalue()


def _csv(sound: ScaledFrames) -> bytes:
    names = [
        f"{quantity} ({unit})" if unit else quantity
        for quantity, unit in zip(sound.quantities, sound.units, strict=True)
    ]
    body = io.StringIO()
    np.savetxt(
        body,
        np.column_stack([sound.times, sound.values]),
        fmt="%.9g",
        delimiter=",",
        header=",".join(["time (s)", *names]),
        comments="",
    )
    return body.getvalue().encode("ascii")
