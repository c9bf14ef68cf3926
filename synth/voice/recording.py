"""Recordings of live sessions: a document of everything that affected the samples, and a replay of them.

Stage   3 (VOICE), after `hand_voice`.
Model   A recording is {"format": "ridgewave-recording", "version": 6, "scene", "full_scale", "frames", "faded",
        "events"}: the first scene, the SI value of 1.0, the number of frames sent, the number of frames at the end that
        were faded after rendering, and the events of `hand_log`. A replay applies each event before its frame.
        A scene of version 1 without a bandwidth is read as having the full band (`scene_before_bands`).
        Versions 1 and 2 also contain the time at which each load was solved. A replay ignores it, so its samples agree
        to the error of the table.
Source  design, section 4 (recording).
Limits  The samples are the same bits with the same versions on the same kind of processor. A full log is replayed up
        to the frame at which it became full.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from synth.arrays import Block
from synth.errors import Fault, SceneError, shown
from synth.motion.motion import Update
from synth.plan.effect_choice import added_quantities
from synth.plan.usual_hand import with_full_scale
from synth.response_cache import ResponseCache
from synth.scene.merge import scene_before_bands
from synth.scene.scene import Scene, parse_scene
from synth.voice.fades import end_gains, under
from synth.voice.hand_log import FORMAT, VERSION, Event
from synth.voice.hand_voice import HandVoice
from synth.voice.live_voice import fixed_faults

LONGEST_BLOCK = 1 << 14  # frames rendered together
VERSIONS = (1, 2, 3, 4, 5, VERSION)  # versions that can be read
OLD_EVENTS = ("rows", "refine")  # ignored events of versions 1 and 2: the time at which each load was solved
OTHER_ENGINE = (
    "This recording was made before response tables: the motion and the scene are those of the session, but the "
    "samples differ by the interpolation error between the loads that were solved at that time.",
)
BEFORE_TABLES = 3  # first version of an engine with response tables
EARLIER = {
    3: "This recording was made by an earlier version: where the hand touched before the first block, its first second "
    "is up to 1.5 ms later here than it was heard.",
    4: "This recording was made by an earlier version: where updates paused while the finger moved, the finger is put "
    "at its new place here, and then swept to it.",
    5: "This recording was made by an earlier version: where the stream stood still or ran ahead for a moment, the "
    "finger was then swept to its new place, or stood still for longer than here.",
}
"""By the last version of which it is true."""
SCALES = 1e-24, 1e9  # SI: the widest range of FULL_SCALE_RANGES
MOST_WHOLE = 1 << 53  # up to here every JSON reader keeps whole numbers exactly
AS_DOWNLOADED = "Keep the recording as it was downloaded."


class Recording:
    """A recording, read and checked. Raises SceneError, with a pointer to the fault, for any other document."""

    def __init__(self, document: Mapping[str, Any]) -> None:
        self.scene, self.full_scale, self.frames = _read_head(document)
        self.faded = document.get("faded", 0)  # number of frames at the end that were faded after rendering
        if not _is_whole(self.faded) or self.faded > self.frames:
            allowed = f"a whole number of frames, 0 to {self.frames}"
            raise _refusal("/faded", shown(self.faded), allowed, AS_DOWNLOADED)
        events: list[Event] = document["events"]
        first = 0
        for place, event in enumerate(events):
            first = _checked(event, place, first)
        self.version = int(document["version"])
        kept = tuple(event for event in events if event[1] not in OLD_EVENTS)
        self.events = tuple(map(_in_full_band, kept)) if self.version == 1 else kept

    def open(self, cache: ResponseCache | None = None, *, exact: bool = False) -> Replay:
        """Return its replay at frame 0. This solves the first scene.

        exact: tables are made to the scene's tolerance, instead of the tables of the session.
        """
        return Replay(self, cache, exact=exact)


class Replay:
    """The replay of a session: `render` returns its samples, in blocks of any length.

    scene: the first scene.
    frames: number of frames of the session.
    voice: the voice that renders the scene of the present frame.
    sample_rate, channels, quantities, full_scale: as of a voice.
    """

    def __init__(self, recording: Recording, cache: ResponseCache | None = None, *, exact: bool = False) -> None:
        self.scene, self.frames = recording.scene, recording.frames
        self._events, self._next = recording.events, 0
        self._fade_from, self._fade = self.frames - recording.faded, end_gains(recording.faded)
        self.voice = HandVoice(recording.scene, cache=cache, exact=exact)
        told = (text for last, text in EARLIER.items() if recording.version <= last)
        self._doubts = OTHER_ENGINE if recording.version < BEFORE_TABLES else tuple(told)
        self.sample_rate, self.channels = self.voice.sample_rate, self.voice.channels
        self.quantities, self.full_scale = self.voice.quantities, self.voice.full_scale
        if len(self.full_scale) != len(recording.full_scale):
            value = ", ".join(f"{scale:g}" for scale in recording.full_scale)
            raise _refusal("/full_scale", value, f"{self.channels} numbers, one per channel", AS_DOWNLOADED)

    @property
    def warnings(self) -> tuple[str, ...]:
        """The warnings of the present scene, and of a recording of an earlier version."""
        return (*self._doubts, *self.voice.warnings)

    def render(self, frames: int) -> Block:
        """Return the next `frames` frames as they were sent, float32 [frames, channels]."""
        first, block = self.voice.frame, np.empty((frames, self.channels), np.float32)
        done = 0
        while done < frames:
            while self._next < len(self._events) and self._events[self._next][0] <= self.voice.frame:
                _apply(self._events[self._next], self.voice)
                self._next += 1
            ahead = self._events[self._next][0] - self.voice.frame if self._next < len(self._events) else frames
            count = min(frames - done, ahead, LONGEST_BLOCK)
            block[done : done + count] = self.voice.render(count)
            done += count
        return self._ended(block, first)

    def _ended(self, block: Block, first: int) -> Block:
        """Return `block`, which begins at frame `first`, with the fade of the last frames applied."""
        begin, end = max(first, self._fade_from), min(first + len(block), self.frames)
        if begin < end:
            last = block[begin - first : end - first]
            last[:] = under(last, self._fade[begin - self._fade_from : end - self._fade_from])
        return block


def _apply(event: Event, voice: HandVoice) -> None:
    """Apply an event to the voice."""
    name = event[1]
    if name == "contact":
        voice.touch(Update(*event[2:]))
    elif name == "lift":
        voice.lift()
    elif name == "release":
        voice.release()
    elif name == "scene":
        scene = parse_scene(event[2])
        if len(scene.output.channel_list) + len(added_quantities(scene)) != voice.channels:
            raise SceneError(fixed_faults(voice.scene, scene))
        voice.apply(voice.prepare(with_full_scale(scene, voice.full_scale)))


def _read_head(document: Mapping[str, Any]) -> tuple[Scene, tuple[float, ...], int]:
    """Return the scene (with its full scale), the full scale of each channel, and the number of frames."""
    version = document.get("version")
    if document.get("format") != FORMAT or isinstance(version, bool) or version not in VERSIONS:
        value, allowed = f"{document.get('format')} {shown(version)}", f"{FORMAT} 1 to {VERSION}"
        raise _refusal("/version", value, allowed, "Download the recording from a live session.")
    frames, events, scales = document.get("frames"), document.get("events"), document.get("full_scale")
    if not _is_whole(frames):
        value = "nothing" if frames is None else shown(frames)
        raise _refusal("/frames", value, "a whole number of frames", AS_DOWNLOADED)
    if not isinstance(events, list):
        raise _refusal("/events", shown(events), "a list of events", AS_DOWNLOADED)
    if not isinstance(scales, list) or not scales or not all(map(_is_scale, scales)):
        low, high = SCALES
        allowed = f"a list of numbers from {low:g} to {high:g} in the SI unit of the quantity, one per channel"
        raise _refusal("/full_scale", shown(scales), allowed, AS_DOWNLOADED)
    asked = document.get("scene")
    if version == 1 and isinstance(asked, dict):
        asked = scene_before_bands(asked)
    scene, scale = parse_scene(asked), tuple(float(scale) for scale in scales)
    if len(scale) < len(scene.output.channel_list):
        raise _refusal("/full_scale", shown(scales), "one number per channel", AS_DOWNLOADED)
    assert isinstance(frames, int)
    return with_full_scale(scene, scale), scale, frames


def _in_full_band(event: Event) -> Event:
    """Return an event of version 1 with its scene as this version writes it."""
    return [*event[:2], scene_before_bands(event[2])] if event[1] == "scene" else event


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= sys.float_info.max


def _is_scale(value: object) -> bool:
    return _is_number(value) and SCALES[0] <= value <= SCALES[1]  # type: ignore[operator]


def _is_whole(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value <= MOST_WHOLE


def _checked(event: object, place: int, first: int) -> int:
    """Return the frame of an event. Raises SceneError where it cannot follow an event at frame `first`."""
    at = f"/events/{place}"
    if not isinstance(event, list) or len(event) < 2 or not isinstance(event[1], str) or event[1] not in VALUES:
        raise _refusal(at, shown(event), f"[frame, one of {', '.join(VALUES)}, values]", AS_DOWNLOADED)
    frame, name, *values = event
    if not _is_whole(frame) or frame < first:
        raise _refusal(f"{at}/0", shown(frame), f"a frame from {first} on", "Events must be in order of their frames.")
    if not VALUES[name](values):
        raise _refusal(at, shown(event), f"the values of {name} as in docs/live.md", AS_DOWNLOADED)
    return int(frame)


def _is_contact(values: list[Any]) -> bool:
    if len(values) not in (5, 7) or not _is_whole(values[0]) or not _is_number(values[1]):
        return False
    numbers = all(value is None or _is_number(value) for value in values[2:])
    turned = len(values) == 7 and values[2] is None  # a place over an area has a position along x
    return numbers and not turned and (values[2] is None) != (values[3] is None)


VALUES: dict[str, Callable[[list[Any]], bool]] = {
    "contact": _is_contact,
    "lift": lambda values: not values,
    "scene": lambda values: len(values) == 1 and isinstance(values[0], dict),
    "release": lambda values: not values,
    "refine": lambda values: True,
    "rows": lambda values: True,
}
"""A check of the values of each kind of event."""


def _refusal(pointer: str, value: str, allowed: str, hint: str) -> SceneError:
    return SceneError([Fault(pointer, value, allowed, hint)])
