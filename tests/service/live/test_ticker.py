"""The alarm clock of many streams: in order, each when it is due, and the event loop has its turn in between."""

from __future__ import annotations

import asyncio
import socket
import time

from service.live.ticker import EARLY_SECONDS, Ticker


def test_callbacks_come_in_the_order_of_their_times_and_not_before() -> None:
    async def rung() -> list[tuple[int, float]]:
        ticker, seen, begun = Ticker(), [], time.perf_counter()
        for number in (3, 1, 2):
            when = begun + 0.01 * number
            ticker.call_at(when, lambda number=number, when=when: seen.append((number, time.perf_counter() - when)))
        await asyncio.sleep(0.1)
        return seen

    seen = asyncio.run(rung())
    assert [number for number, _ in seen] == [1, 2, 3]
    assert all(late >= -EARLY_SECONDS for _, late in seen)


def test_who_is_always_late_is_called_again_only_when_the_sockets_have_been_looked_at() -> None:
    async def heard() -> list[str]:
        near, far = socket.socketpair()
        near.setblocking(False)
        loop, ticker, seen = asyncio.get_running_loop(), Ticker(), []

        def late(name: str) -> None:
            if name == "first" and name not in seen:
                far.send(b"x")  # comes while it rings
            seen.append(name)
            if len(seen) < 40:
                ticker.call_at(begun, lambda: late(name))

        begun = time.perf_counter()
        loop.add_reader(near, lambda: seen.append("read") if near.recv(1) else None)
        for name in ("first", "second"):
            ticker.call_at(begun, lambda name=name: late(name))
        await asyncio.sleep(0.2)
        loop.remove_reader(near)
        near.close()
        far.close()
        return seen

    seen = asyncio.run(heard())
    assert seen[:5] == ["first", "second", "read", "first", "second"]
