"""The connection that carries a live stream: where it goes, how it is made, and what its end means.

Model: `websockets`, without compression (noise does not compress), with pings that find a peer that is gone, and with
    bounded messages. A shell knows only `send`, `recv`, `close` and the exception `Closed`, so that a test, or another
    library, may put its own connection in the place of this one.
"""

from __future__ import annotations

import ssl
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, replace
from typing import Any, Protocol
from urllib.parse import urlsplit, urlunsplit

from websockets import Subprotocol
from websockets.exceptions import ConnectionClosed, InvalidMessage, InvalidStatus, WebSocketException

from clients.client_errors import ConnectionLost, read_problem, retry_seconds
from clients.live_client.reconnection import Closed, Closure
from clients.live_client.wire_messages import SUBPROTOCOL, subprotocols
from synth.errors import Fault, InvalidRequest, shown

PING_SECONDS = 5.0  # s between pings, and to wait for each answer: a peer that is gone is found within twice that
OPEN_SECONDS = 5.0  # s for TCP, TLS and the upgrade; longer wastes the time for which the service keeps a session
READY_SECONDS = 60.0  # s from there to `ready`; a scene is solved meanwhile, and the dearest take some ten seconds
CLOSE_SECONDS = 1.0  # s for the peer to answer a close; longer only delays the next connection
LARGEST_MESSAGE = 1 << 23  # bytes: one second at 48 kHz in 32 channels of float32 is 6.1 MB; the service sends no more

PROTOCOL_CODE = 1002  # close code of what is no WebSocket, or another protocol: not worth another try
TLS_CODE = 1015  # close code (RFC 6455, 7.4.1) of a certificate that is not trusted: not worth another try


@dataclass(frozen=True, slots=True)
class Address:
    """Where a live stream is to be had: the URL, and the subprotocols to offer, of which one may hold a key."""

    url: str
    subprotocols: tuple[str, ...]

    @classmethod
    def of(cls, url: str, key: str | None) -> Address:
        """Return the checked address; raises InvalidRequest."""
        parts = urlsplit(url)
        if parts.scheme not in ("ws", "wss") or not parts.hostname:
            hint = "Write ws://127.0.0.1:8000/v1/live."
            raise InvalidRequest([Fault("/url", shown(url), "an address that begins with ws:// or wss://", hint)])
        return cls(url, subprotocols(key))

    def resuming(self, resume_url: str) -> Address:
        """Return the address that `ready` says to resume at, on the same host; "" is this one.

        A path before /v1/live, where a proxy has one, and the query of this address stay.
        """
        if not resume_url:
            return self
        parts, told = urlsplit(self.url), urlsplit(resume_url)
        path = parts.path.removesuffix("/v1/live") + told.path
        query = "&".join(part for part in (parts.query, told.query) if part)
        return replace(self, url=urlunsplit((parts.scheme, parts.netloc, path, query, "")))

    @property
    def service(self) -> str:
        """Return the base address of the same service over HTTP."""
        parts = urlsplit(self.url)
        scheme = "https" if parts.scheme == "wss" else "http"
        return urlunsplit((scheme, parts.netloc, parts.path.removesuffix("/v1/live"), "", ""))

    @property
    def options(self) -> dict[str, Any]:
        """Return the keywords for `connect` of websockets, either kind."""
        return {
            "subprotocols": [Subprotocol(name) for name in self.subprotocols],
            "compression": None,
            "max_size": LARGEST_MESSAGE,
            "ping_interval": PING_SECONDS,
            "ping_timeout": PING_SECONDS,
            "open_timeout": OPEN_SECONDS,
            "close_timeout": CLOSE_SECONDS,
        }


class Connection(Protocol):
    """What the shell with threads needs; `send` and `close` are called beside a `recv` that waits. All raise Closed."""

    def send(self, message: str | bytes) -> None:
        """Send one message."""

    def recv(self) -> str | bytes:
        """Wait for one message."""

    def close(self) -> None:
        """Close; a second time does nothing. Whatever waits is woken with Closed."""


class AsyncConnection(Protocol):
    """The same for the shell without threads."""

    async def send(self, message: str | bytes) -> None:
        """Send one message."""

    async def recv(self) -> str | bytes:
        """Wait for one message."""

    async def close(self) -> None:
        """Close; a second time does nothing."""


Connect = Callable[[Address], Connection]
AsyncConnect = Callable[[Address], Awaitable[AsyncConnection]]


def not_ready() -> ConnectionLost:
    """Return the exception for a service that was connected and has not answered `hello`."""
    return ConnectionLost(f"the service was not ready within {READY_SECONDS:g} s")


def check_subprotocol(chosen: str | None) -> None:
    """Raise Closed unless the service speaks the protocol."""
    if chosen != SUBPROTOCOL:
        raise Closed(Closure(PROTOCOL_CODE, f"the service does not speak {SUBPROTOCOL}"))


FAILURES = (OSError, WebSocketException)
"""What websockets and the operating system raise; `closure_of` says what each means."""


def closure_of(error: Exception) -> Closure:
    """Return how a connection ended that raised `error`, one of FAILURES."""
    if isinstance(error, ConnectionClosed):
        return _closure_of_close(error)
    if isinstance(error, InvalidStatus):
        answer = error.response
        problem = read_problem(answer.body, answer.status_code, answer.reason_phrase)
        retry_after = retry_seconds(answer.headers.get("Retry-After"))
        return Closure(None, problem.title, answer.status_code, problem, retry_after)
    if isinstance(error, ssl.SSLCertVerificationError):
        return Closure(TLS_CODE, error.verify_message)
    if isinstance(error, OSError) or (isinstance(error, InvalidMessage) and isinstance(error.__cause__, EOFError)):
        return Closure(None, str(error) or type(error).__name__)
    return Closure(PROTOCOL_CODE, str(error))


def _closure_of_close(error: ConnectionClosed) -> Closure:
    """Return whose word ended it: the peer's, ours, or nobody's (a reset; no answer to a ping)."""
    if error.rcvd is not None and (error.sent is None or error.rcvd_then_sent):
        return Closure(error.rcvd.code, error.rcvd.reason)
    if error.sent is not None and error.sent.code in (PROTOCOL_CODE, 1007, 1009):
        return Closure(error.sent.code, error.sent.reason)
    reason = error.sent.reason if error.sent is not None else str(error.__cause__ or "")
    return Closure(None, reason or "no close frame")
