"""A live voice of each kind plays once, unheard, before one is heard: its loops are compiled where nobody waits.

Stage   3 (VOICE), beside the live voices.
Model   numba compiles a loop when it is first called with such arguments: for seconds, with all other streams of the
        process waiting if it happens where they are rendered; a loop that is on disk already is loaded in milliseconds.
        So whoever opens a voice, or prepares a change, in a thread, has a voice of that kind rehearse there: its scan,
        and whatever a hand and a change can do to it. A kind rehearses once in a process.
Limits  `kind_of` reads from the scene and its plan what decides which loops run; too fine costs a rehearsal, some
        hundredths of a second, and too coarse would be heard: tests/synth/test_live_rehearsal.py looks for that.
"""

from __future__ import annotations

import itertools
import re
import threading
from collections.abc import Callable, Hashable
from typing import Any

from synth.plan.plan import Plan
from synth.scene.scene import Scene, scene_document
from synth.voice.moving_tables import SINGLE

POINTS = 8  # of a recorded scan that rehearses; 4 is the least that a scan may have
CLOSE = 0.999  # times the scan's load: two loads between which one or two rows are solved
NUMBER = re.compile(r"[\d.]+")  # in the words of a plan, which say how many harmonics or cells a reader has


class Rehearsals:
    """Which kinds have rehearsed. Thread-safe: who comes while a kind rehearses waits for it."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._done: set[Hashable] = set()
        self._under_way: dict[Hashable, threading.Lock] = {}

    def once(self, kind: Hashable, rehearse: Callable[[], None]) -> None:
        """Run `rehearse` unless it has been run for `kind`; where it raises, the next to come runs it again."""
        with self._lock:
            if kind in self._done:
                return
            turn = self._under_way.setdefault(kind, threading.Lock())
        with turn:
            with self._lock:
                if kind in self._done:
                    return
            rehearse()
            with self._lock:
                self._done.add(kind)
                self._under_way.pop(kind, None)


REHEARSALS = Rehearsals()
"""Of this process: what numba has compiled is the process's too."""


def kind_of(scene: Scene, plan: Plan) -> Hashable:
    """Return what decides which loops a live voice of `scene` runs: all of the scene but its numbers, and its plan."""
    document, response = scene_document(scene), plan.response
    return (
        shape_of({name: document[name] for name in ("texture", "scan", "effects", "output") if name in document}),
        tuple(part.name for part in plan.simulated),
        response["method"],
        tuple(NUMBER.sub("", channel["reader"]) for channel in response["channels"]),
        response["tolerance"] >= SINGLE,
    )


def stand_in(scene: Scene) -> Scene:
    """Return a scene of the same kind for a rehearsal: the beginning of a recorded scan, at loads next to each other.

    Every voice of a recorded scan solves all of its loads for itself, for seconds: too long for what nobody hears.
    """
    scan = scene.scan
    if scan.trajectory is None:
        return scene
    loads = itertools.cycle((scan.load, CLOSE * scan.load))
    points = tuple((time, place, load) for (time, place, _), load in zip(scan.trajectory[:POINTS], loads, strict=False))
    return scene.model_copy(update={"scan": scan.model_copy(update={"trajectory": points})})


def shape_of(value: Any) -> Hashable:
    """Return a document without its numbers: lists of numbers, however long, are alike."""
    if isinstance(value, dict):
        return tuple((name, shape_of(part)) for name, part in sorted(value.items()))
    if isinstance(value, list):
        parts = [shape_of(part) for part in value]
        return parts[0] if parts and len(set(parts)) == 1 and isinstance(value[0], list) else tuple(parts)
    return float if isinstance(value, int | float) and not isinstance(value, bool) else value
