"""What the state machine of a connection requests: blocks to send, and actions to perform in order."""

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
"""Close code for each reason of `end`. A `Close` may have another code."""


@dataclass(slots=True)
class Block:
    """A block that is due.

    frames: its length.
    messages: what to send; None where a thread must render the block first, because the voice is slow or in use. Then
        `Conversation.messages` returns what to send.
    """

    frames: int
    messages: list[str | bytes] | None


@dataclass(frozen=True, slots=True)
class Send:
    """Send a text message before the next block."""

    message: str


@dataclass(frozen=True, slots=True)
class OpenVoice:
    """Open a session, then call `Conversation.opened` or `end`."""

    scene: dict[str, Any]
    options: Options


@dataclass(frozen=True, slots=True)
class Resume:
    """Take a session over from its present connection, then call `Conversation.opened` or `end`."""

    session: str
    frame: int


@dataclass(frozen=True, slots=True)
class Prepare:
    """Prepare a change of scene and pass it to the stream, or call `Conversation.refuse`.

    patch: a partial scene.
    size: of its text, in bytes.
    """

    patch: dict[str, Any]
    size: int


@dataclass(frozen=True, slots=True)
class Detach:
    """Keep the session for RIDGEWAVE_RESUME: its connection broke."""


@dataclass(frozen=True, slots=True)
class Finish:
    """Remove the session, which has ended."""


@dataclass(frozen=True, slots=True)
class Close:
    """Close the connection after all messages. at_once: do not wait for a client that does not read."""

    code: int
    reason: str
    at_once: bool = False


Action = Send | OpenVoice | Resume | Prepare | Detach | Finish | Close
