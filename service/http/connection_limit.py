"""How many connections a process can have, and who goes when there are more: a stop must always find a descriptor.

Model: a process has RLIMIT_NOFILE descriptors. `most` of them are for connections, the others for files, devices, and
    connections that come in the same turn of the event loop. Beyond `most`, the oldest connections that have no whole
    request are dropped: those without a head first, then those whose body has not come. Where all have one (streams),
    new requests are answered 503, all but `UNLIMITED_PATHS`; these come through on the KEPT newest connections.
Limits: a process that has more than OTHERS files and devices open may still run out.
"""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from itertools import count
from typing import Any, cast

from starlette.types import Scope
from uvicorn.protocols.http.h11_impl import H11Protocol

from service.problems import Problem

try:
    import resource
except ImportError:  # a system without such limits
    resource = None  # type: ignore[assignment]

ROOM = "ridgewave.room"  # in the state that the server hands to every scope: the ConnectionRoom
OTHERS = 64  # descriptors: 25 of a process that has just started, and those of files and devices
BURST = 8  # the part of all descriptors, one in so many, for connections that come at once
KEPT = 16  # newest connections that stay though they have sent nothing yet; fewer, and a flood drops who comes to stop
DROPPED_PART = 16  # of those that wait, one in so many is dropped at a time: looking at all of them costs time
WAITING_BYTES = 16_384  # of an answer in the process, for a peer that does not read; what is in there cannot be stopped
_numbers = count()


def descriptors() -> int | None:
    """Return how many descriptors this process may have now; None where nothing bounds them."""
    if resource is None:
        return None
    soft, _hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    return None if soft == resource.RLIM_INFINITY else soft


def burst() -> int | None:
    """Return how many connections may come at once; None for any number."""
    limit = descriptors()
    return None if limit is None else max(KEPT, limit // BURST)


class Connection(H11Protocol):
    """One HTTP connection: uvicorn's own, counted."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Begin."""
        wide = cast(asyncio.Transport, transport)
        wide.set_write_buffer_limits(WAITING_BYTES)
        super().connection_made(wide)
        self.number = next(_numbers)
        room: ConnectionRoom = self.app_state.setdefault(ROOM, ConnectionRoom(self.connections))
        room.make()

    @property
    def waits(self) -> int:
        """Return 2 where no head of a request has come, 1 where its body has not, 0 where it is being answered."""
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
        """Return by how many there are more than `most`."""
        limit = descriptors()
        most = len(self._connections) if limit is None else max(KEPT, limit - OTHERS - limit // BURST)
        return len(self._connections) - most

    def make(self) -> None:
        """Drop connections that have no whole request, where there are too many."""
        if self._beyond <= 0:
            return
        waiting = [one for one in self._connections if isinstance(one, Connection) and one.waits]
        waiting.sort(key=lambda one: one.number)
        oldest = waiting[: max(0, len(waiting) - KEPT)]
        oldest.sort(key=lambda one: -one.waits)
        for one in oldest[: 1 + len(oldest) // DROPPED_PART]:
            one.transport.abort()

    def admit(self) -> None:
        """Raise Problem (full) where no connection can be dropped any more."""
        if self._beyond > KEPT:
            raise Problem(
                "full",
                "As many connections as this process may have.",
                headers={"Retry-After": "1", "Connection": "close"},
            )


def room_of(scope: Scope) -> ConnectionRoom | None:
    """Return the room of the connection that `scope` came by; None where the server is not ours."""
    state: Mapping[str, Any] = scope.get("state") or {}
    return state.get(ROOM)
