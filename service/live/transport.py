"""The interface between a live connection and its server.

Model: the server of this service (`websocket`) offers a `Wire` among the extensions of the ASGI scope. It writes
    several messages at once, sends without an await, and passes messages on in the call that reads them. For many small
    messages this halves the cost of plain ASGI, which `PlainWire` uses with any other server.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from starlette.types import Send

WIRE = "ridgewave.wire"  # name of the ASGI extension; its value is a Wire

Messages = Sequence[str | bytes]


class Receiver(Protocol):
    """Receives what the client sends. The methods must not raise."""

    def message(self, message: str | bytes) -> None:
        """Receive a whole message."""

    def frame(self, size: int) -> None:
        """Count a frame of `size` bytes: a whole message, a part of one, a ping or a pong."""

    def pause(self) -> float:
        """Return the seconds for which no frame may be read, 0 if one may. The server asks before each frame."""

    def behind(self, seconds: float) -> None:
        """Receive for how long the server has not read all that has arrived."""


class Wire(Protocol):
    """The server's side of one WebSocket."""

    def unblock(self) -> None:
        """From now on, buffer what is sent even if the client does not read."""

    def can_send(self) -> bool:
        """Return whether `send_now` may be called."""

    def send_now(self, messages: Messages) -> None:
        """Send without waiting. Only if `can_send`."""

    async def send_all(self, messages: Messages) -> None:
        """Send in order; waits while the client does not read. Raises OSError if it is gone."""

    def acknowledge(self) -> None:
        """Let the network confirm at once what has arrived: the peer may wait for it before it sends the rest."""

    def deliver(self, receiver: Receiver | None) -> None:
        """Pass messages to `receiver` from now on; None discards them. No message is read before the first call."""


class PlainWire:
    """A `Wire` over plain ASGI."""

    def __init__(self, send: Send) -> None:
        self._send = send

    def unblock(self) -> None:
        """Do nothing: plain ASGI cannot."""

    def can_send(self) -> bool:
        """Return False: plain ASGI sends with an await."""
        return False

    def send_now(self, messages: Messages) -> None:
        """See `Wire`."""
        raise AssertionError("this server cannot send without waiting")

    async def send_all(self, messages: Messages) -> None:
        """See `Wire`."""
        for message in messages:
            kind = "bytes" if isinstance(message, bytes) else "text"
            await self._send({"type": "websocket.send", kind: message})

    def acknowledge(self) -> None:
        """Do nothing: plain ASGI cannot."""

    def deliver(self, receiver: Receiver | None) -> None:
        """Do nothing: messages come through `receive`."""
