"""Changes during a solve are merged; the last is always applied; a refused one does not affect the others."""

from __future__ import annotations

import asyncio
import json
import threading
from collections.abc import Sequence
from typing import Any

import httpx
import pytest
from fastapi import FastAPI

from service.problems import Problem
from service.sessions.scene_changes import WAITING_BYTES, Changes, Patch, Waiting, merged
from synth.errors import CannotRender
from synth.scene.scene import Scene, parse_scene
from tests.service.harness import LOCAL, Running, until
from tests.service.live.client import live
from tests.service.plain_engine import PlainEngine, PlainLive
from tests.service.plain_hand import PlainHand

SCENE = parse_scene({})


def waiting(patch: object, refused: list[object] | None = None, size: int = 100) -> Waiting:
    def settle(error: Exception | None) -> None:
        if error is not None and refused is not None:
            refused.append(patch)

    return Waiting(lambda: patch, size, settle)  # type: ignore[arg-type, return-value]


def with_speed(scene: Scene, patch: Patch) -> Scene:
    """Merge a patch {"speed"}; one of 9 is refused."""
    if patch["speed"] == 9:
        raise Problem("fixed", "no nine")
    return scene.model_copy(update={"scan": scene.scan.model_copy(update={"speed": patch["speed"]})})


def test_what_comes_while_one_is_applied_is_applied_together_and_in_order() -> None:
    async def act() -> None:
        batches: list[list[Any]] = []

        async def apply(batch: Sequence[Waiting]) -> None:
            batches.append([change.read() for change in batch])
            for _ in range(10):
                await asyncio.sleep(0)

        changes = Changes(apply)
        for number in range(1000):
            changes.add(waiting(number))
            await asyncio.sleep(0)
        while sum(map(len, batches)) < 1000:
            await asyncio.sleep(0.001)
        assert [number for batch in batches for number in batch] == list(range(1000))
        assert len(batches) < 200

    asyncio.run(act())


def test_beyond_the_bound_the_oldest_goes_and_the_last_stays() -> None:
    async def act() -> None:
        gate, applied, refused = asyncio.Event(), list[object](), list[object]()

        async def apply(batch: Sequence[Waiting]) -> None:
            applied.extend(change.read() for change in batch)
            await gate.wait()

        changes = Changes(apply)
        changes.add(waiting(0, refused))
        await asyncio.sleep(0)
        for number in range(1, 11):
            changes.add(waiting(number, refused, WAITING_BYTES // 4))
        gate.set()
        await asyncio.sleep(0.01)
        assert applied == [0, 7, 8, 9, 10] and refused == [1, 2, 3, 4, 5, 6]
        gate.clear()
        changes.add(waiting(11))
        await asyncio.sleep(0)
        changes.add(waiting(12))
        changes.drop()
        gate.set()
        await asyncio.sleep(0.01)
        assert applied[-1] == 11, "whoever asked for 12 has gone"

    asyncio.run(act())


def test_one_that_is_refused_leaves_the_others_be() -> None:
    solved: list[float] = []

    def prepare(scene: Scene) -> float:
        solved.append(scene.scan.speed)
        return scene.scan.speed

    made = merged(SCENE, [waiting({"speed": speed}) for speed in (1, 9, 2)], with_speed, prepare)
    assert made.coming is not None and made.coming[1] == 2 and list(made.refused) == [1]
    assert solved == [2], "the sum is solved once"


@pytest.mark.parametrize("bad", range(8))
def test_a_sum_that_cannot_be_solved_is_tried_by_halves(bad: int) -> None:
    """Each change sets a field of its own; the one at `bad` makes every scene that has it unsolvable."""

    def change(scene: frozenset[int], patch: Patch) -> frozenset[int]:
        return scene | {patch["place"]}

    def prepare(scene: frozenset[int]) -> int:
        if bad in scene:
            raise CannotRender("no.")
        return len(scene)

    batch = [waiting({"place": place}) for place in range(8)]
    made = merged(frozenset(), batch, change, prepare)  # type: ignore[arg-type]
    assert made.coming is not None
    coming: Any = made.coming[0]
    assert coming == frozenset(range(8)) - {bad}
    assert list(made.refused) == [bad]


def test_of_a_thousand_live_changes_the_last_is_heard(running: Running, engine: PlainEngine) -> None:
    with live(running.url) as client:
        client.hello(pacing="realtime", block=480)
        for number in range(1000):
            client.say("scene", scene={"scan": {"speed": 0.05 + 1e-5 * number}})
        until(lambda: bool(engine.hands[-1].applied.scenes))
        last = 0.05 + 1e-5 * 999
        until(lambda: engine.hands[-1].applied.scenes[-1][1].scan.speed == pytest.approx(last))
        assert client.texts("problem") == []


def test_live_changes_of_any_size_wait_and_none_is_dropped(
    running: Running, engine: PlainEngine, monkeypatch: pytest.MonkeyPatch
) -> None:
    """1.2 MB of them, five times what may wait, come while the first one is being solved."""
    solve, waited = PlainHand.prepare, threading.Event()

    def slow(self: PlainHand, *arguments: Any) -> Any:
        waited.wait(0.5)
        return solve(self, *arguments)

    monkeypatch.setattr(PlainHand, "prepare", slow)
    with live(running.url) as client:
        client.hello(pacing="realtime", block=480)
        for number in range(21):
            patch = json.dumps({"type": "scene", "scene": {"scan": {"speed": 0.05 + 1e-3 * number}}})
            client.socket.send(patch + " " * 60_000)
        until(lambda: bool(engine.hands[-1].applied.scenes))
        until(lambda: engine.hands[-1].applied.scenes[-1][1].scan.speed == pytest.approx(0.07))
        client.say("stop")
        client.rest()
        assert not [told for told in client.texts("problem") if "dropped" in told["detail"]]


def test_of_changes_over_http_the_last_is_heard_and_those_that_wait_are_solved_once(
    app: FastAPI, engine: PlainEngine, monkeypatch: pytest.MonkeyPatch
) -> None:
    gate, solved = threading.Event(), []

    def open_live(scene: Scene) -> PlainLive:
        solved.append(scene.scan.speed)
        assert gate.wait(60.0)
        return PlainLive(scene)

    async def act() -> None:
        async with httpx.AsyncClient(transport=httpx.ASGITransport(app=app), base_url=LOCAL) as client:
            path = f"/v1/sessions/{(await client.post('/v1/sessions', json={})).json()['id']}"
            monkeypatch.setattr(engine, "open_live", open_live)
            speeds = [0.1 + 1e-4 * number for number in range(200)]
            patches = [asyncio.create_task(client.patch(path, json={"scan": {"speed": speed}})) for speed in speeds]
            patches.append(asyncio.create_task(client.patch(path, json={"scan": {"speed": -99}})))
            while not solved:
                await asyncio.sleep(0.005)
            gate.set()
            answers = [await patch for patch in patches]
            assert [answer.status_code for answer in answers] == [200] * 200 + [422]
            assert (await client.get(path)).json()["scene"]["scan"]["speed"] == pytest.approx(speeds[-1])
            assert len(solved) < 20

    asyncio.run(act())
