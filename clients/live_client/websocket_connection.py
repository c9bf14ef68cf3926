"""The WebSocket of a live stream: its address, its settings, and the meaning of each way in which it ends.

Messages are not compressed (noise does not compress) and bounded. Pings detect a peer that is gone. `Live` and
`AsyncLive` use only `send`, `recv`, `close` and the exception `Closed`, so that tests and other transports can supply
another connection.
"""

from __future__ import annotations

import contextlib
import re
import ssl
from collections.abc import Awaitable, Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any, Protocol
from urllib.parse import urlsplit, urlunsplit

from websockets import Subprotocol
from websockets.exceptions import ConnectionClosed, InvalidMessage, InvalidStatus, WebSocketException

from clients.client_errors import ConnectionLost, read_problem, retry_seconds
from clients.live_client.reconnection import Closed, Closure
from clients.live_client.wire_messages import SUBPROTOCOLS, subprotocols
from clients.scene_and_key import checked_url

LIVE_PATH = "/v1/live"
PING_SECONDS = 5.0  # s between pings, and to wait for each answer: a lost peer is detected within twice that
OPEN_SECONDS = 5.0  # s for TCP, TLS and the upgrade; longer wastes time while the service still keeps the session
READY_SECONDS = (
    60.0  # s from the upgrade to `ready`; the service solves the scene meanwhile, for up to some ten seconds
)
CLOSE_SECONDS = 1.0  # s to wait for the answer to a close; longer only delays the next connection
LARGEST_MESSAGE = (
    1 << 23
)  # bytes; one second of 32 float32 channels at 48 kHz is 6.1 MB, the largest message of the service

PROTOCOL_CODE = 1002  # close code for no WebSocket, or another protocol: do not try again
TLS_CODE = 1015  # close code (RFC 6455, 7.4.1) for an untrusted certificate: do not try again


@dataclass(frozen=True, slots=True)
class Address:
    """The URL of a live stream, and the subprotocols to offer, one of which may hold a key."""

    url: str
    subprotocols: tuple[str, ...]

    @classmethod
    def of(cls, url: str, key: str | None) -> Address:
        """Return the checked address; raises InvalidRequest."""
        return cls(checked_url("url", url, ("ws", "wss"), "ws://127.0.0.1:8000/v1/live"), subprotocols(key))

    def resuming(self, resume_url: str) -> Address:
        """Return the address at which to resume, on the same host. resume_url: as `ready` gave it; "" is this address.

        The query of this address stays, and so does the path prefix of a proxy; it replaces that of `resume_url`.
        """
        if not resume_url:
            return self
        parts, resumed = urlsplit(self.url), urlsplit(resume_url)
        path = parts.path.removesuffix(LIVE_PATH) + re.sub(f".*(?={LIVE_PATH}$)", "", resumed.path)
        query = "&".join(part for part in (parts.query, resumed.query) if part)
        return replace(self, url=urlunsplit((parts.scheme, parts.netloc, path, query, "")))

    @property
    def service(self) -> str:
        """The base URL of the same service over HTTP."""
        parts = urlsplit(self.url)
        scheme = "https" if parts.scheme == "wss" else "http"
        return urlunsplit((scheme, parts.netloc, parts.path.removesuffix(LIVE_PATH), "", ""))

    @property
    def options(self) -> dict[str, Any]:
        """The keyword arguments of `connect` of websockets, with threads and without."""
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
    """What `Live` needs of a connection. `send` and `close` may be called while `recv` waits. All raise Closed."""

    def send(self, message: str | bytes) -> None:
        """Send one message."""

    def recv(self) -> str | bytes:
        """Wait for one message."""

    def close(self) -> None:
        """Close; a second call does nothing. Waiting calls raise Closed."""


class AsyncConnection(Protocol):
    """What `AsyncLive` needs of a connection. All methods raise Closed."""

    async def send(self, message: str | bytes) -> None:
        """Send one message."""

    async def recv(self) -> str | bytes:
        """Wait for one message."""

    async def close(self) -> None:
        """Close; a second call does nothing."""


Connect = Callable[[Address], Connection]
AsyncConnect = Callable[[Address], Awaitable[AsyncConnection]]


def not_ready() -> ConnectionLost:
    """Return the exception for a service that did not answer `hello`."""
    return ConnectionLost(f"the service was not ready within {READY_SECONDS:g} s")


def check_subprotocol(chosen: str | None) -> None:
    """Raise Closed unless the service chose a version of the protocol."""
    if chosen not in SUBPROTOCOLS:
        raise Closed(Closure(PROTOCOL_CODE, f"the service does not speak {' or '.join(SUBPROTOCOLS)}"))


@contextlib.contextmanager
def failures_as_closed() -> Iterator[None]:
    """Raise Closed in place of the exceptions of websockets and of the operating system."""
    try:
        yield
    except (OSError, WebSocketException) as error:
        raise Closed(closure_of(error)) from error


def closure_of(error: Exception) -> Closure:
    """Return how a connection that raised `error` ended."""
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
    """Return the code of the side that closed first; none after a reset or a missing answer to a ping."""
    if error.rcvd is not None and (error.sent is None or error.rcvd_then_sent):
        return Closure(error.rcvd.code, error.rcvd.reason)
    if error.sent is not None and error.sent.code in (PROTOCOL_CODE, 1007, 1009):
        return Closure(error.sent.code, error.sent.reason)
    reason = error.sent.reason if error.sent is not None else str(error.__cause__ or "")
    return Closure(None, reason or "no close frame")
