"""Turns at reading, for connections of a process that have sent more than one turn of the event loop takes.

Model: however many flood, only one of them is read at a time, and timers and other sockets are served between them.
    WebSockets (`live.websocket`) and HTTP connections with costly bodies (`request_timeout`) share the turns.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable
from typing import Any

TURN_SECONDS = 0.001  # of reading in one turn; more makes others late
PAUSE_SECONDS = 0.001  # between two turns of all who wait for one; the event loop makes it 1 to 2 ms
TURNS = "ridgewave.turns"  # in the state that the connections of a process share


class Turns:
    """Whose turn it is to be read, of all connections of an event loop that have sent more than one turn takes.

    However many flood, only one of them is read at a time, and timers and other sockets are served between them.
    """

    def __init__(self) -> None:
        self._waiting: deque[Callable[[], bool]] = deque()
        self._timer: asyncio.TimerHandle | None = None

    def wait(self, read: Callable[[], bool]) -> None:
        """Have `read` called in its turn, once; it returns False where there was nothing to do any more."""
        self._waiting.append(read)
        if self._timer is None:
            self._set()

    def _set(self) -> None:
        self._timer = asyncio.get_running_loop().call_later(PAUSE_SECONDS, self._next)

    def _next(self) -> None:
        self._timer = None
        for _ in range(len(self._waiting)):
            if self._waiting.popleft()():
                break
        if self._waiting and self._timer is None:
            self._set()


def shared_turns(state: dict[str, Any]) -> Turns:
    """Return the turns that all connections of `state` share, which the server hands to each of them."""
    turns: Turns = state.setdefault(TURNS, Turns())
    return turns
