"""`ridgewave render SCENE -o OUT`: a scene in, a sound file out, in the memory of a few blocks."""

from __future__ import annotations

import argparse
import sys
import time
from typing import Any, BinaryIO

from clients.export import Export, export
from clients.outcome import DONE, print_json, warn
from clients.progress import Progress
from clients.scene_argument import read_scene
from clients.target import Target, read_target
from synth import Scene, open_voice
from synth.encode import Metadata, open_writer
from synth.output import Limiter, look_ahead, reduction_warning
from synth.scene import scene_document
from synth.sound_metadata import UNITS


def run(arguments: argparse.Namespace) -> int:
    """Carry out the command; raises AskedWrong, CannotRender, OSError."""
    target = read_target(arguments.output, arguments.subtype)
    result = render_to(target, read_scene(arguments), arguments.progress)
    if not arguments.json:
        for text in result["warnings"]:
            warn(text)
    if target.path is None:
        # Standard output carries the sound, so the result goes where the messages go.
        print(_summary(result), file=sys.stderr)
    elif arguments.json:
        print_json(result)
    else:
        print(_summary(result))
    return DONE


def render_to(target: Target, scene: Scene, progress: bool | None) -> dict[str, Any]:
    """Render `scene` into `target` and return the result, in the words of `--json`."""
    started = time.perf_counter()
    voice = open_voice(scene)
    ready = time.perf_counter()
    rate = voice.sample_rate
    frames = round(scene.output.duration * rate)
    limiter = None if target.sound_format.is_float else Limiter(voice.channels, rate, look_ahead(rate))
    metadata = Metadata(voice.full_scale, voice.quantities, scene_document(scene))
    place: Any = _standard_output() if target.path is None else target.path
    with (
        Progress("rendering", frames / rate, "s", progress) as bar,
        open_writer(place, target.sound_format, rate, voice.channels, metadata, frames=frames) as writer,
    ):
        written = export(voice, writer, frames, limiter, lambda count: bar.advance(count / rate))
    return _result(target, voice, written, ready - started, time.perf_counter() - ready)


def _standard_output() -> BinaryIO:
    return sys.stdout.buffer


def _result(target: Target, voice: Any, written: Export, setup: float, rendering: float) -> dict[str, Any]:
    seconds = written.frames / voice.sample_rate
    channels = [
        {"quantity": quantity, "unit": UNITS[quantity], "full_scale": full_scale, "peak": peak}
        for quantity, full_scale, peak in zip(voice.quantities, voice.full_scale, written.peaks, strict=True)
    ]
    return {
        "file": target.name,
        "format": str(target.sound_format),
        "seconds": seconds,
        "frames": written.frames,
        "sample_rate": voice.sample_rate,
        "channels": channels,
        "setup_seconds": setup,
        "render_seconds": rendering,
        "times_real_time": seconds / rendering,
        "gain_reduction_db": written.reduction_db,
        "warnings": [*voice.warnings, *reduction_warning(written.reduction_db)],
    }


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
