"""The alarm clock of many streams: in order, each when it is due, and the event loop has its turn in between."""

from __future__ import annotations

import asyncio
import socket
import time
from functools import partial

from service.live.ticker import EARLY_SECONDS, Ticker


def test_callbacks_come_in_the_order_of_their_times_and_not_before() -> None:
    async def rung() -> list[tuple[int, float]]:
        ticker, begun = Ticker(), time.perf_counter()
        seen: list[tuple[int, float]] = []

        def ring(number: int, when: float) -> None:
            seen.append((number, time.perf_counter() - when))

        for number in (3, 1, 2):
            when = begun + 0.01 * number
            ticker.call_at(when, partial(ring, number, when))
        await asyncio.sleep(0.1)
        return seen

    seen = asyncio.run(rung())
    assert [number for number, _ in seen] == [1, 2, 3]
    assert all(late >= -EARLY_SECONDS for _, late in seen)


def test_who_is_always_late_is_called_again_only_when_the_sockets_have_been_looked_at() -> None:
    async def heard() -> list[str]:
        near, far = socket.socketpair()
        near.setblocking(False)
        loop, ticker = asyncio.get_running_loop(), Ticker()
        seen: list[str] = []

        def late(name: str) -> None:
            if name == "first" and name not in seen:
                far.send(b"x")  # comes while it rings
            seen.append(name)
            if len(seen) < 40:
                ticker.call_at(begun, partial(late, name))

        begun = time.perf_counter()
        loop.add_reader(near, lambda: seen.append("read") if near.recv(1) else None)
        for name in ("first", "second"):
            ticker.call_at(begun, partial(late, name))
        await asyncio.sleep(0.2)
        loop.remove_reader(near)
        near.close()
        far.close()
        return seen

    seen = asyncio.run(heard())
    assert seen[:5] == ["first", "second", "read", "first", "second"]
