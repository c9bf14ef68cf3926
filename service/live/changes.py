"""Streams opened and scenes changed: what takes milliseconds to seconds, for threads."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from typing import Any

from service import problems
from service.engine import Engine
from service.live.live_stream import Options, Stream
from service.problems import Problem
from service.sessions.scene_changes import Merged, Waiting, merged
from service.sessions.scene_session import changed_scene, with_full_scale
from synth.errors import RidgewaveError
from synth.scene.scene import Scene, parse_scene


def open_stream(engine: Engine, name: str, document: Mapping[str, Any], options: Options, max_silence: float) -> Stream:
    """Return a stream of the scene `document`, its full scale written out; raises SceneError and CannotRender."""
    scene = parse_scene(document)
    voice = engine.open_hand(scene, record=options.record)
    pinned = with_full_scale(scene, tuple(voice.full_scale))
    if pinned != scene:
        voice = engine.open_hand(pinned, record=options.record)
    return Stream(name, voice, pinned, options, max_silence)


def prepare_change(stream: Stream, batch: Sequence[Waiting]) -> tuple[Merged, float]:
    """Return the change of the stream's scene by all of `batch`, and the seconds that it took."""
    scale, began = tuple(stream.voice.full_scale), time.perf_counter()

    def change(scene: Scene, patch: Mapping[str, Any]) -> Scene:
        return changed_scene(scene, patch, scale)

    return merged(stream.scene, batch, change, stream.voice.prepare), time.perf_counter() - began


def as_problem(error: RidgewaveError | Problem) -> Problem:
    """Return the problem that a refusal is."""
    return error if isinstance(error, Problem) else problems.of(error)
