"""The log of a live session: every event that decided its samples, each with its frame. A recording contains it.

Stage   3 (VOICE). `hand_voice` writes it, `recording` reads it.
Model   An event is a list: frame, name, values.
            [frame, "contact", seq, time, position, speed, load]   an update, from this frame on; null: not given
            [frame, "lift"]                                        the finger is lifted
            [frame, "scene", scene]                                a change of scene, begun as soon as possible
            [frame, "release"]                                     the fade at the end
Limits  It takes LARGEST_BYTES of memory at most. When it is full it takes no more events and keeps the earlier ones.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from synth.motion.motion import Update

FORMAT, VERSION = "ridgewave-recording", 3
LARGEST_BYTES = 128 << 20  # 470,000 updates, 1.3 h at 100 per second; more would take memory that other sessions need
EVENT_BYTES = 280  # memory of an update, and of any other event without its document
BYTES_PER_CHARACTER = 10  # memory of a scene per character of its JSON: a number takes 32 bytes and about 4 characters

Event = list[Any]


def is_recording(document: Mapping[str, object]) -> bool:
    """Return whether a JSON object is a recording rather than a scene."""
    return document.get("format") == FORMAT


class HandLog:
    """Events in the order in which they happened."""

    def __init__(self) -> None:
        self.events: list[Event] = []
        self.used_bytes = 0
        self.ended_at: int | None = None
        self.cut_frames = 0
        """Number of the last frames that were faded after they had been rendered."""

    def contact(self, frame: int, update: Update) -> None:
        """Log an update."""
        self._note([frame, "contact", update.seq, update.time, update.position, update.speed, update.load])

    def lift(self, frame: int) -> None:
        """Log that the finger is lifted."""
        self._note([frame, "lift"])

    def release(self, frame: int) -> None:
        """Log the fade at the end."""
        self._note([frame, "release"])

    def cut(self, frames: int) -> None:
        """Log that the last `frames` were faded after they had been rendered."""
        self.cut_frames = frames

    def scene(self, frame: int, document: dict[str, Any]) -> None:
        """Log a change to the scene of `document`."""
        self._note([frame, "scene", document], BYTES_PER_CHARACTER * len(json.dumps(document)))

    def end(self, frame: int) -> None:
        """Take no more events, from `frame` on."""
        if self.ended_at is None:
            self.ended_at = frame

    def _note(self, event: Event, more_bytes: int = 0) -> None:
        if self.used_bytes + EVENT_BYTES + more_bytes > LARGEST_BYTES:
            self.end(event[0])
        if self.ended_at is None:
            self.events.append(event)
            self.used_bytes += EVENT_BYTES + more_bytes
