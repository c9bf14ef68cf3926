"""Places: short work waits for short work only, long work is bounded, clients take turns."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

import pytest

from service.compute import work_places
from service.compute.work_places import Place, Places

SOON = 0.3


def run(
    act: Callable[[Places, list[float]], Awaitable[None]],
    monkeypatch: pytest.MonkeyPatch,
    short: int = 4,
    long_seconds: float = SOON,
) -> None:
    """Run `act` with places for four short works, and two long ones of a client and three of all."""
    monkeypatch.setattr(work_places, "SHORT_PLACES", short)
    monkeypatch.setattr(work_places, "LONG_SECONDS", long_seconds)
    monkeypatch.setattr(work_places, "STARVED_SECONDS", SOON)

    async def scenario() -> None:
        waited: list[float] = []
        await asyncio.wait_for(act(Places(2, 3, waited.append), waited), 60.0)

    asyncio.run(scenario())


async def turned_away(task: asyncio.Task[Place]) -> bool:
    """Return whether `task` waits for its place, after the turns of the loop in which it would have got a free one."""
    for _ in range(10):
        await asyncio.sleep(0)
    return not task.done()


def test_what_has_become_long_makes_room(monkeypatch: pytest.MonkeyPatch) -> None:
    async def act(places: Places, waited: list[float]) -> None:
        lowered: list[str] = []
        held = [await places.enter("a", lambda: lowered.append("a")) for _ in range(2)]
        third = asyncio.create_task(places.enter("a"))
        assert await turned_away(third), "half of the places are the most that a client has"
        await third
        assert lowered == ["a", "a"] and all(place.long for place in held)
        assert waited[0] < SOON / 2 < waited[-1]

    run(act, monkeypatch)


def test_a_client_with_all_its_long_work_keeps_its_places_and_others_begin(monkeypatch: pytest.MonkeyPatch) -> None:
    async def act(places: Places, waited: list[float]) -> None:
        for _ in range(4):  # two of them long, two overdue
            await places.enter("a")
        fifth = asyncio.create_task(places.enter("a"))
        await asyncio.sleep(4 * SOON)
        assert not fifth.done()
        assert places.starved() == 0.0, "it waits for itself"
        other = asyncio.create_task(places.enter("b"))
        assert not await turned_away(other)
        other.result().leave()
        fifth.cancel()

    run(act, monkeypatch)


def test_a_place_that_is_left_is_taken_and_leaving_twice_is_leaving_once(monkeypatch: pytest.MonkeyPatch) -> None:
    async def act(places: Places, waited: list[float]) -> None:
        first = await places.enter("a")
        second = asyncio.create_task(places.enter("a"))
        assert await turned_away(second)
        first.leave()
        await second
        first.leave()
        third = asyncio.create_task(places.enter("a"))
        assert await turned_away(third)
        (await second).leave()
        await third

    run(act, monkeypatch, short=2, long_seconds=60.0)


def test_clients_that_wait_take_turns(monkeypatch: pytest.MonkeyPatch) -> None:
    async def act(places: Places, waited: list[float]) -> None:
        begun: list[str] = []

        async def work(client: str) -> None:
            place = await places.enter(client)
            begun.append(client)
            await asyncio.sleep(0)
            place.leave()

        held = [await places.enter("x"), await places.enter("y")]
        tasks = [asyncio.create_task(work(client)) for client in "aaabbb"]
        await asyncio.sleep(0)
        for place in held:
            place.leave()
        await asyncio.gather(*tasks)
        assert sorted(begun[:2]) == ["a", "b"] and sorted(begun[2:4]) == ["a", "b"]

    run(act, monkeypatch, short=2, long_seconds=60.0)


def test_whoever_stops_waiting_takes_no_place(monkeypatch: pytest.MonkeyPatch) -> None:
    async def act(places: Places, waited: list[float]) -> None:
        first = await places.enter("a")
        gone = asyncio.create_task(places.enter("a"))
        stays = asyncio.create_task(places.enter("a"))
        assert await turned_away(gone)
        gone.cancel()
        first.leave()
        await stays

    run(act, monkeypatch, short=2, long_seconds=60.0)


def test_waiting_for_others_is_starving(monkeypatch: pytest.MonkeyPatch) -> None:
    async def act(places: Places, waited: list[float]) -> None:
        held = [await places.enter(client) for client in "ab"]
        waits = asyncio.create_task(places.enter("c"))
        await asyncio.sleep(2 * SOON)
        assert places.starved() >= SOON
        held[0].leave()
        await waits
        assert places.starved() == 0.0

    run(act, monkeypatch, short=2, long_seconds=60.0)
