"""What a hand told of itself: one update of a contact.

Stage: MOTION.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Update:
    """Where the hand is (m) or how fast it moves (m/s), one of them None; its load (N), None: the last one stays.

    seq: rises with each update. time: s on the client's own clock.
    """

    seq: int
    time: float
    position: float | None
    speed: float | None
    load: float | None
