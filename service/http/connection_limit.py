"""Bounds the connections of a process, so that a stop always finds a free descriptor.

Model: a process has RLIMIT_NOFILE descriptors. Some of them are kept for files, devices, and connections that arrive in
    the same turn of the event loop. When the others are used up, the oldest connections without a complete request are
    closed: first those without a complete head, then those without a complete body. If every connection has sent a
    complete request (streams), new requests get 503, except for stops with a right key and for probes: those are
    served on the KEPT newest connections.
Limits: a process with more than OTHERS open files and devices may still run out of descriptors.
"""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Mapping
from itertools import count
from typing import Any, cast

from starlette.types import Scope
from uvicorn.protocols.http.h11_impl import H11Protocol

from service.problems import Problem

try:
    import resource
except ImportError:  # a system without this limit
    resource = None  # type: ignore[assignment]

ROOM = "ridgewave.room"  # key of the ConnectionRoom in the state that the server adds to every scope
OTHERS = 64  # descriptors: 25 of a process that has just started, and those of files and devices
BURST = 8  # one in this many descriptors is kept for connections that arrive at once
KEPT = 16  # newest connections that are never closed; with fewer, a flood closes the connection that brings a stop
CLOSED_PART = 16  # one in this many incomplete requests is closed at a time: examining all of them takes time
WAITING_BYTES = 16_384  # of unsent sound in the process, for a client that does not read; a stop cannot reach it
_numbers = count()


def descriptors() -> int | None:
    """Return how many descriptors this process may have; None for any number."""
    if resource is None:
        return None
    soft, _hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    return None if soft == resource.RLIM_INFINITY else soft


def burst() -> int | None:
    """Return how many connections may arrive at once; None for any number."""
    limit = descriptors()
    return None if limit is None else max(KEPT, limit // BURST)


class Connection(H11Protocol):
    """An HTTP connection of uvicorn that is counted, and whose refusals are problem documents."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Bound the unsent bytes, and close other connections if there are too many."""
        wide = cast(asyncio.Transport, transport)
        wide.set_write_buffer_limits(WAITING_BYTES)
        peer = wide.get_extra_info("socket")
        if peer is not None and peer.family == socket.AF_UNIX:  # inherits nothing from the listening socket
            peer.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, WAITING_BYTES)
        super().connection_made(wide)
        self.number = next(_numbers)
        room: ConnectionRoom = self.app_state.setdefault(ROOM, ConnectionRoom(self.connections))
        room.make()

    def send_400_response(self, msg: str) -> None:
        """Answer what is no HTTP request, unless it comes within an answer, and close."""
        if self.cycle is None or self.cycle.response_complete or not self.cycle.response_started:
            problem = Problem("bad-request", "This is no HTTP request.", headers={"Connection": "close"})
            answer = problem.response(self.app_state.get("root_path", ""))
            head = b"".join(b"%s: %s\r\n" % header for header in answer.raw_headers)
            self.transport.write(b"HTTP/1.1 400 Bad Request\r\n" + head + b"\r\n" + bytes(answer.body))
        self.transport.close()

    @property
    def missing(self) -> int:
        """The incomplete parts of the request: 2 (head and body), 1 (body), or 0 (it is being answered)."""
        cycle = self.cycle
        if cycle is None or cycle.response_complete:
            return 2
        return 1 if cycle.more_body else 0


class ConnectionRoom:
    """The connections of one process."""

    def __init__(self, connections: set[Any]) -> None:
        self._connections = connections

    @property
    def _beyond(self) -> int:
        """By how many the connections exceed the descriptors for them."""
        limit = descriptors()
        most = len(self._connections) if limit is None else max(KEPT, limit - OTHERS - limit // BURST)
        return len(self._connections) - most

    def make(self) -> None:
        """Close connections without a complete request if there are too many connections."""
        if self._beyond <= 0:
            return
        incomplete = [one for one in self._connections if isinstance(one, Connection) and one.missing]
        incomplete.sort(key=lambda one: one.number)
        oldest = incomplete[: max(0, len(incomplete) - KEPT)]
        oldest.sort(key=lambda one: -one.missing)
        for one in oldest[: 1 + len(oldest) // CLOSED_PART]:
            one.transport.abort()

    def admit(self) -> None:
        """Raise Problem (full) if there are too many connections and none can be closed."""
        if self._beyond > KEPT:
            headers = {"Retry-After": "1", "Connection": "close"}
            raise Problem("full", "This process has all the connections that it may have.", headers=headers)


def room_of(scope: Scope) -> ConnectionRoom | None:
    """Return the room of the connection of `scope`; None for a server without `Connection`."""
    state: Mapping[str, Any] = scope.get("state") or {}
    return state.get(ROOM)
