"""Turns in which connections that send too much are read.

Model: a connection that sends more than one turn can process waits for its next turn. Of all such connections in a
    process, one is read at a time; timers and other sockets are served in between. WebSockets (`live.websocket`) and
    HTTP connections with costly bodies (`request_timeout`) share the turns.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable
from typing import Any

TURN_SECONDS = 0.001  # of reading in one turn; longer delays the other connections
PAUSE_SECONDS = 0.001  # between two turns; the event loop makes it 1 to 2 ms
TURNS = "ridgewave.turns"  # key of the Turns in the state that the connections of a process share


class Turns:
    """The turns of one event loop."""

    def __init__(self) -> None:
        self._waiting: deque[Callable[[], bool]] = deque()
        self._timer: asyncio.TimerHandle | None = None

    def wait(self, read: Callable[[], bool]) -> None:
        """Call `read` once, when its turn comes. It returns False if it had nothing to do: the turn then passes on."""
        self._waiting.append(read)
        self._set_timer()

    def _set_timer(self) -> None:
        if self._waiting and self._timer is None:
            self._timer = asyncio.get_running_loop().call_later(PAUSE_SECONDS, self._next)

    def _next(self) -> None:
        self._timer = None
        for _ in range(len(self._waiting)):
            if self._waiting.popleft()():
                break
        self._set_timer()


def shared_turns(state: dict[str, Any]) -> Turns:
    """Return the turns of the connections that share `state`, the server's state of a process."""
    turns: Turns = state.setdefault(TURNS, Turns())
    return turns
