"""The log of a live session: every event that affected its samples, with its frame. A recording contains the log.

Stage   3 (VOICE). `hand_voice` writes it, `recording` reads it.
Model   An event is a list: frame, name, values.
            [frame, "contact", seq, time, position, speed, load, across, direction]
                                       an update, from this frame on; null: not given. The last two values are left
                                       out if neither was given
            [frame, "lift"]            the finger is lifted
            [frame, "scene", scene]    a change of scene, applied as soon as possible
            [frame, "release"]         the fade at the end
Limits  The log takes at most LARGEST_BYTES of memory. A full log keeps its events and ignores new ones.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from synth.errors import Fault, SceneError

FORMAT, VERSION = "ridgewave-recording", 6
LARGEST_BYTES = 128 << 20  # 470,000 updates, 1.3 h at 100 per second; more would take memory that other sessions need
EVENT_BYTES = 280  # memory of an update, and of any other event without its document
BYTES_PER_CHARACTER = 10  # memory of a scene per character of its JSON: a number takes 32 bytes and about 4 characters

Event = list[Any]


def is_recording(document: Mapping[str, object]) -> bool:
    """Return whether a JSON object is a recording rather than a scene."""
    return document.get("format") == FORMAT


def require_scene(document: object) -> None:
    """Raise SceneError if `document` is a recording, whose motion cannot be changed or planned."""
    if isinstance(document, Mapping) and is_recording(document):
        hint = "`render` renders a recording. Use its first scene, the field scene, for anything else."
        raise SceneError([Fault("/format", FORMAT, "a scene", hint)])


class HandLog:
    """Events in the order in which they happened."""

    def __init__(self) -> None:
        self.events: list[Event] = []
        self.used_bytes = 0
        self.ended_at: int | None = None
        self.cut_frames = 0
        """Number of frames at the end that were faded after rendering."""

    def note(self, frame: int, name: str, *values: Any) -> None:
        """Log an event. If there is no room for it, the log ends here."""
        needed = EVENT_BYTES + (BYTES_PER_CHARACTER * len(json.dumps(values[0])) if name == "scene" else 0)
        if self.used_bytes + needed > LARGEST_BYTES:
            self.end(frame)
        if self.ended_at is None:
            self.events.append([frame, name, *values])
            self.used_bytes += needed

    def end(self, frame: int) -> None:
        """Ignore all events from `frame` on."""
        if self.ended_at is None:
            self.ended_at = frame
