"""The log of a live voice that a hand moves: what decided its samples, each with its frame; the heart of a recording.

Stage   3 (VOICE), beside `hand_voice`, which writes it; `recording` reads it.
Model   An event is a list: frame, name, values.
            [frame, "contact", seq, time, position, speed, load]   an update, from this frame on; null: not given
            [frame, "lift"]                                        the finger was taken off
            [frame, "scene", scene]                                a change of scene, begun as soon as it could be
            [frame, "release"]                                     the fade that ends it
Limits  LARGEST_BYTES of memory; then it is full, and holds the beginning.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from synth.motion.motion import Update

FORMAT, VERSION = "ridgewave-recording", 3
LARGEST_BYTES = 128 << 20  # 470,000 updates: 100 a second for 1.3 h; a longer session holds memory that others need
EVENT_BYTES = 280  # of an update; of any other event without what it holds besides
BYTES_PER_CHARACTER = 10  # of a scene, by its text: a number takes 32 bytes and some four characters

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
        """The last frames, where they were faded after they had been rendered."""

    def contact(self, frame: int, update: Update) -> None:
        """Note an update."""
        self._note([frame, "contact", update.seq, update.time, update.position, update.speed, update.load])

    def lift(self, frame: int) -> None:
        """Note that the finger was taken off."""
        self._note([frame, "lift"])

    def release(self, frame: int) -> None:
        """Note the fade at the end."""
        self._note([frame, "release"])

    def cut(self, frames: int) -> None:
        """Note that the last `frames` were faded after they had been rendered."""
        self.cut_frames = frames

    def scene(self, frame: int, document: dict[str, Any]) -> None:
        """Note a change to the scene of `document`."""
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
