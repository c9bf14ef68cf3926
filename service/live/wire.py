"""What a live connection writes to and hears from: the plain ASGI server, or one that can do more.

Model: plain ASGI sends a message after another and gives each message to a task of its own. A server that offers WIRE
    among the extensions of the scope (`service.websocket`) writes several messages at once, takes a block in the very
    call that rendered it, and hands binary messages over as they come: for many small messages that halves the cost.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

from starlette.types import Send

WIRE = "ridgewave.wire"  # the ASGI extension's name; its value is a Wire

Sink = Callable[[bytes], None]
Messages = Sequence[str | bytes]


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
        """Give whole binary messages to `sink` as they come, in their order among all messages."""


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
