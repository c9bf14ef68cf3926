"""Streams opened and scenes changed: what takes milliseconds to seconds, for threads."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from service import problems
from service.engine import Engine, HandVoice
from service.live.stream import Options, Stream
from service.problems import Problem
from service.sessions import changed_scene, with_full_scale
from synth.errors import RidgewaveError
from synth.scene import Scene, parse_scene


def open_stream(engine: Engine, name: str, document: Mapping[str, Any], options: Options, max_silence: float) -> Stream:
    """Return a stream of the scene `document`, its full scale written out; raises SceneError and CannotRender."""
    scene = parse_scene(document)
    voice = engine.open_hand(scene, record=options.record)
    pinned = with_full_scale(scene, tuple(voice.full_scale))
    if pinned != scene:
        voice.close()
        voice = engine.open_hand(pinned, record=options.record)
    return Stream(name, voice, pinned, options, max_silence)


@dataclass(frozen=True, slots=True)
class Prepared:
    """What partial scenes came to: the scene and its change, None where none was accepted; and what was refused.

    seconds: what it took to solve the change.
    """

    coming: tuple[Scene, Any] | None
    refused: Sequence[Problem]
    seconds: float = 0.0


def prepare_change(voice: HandVoice, scene: Scene, patches: Sequence[Mapping[str, Any]]) -> Prepared:
    """Return the change of `scene` by all of `patches`, in order; one that is refused is left out."""
    refused: list[Problem] = []
    target = scene
    for patch in patches:
        try:
            target = changed_scene(target, patch, tuple(voice.full_scale))
        except (RidgewaveError, Problem) as error:
            refused.append(as_problem(error))
    if len(refused) == len(patches):
        return Prepared(None, refused)
    began = time.perf_counter()
    try:
        change = voice.prepare(target)
        return Prepared((target, change), refused, time.perf_counter() - began)
    except (RidgewaveError, Problem) as error:
        return Prepared(None, [*refused, as_problem(error)])


def as_problem(error: RidgewaveError | Problem) -> Problem:
    """Return the problem that a refusal is."""
    return error if isinstance(error, Problem) else problems.of(error)
