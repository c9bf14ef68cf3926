"""The shared timer of live streams: callbacks come in order, when they are due; late ones come at once."""

from __future__ import annotations

import asyncio
import time
from functools import partial

from service.sessions.pacer import EARLY_SECONDS, BlockTimer


def test_callbacks_come_in_the_order_of_their_times_and_not_before() -> None:
    async def rung() -> list[tuple[int, float]]:
        ticker, begun = BlockTimer(), time.perf_counter()
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


def test_callbacks_that_are_due_more_often_than_the_timer_fires_are_not_late_for_long() -> None:
    """Blocks of 16 frames are due three times per millisecond. One timer event calls all that are due by then."""

    async def rung() -> int:
        ticker, begun = BlockTimer(), time.perf_counter()
        calls = 0

        def ring() -> None:
            nonlocal calls
            calls += 1
            if calls < 200:
                ticker.call_at(begun - 1.0, ring)  # late already, and it stays so

        ticker.call_at(begun - 1.0, ring)
        rings = 0
        ring_once = ticker._ring

        def counted() -> None:
            nonlocal rings
            rings += 1
            ring_once()

        ticker._ring = counted  # type: ignore[method-assign]
        ticker._set()
        while calls < 200:
            await asyncio.sleep(0.001)
        return rings

    assert asyncio.run(rung()) <= 100
