"""Places (slots) for work whose duration, a millisecond or a minute, is not known beforehand.

Model: work begins in one of a few places for short work. After LONG_SECONDS it counts as long: it gives its place up,
    `lower` is called so that it can continue at a lower priority, and it counts against the bounds on long work of its
    client and of all clients. Short work therefore waits for short work only. Where a bound on long work is reached,
    the work keeps its place; a client keeps half of the places at most. Waiting clients take turns.
Limits: for one event loop. The bounds count pieces of work, not seconds; `renders` bounds the seconds.
"""

from __future__ import annotations

import asyncio
import os
from collections import Counter, OrderedDict, deque
from collections.abc import Callable

LONG_SECONDS = 0.5  # with less, opening the default scene on a busy machine would count as long
STARVED_SECONDS = 1.0  # of waiting for other clients, before `/readyz` reports it
SHORT_PLACES = 4 * max(2, os.cpu_count() or 2)  # with fewer, work waits needlessly; with more, all of it is slower


class Place:
    """The place of one piece of work. lower: called when the work becomes long."""

    def __init__(self, places: Places, client: str, lower: Callable[[], None] = lambda: None) -> None:
        self.client, self.lower = client, lower
        self.long = False
        self._places = places
        loop = asyncio.get_running_loop()
        self.overdue_at = loop.time() + LONG_SECONDS
        self._alarm = loop.call_at(self.overdue_at, places.look)

    def leave(self) -> None:
        """Give the place up. Further calls do nothing."""
        self._alarm.cancel()
        self._places.left(self)


Waiting = tuple[float, Callable[[], None], "asyncio.Future[Place]"]


class Places:
    """The places of one kind of work.

    for_client, for_all: how many may be long at a time. With 0, no work becomes long.
    waited: called with the seconds that each piece of work waited for its place.
    short: places for short work; None for SHORT_PLACES.
    """

    def __init__(
        self, for_client: int, for_all: int, waited: Callable[[float], None], short: int | None = None
    ) -> None:
        self._for_client, self._for_all, self._waited = for_client, for_all, waited
        self._places = SHORT_PLACES if short is None else short
        self._held: set[Place] = set()
        self._short: Counter[str] = Counter()
        self._long: Counter[str] = Counter()
        self._queues: OrderedDict[str, deque[Waiting]] = OrderedDict()

    def starved(self) -> float:
        """Return the seconds that a client has waited for other clients; 0 below STARVED_SECONDS."""
        if not self._queues:
            return 0.0
        now = asyncio.get_running_loop().time()
        waits = [now - queue[0][0] for client, queue in self._queues.items() if self._may_begin(client)]
        longest = max(waits, default=0.0)
        return longest if longest >= STARVED_SECONDS else 0.0

    async def enter(self, client: str, lower: Callable[[], None] = lambda: None) -> Place:
        """Return a place for work of `client` as soon as one is free."""
        loop = asyncio.get_running_loop()
        began = loop.time()
        turn: asyncio.Future[Place] = loop.create_future()
        self._queues.setdefault(client, deque()).append((began, lower, turn))
        self.look()
        try:
            place = await turn
        except asyncio.CancelledError:
            if turn.done() and not turn.cancelled():
                turn.result().leave()
            self.look()
            raise
        self._waited(loop.time() - began)
        return place

    def left(self, place: Place) -> None:
        """Free `place`."""
        if place in self._held:
            self._held.discard(place)
            self._count(place, -1)
            self.look()

    def look(self) -> None:
        """Turn overdue work into long work within the bounds, and let waiting work begin."""
        now = asyncio.get_running_loop().time()
        for place in [held for held in self._held if not held.long and held.overdue_at <= now]:
            if self._long[place.client] < self._for_client and self._long.total() < self._for_all:
                self._count(place, -1)
                place.long = True
                self._count(place, 1)
                place.lower()
        while self._short.total() < self._places and (client := self._next()) is not None:
            _, lower, turn = self._queues[client].popleft()
            if turn.done():
                continue  # cancelled
            place = Place(self, client, lower)
            self._held.add(place)
            self._count(place, 1)
            turn.set_result(place)

    def _next(self) -> str | None:
        """Return the client whose turn it is; None if no waiting client may begin."""
        for client, queue in list(self._queues.items()):
            while queue and queue[0][2].done():
                queue.popleft()
            if not queue:
                del self._queues[client]
            elif self._may_begin(client):
                self._queues.move_to_end(client)
                return client
        return None

    def _may_begin(self, client: str) -> bool:
        return self._short[client] < self._places // 2

    def _count(self, place: Place, change: int) -> None:
        counted = self._long if place.long else self._short
        counted[place.client] += change
        if not counted[place.client]:
            del counted[place.client]
