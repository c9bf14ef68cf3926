"""What a live connection writes to and hears from: the plain ASGI server, or one that can do more.

Model: plain ASGI sends a message after another and gives each message to a task of its own. A server that offers WIRE
    among the extensions of the scope (`websocket`) writes several messages at once, takes a block in the very
    call that rendered it, hands messages over as they come, and counts what a peer sends beside messages: for many
    small messages that halves the cost.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from starlette.types import Send

WIRE = "ridgewave.wire"  # the ASGI extension's name; its value is a Wire

Messages = Sequence[str | bytes]


class Sink(Protocol):
    """Who takes what a peer sends; nothing here may raise."""

    def message(self, message: str | bytes) -> None:
        """Take a whole message."""

    def frame(self) -> bool:
        """Count a frame that is no message (a ping, a part of a message); return whether the peer may send it."""

    def behind(self, frames: int) -> None:
        """Take note that so many frames came in a row, and more has come than could be read meanwhile."""


class Wire(Protocol):
    """The server's side of one WebSocket."""

    def unblock(self) -> None:
        """Buffer what is sent from now on, though the peer does not read."""

    def can_send(self) -> bool:
        """Return whether `send_now` would take messages."""

    def send_now(self, messages: Messages) -> None:
        """Send without waiting; only where `can_send`."""

    async def send_all(self, messages: Messages) -> None:
        """Send in this order, waiting while the peer does not read; raises OSError where it is gone."""

    def deliver(self, sink: Sink | None) -> None:
        """Give messages to `sink` as they come, none before the first sink is there; None: throw them away."""


class PlainWire:
    """What every ASGI server can do."""

    def __init__(self, send: Send) -> None:
        self._send = send

    def unblock(self) -> None:
        """See `Wire`: it cannot."""

    def can_send(self) -> bool:
        """See `Wire`: it must wait."""
        return False

    def send_now(self, messages: Messages) -> None:
        """See `Wire`."""
        raise AssertionError("this server cannot send without waiting")

    async def send_all(self, messages: Messages) -> None:
        """See `Wire`."""
        for message in messages:
            kind = "bytes" if isinstance(message, bytes) else "text"
            await self._send({"type": "websocket.send", kind: message})

    def deliver(self, sink: Sink | None) -> None:
        """See `Wire`: messages come through `receive` alone."""
