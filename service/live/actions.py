"""What the state machine of a connection gives it: blocks to send, and actions, to be done in their order."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from service.live.live_stream import Options

CODES = {
    "stopped": 1000,
    "finished": 1000,
    "shutting down": 1001,
    "expired": 1001,
    "policy": 1008,
    "too long": 1008,
    "cannot render": 1011,
    "our mistake": 1011,
    "slow reader": 4408,
}
"""What a connection is closed with, by the reason of its `end`, unless its `Close` says otherwise."""


@dataclass(slots=True)
class Block:
    """A block that is due: its frames, and the messages that it is sent as.

    messages: None where the voice is slow or in use. Then the frames are rendered elsewhere, and
    `Conversation.messages` gives what is sent.
    """

    frames: int
    messages: list[str | bytes] | None


@dataclass(frozen=True, slots=True)
class Send:
    """Send a text message, after those before it and before the next block."""

    message: str


@dataclass(frozen=True, slots=True)
class OpenVoice:
    """Open a session; then `opened` or `end`."""

    scene: dict[str, Any]
    options: Options


@dataclass(frozen=True, slots=True)
class Resume:
    """Find a session, take it from whoever has it; then `opened` or `end`."""

    session: str
    frame: int


@dataclass(frozen=True, slots=True)
class Prepare:
    """Prepare the change that a partial scene of so many bytes makes, and leave it to the stream; or `refuse`."""

    patch: dict[str, Any]
    size: int = 0


@dataclass(frozen=True, slots=True)
class Detach:
    """Keep the session for a while: its connection broke."""


@dataclass(frozen=True, slots=True)
class Finish:
    """Forget the session: it has ended."""


@dataclass(frozen=True, slots=True)
class Close:
    """Close the connection, after all messages; at_once: even where the peer does not read."""

    code: int
    reason: str
    at_once: bool = False


Action = Send | OpenVoice | Resume | Prepare | Detach | Finish | Close
