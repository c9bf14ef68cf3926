"""`ridgewave render SCENE -o OUT`: renders a scene, or a recording of a live session, to a sound file.

The file is written block by block, so memory does not grow with its length. Float formats hold value / full scale.
Integer formats pass the safety limiter first, because integers clip.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from clients.command_line.exit_codes import DONE, invalid_request
from clients.command_line.output_file import Target, read_target, replaces
from clients.command_line.printing import print_json, say, warn
from clients.command_line.progress import Progress, Waiting
from clients.command_line.scene_argument import check_unchanged, read_document, scene_of
from service.store.own_textures import with_imported
from synth import Scene, open_voice
from synth.encode.formats import Metadata, open_writer
from synth.scene.effects_section import unit_of
from synth.scene.scene import scene_document
from synth.voice.fades import reduction_warning
from synth.voice.hand_log import is_recording

if TYPE_CHECKING:
    from synth.voice.limiter import Limiter

BLOCK_FRAMES = 1 << 14  # larger only takes memory, smaller costs more time in Python


def run(arguments: argparse.Namespace) -> int:
    """Carry out the command; raises InvalidRequest, CannotRender, OSError."""
    target = read_target(arguments.output, arguments.subtype)
    replaced = target.path is not None and replaces(target.path, arguments.no_clobber)
    document = read_document(arguments.scene, everyday=arguments.everyday)
    if is_recording(document):
        check_unchanged(arguments, "a recording")
        with_imported({})  # its scenes may have surfaces of the user's store
        result = render_recording(target, document, arguments.progress, exact=arguments.exact)
    elif arguments.exact:
        invalid_request(
            "--exact", "true", "a recording of a live session", "Leave it out: the file of a scene is always solved."
        )
    else:
        result = render_to(target, scene_of(document, arguments), arguments.progress)
    result["replaced"] = replaced
    if not arguments.json:
        for text in result["warnings"]:
            warn(text)
        if replaced:
            say(f"replaced {target.name}, which existed; --no-clobber keeps existing files")
    place = sys.stderr if target.path is None else sys.stdout  # standard error, if standard output carries the sound
    if arguments.json:
        print_json(result, place)
    else:
        print(_summary(result), file=place)
    return DONE


def render_to(target: Target, scene: Scene, progress: bool | None) -> dict[str, Any]:
    """Render `scene` into `target`; return the result as `--json` prints it."""
    started = time.perf_counter()
    with Waiting("solving the contact", progress):
        voice = open_voice(scene)
    return _written(target, voice, scene, round(scene.output.duration * voice.sample_rate), started, progress)


def render_recording(
    target: Target, document: Mapping[str, Any], progress: bool | None, *, exact: bool = False
) -> dict[str, Any]:
    """Render the recording of a live session into `target`; return the result as `--json` prints it.

    The samples are those that were sent or, if `exact`, those of the same motion within the scene's tolerance.
    """
    from synth.voice.recording import Recording

    started = time.perf_counter()
    with Waiting("solving the contact", progress):
        replay = Recording(document).open(exact=exact)
    return _written(target, replay, replay.scene, replay.frames, started, progress, document)


def _written(
    target: Target,
    voice: Any,
    scene: Scene,
    frames: int,
    started: float,
    progress: bool | None,
    recording: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Write `frames` of `voice`; return the result.

    started: time at which its preparation began.
    recording: document of the recording that is rendered; the file keeps it.
    """
    ready = time.perf_counter()
    rate = voice.sample_rate
    limiter = None if target.sound_format.is_float else _limiter(voice.channels, rate)
    metadata = Metadata(voice.full_scale, voice.quantities, scene_document(scene), recording=recording)
    place: Any = _standard_output() if target.path is None else target.path
    peaks = np.zeros(voice.channels)
    blocks = (voice.render(min(BLOCK_FRAMES, frames - done)) for done in range(0, frames, BLOCK_FRAMES))
    with (
        Progress("rendering", frames / rate, "s", progress) as bar,
        open_writer(place, target.sound_format, rate, voice.channels, metadata, frames=frames) as writer,
    ):
        for block in blocks if limiter is None else limiter.limited(blocks):
            writer.write(block)
            np.maximum(peaks, np.abs(block).max(axis=0), out=peaks)
            bar.advance(len(block) / rate)
    reduction_db = 0.0 if limiter is None else limiter.take_reduction()
    seconds, rendering = frames / rate, time.perf_counter() - ready
    channels = [
        {"quantity": quantity, "unit": unit_of(quantity), "full_scale": full_scale, "peak": float(peak)}
        for quantity, full_scale, peak in zip(voice.quantities, voice.full_scale, peaks, strict=True)
    ]
    return {
        "file": target.name,
        "format": str(target.sound_format),
        "seconds": seconds,
        "frames": frames,
        "sample_rate": rate,
        "channels": channels,
        "setup_seconds": ready - started,
        "render_seconds": rendering,
        "times_real_time": seconds / rendering,
        "gain_reduction_db": reduction_db,
        "warnings": [*voice.warnings, *reduction_warning(reduction_db)],
    }


def _limiter(channels: int, rate: int) -> Limiter:
    """Return the safety limiter, which only integer formats import."""
    from synth.voice.limiter import Limiter, look_ahead

    return Limiter(channels, rate, look_ahead(rate))


def _standard_output() -> BinaryIO:
    return sys.stdout.buffer


def _summary(result: dict[str, Any]) -> str:
    lines = [f"{result['file']}: {result['seconds']:.6g} s at {result['sample_rate']} Hz, {result['format']}"]
    for channel in result["channels"]:
        unit, full_scale, peak = channel["unit"], channel["full_scale"], channel["peak"]
        level = f"peak {peak:.4f} ({peak * full_scale:.4g} {unit})"
        lines.append(f"{channel['quantity']}: full scale {full_scale:.6g} {unit}, {level}")
    lines.append(
        f"set up in {result['setup_seconds']:.3f} s, rendered in {result['render_seconds']:.3f} s: "
        f"{result['times_real_time']:.0f} times real time"
    )
    return "\n".join(lines)
