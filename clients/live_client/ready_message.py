"""What the service says of a live session once it is ready, and what it says of updates.

Model: the `ready` and `applied` messages as values; fields that this client does not know are left alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from clients.client_errors import ProtocolError


class Applied(NamedTuple):
    """The newest contact update that the sound follows, and the first frame that it changed."""

    seq: int
    frame: int


@dataclass(frozen=True, slots=True)
class Ready:
    """A session as it begins, or goes on.

    resume_url: where to go on with it, a path and a query; "" where any connection will do.
    frame: of the first sample to come. full_scale: the SI value of a sample of 1.0, one a channel.
    max_silence: seconds without a contact after which the service lifts the finger. motion_delay: seconds by which
    smoothing lets the sound follow the hand.
    """

    session: str
    resume_url: str
    sample_rate: int
    channels: int
    quantities: tuple[str, ...]
    full_scale: tuple[float, ...]
    block: int
    frame: int
    plan: Mapping[str, Any]
    max_silence: float
    motion_delay: float

    @classmethod
    def read(cls, message: Mapping[str, Any]) -> Ready:
        """Return what a `ready` holds; raises KeyError, TypeError, ValueError where it holds less."""
        return cls(
            session=str(message["session"]),
            resume_url=str(message.get("resume_url", "")),
            sample_rate=int(message["sample_rate"]),
            channels=int(message["channels"]),
            quantities=tuple(str(quantity) for quantity in message["quantities"]),
            full_scale=tuple(float(value) for value in message["full_scale"]),
            block=int(message["block"]),
            frame=int(message["frame"]),
            plan=dict(message["plan"]),
            max_silence=float(message["max_silence_ms"]) / 1000.0,
            motion_delay=float(message["motion_delay_ms"]) / 1000.0,
        )

    def check_like(self, other: Ready) -> None:
        """Raise ProtocolError unless both sound alike: one device plays the one after the other."""
        for name in ("sample_rate", "channels", "quantities", "full_scale"):
            if getattr(self, name) != getattr(other, name):
                raise ProtocolError(f"{name} was {getattr(other, name)} and is now {getattr(self, name)}")
