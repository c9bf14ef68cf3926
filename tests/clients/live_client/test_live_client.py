"""`Live` and `AsyncLive`: what a person does with them, over connections in memory and over a real WebSocket.

What goes through `place` holds of every service that speaks the protocol; here that is the service of `fake_live`.
"""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from clients import AsyncLive, ConnectionLost, Live, RefusedError, ResumeLost, StreamEnded
from clients.live_client.reconnection import Backoff, Closure
from synth.errors import InvalidRequest
from tests.clients.live_client.fake_live import FULL_SCALE, RATE, Service, sound
from tests.clients.live_client.live_services import (
    LIVE_SERVICES,
    READS,
    Block,
    MemoryPlace,
    Place,
    WebSocketPlace,
    serving_live,
    stroke,
    stroke_async,
)
from tests.clients.live_client.memory_connection import AsyncMemoryConnection, Line, MemoryConnection, ThreadNetwork
from tests.service.harness import until


@pytest.fixture(params=["memory", *LIVE_SERVICES])
def place(request: pytest.FixtureRequest) -> Place:
    if request.param == "memory":
        return MemoryPlace()
    return WebSocketPlace(request.getfixturevalue("live_urls")[request.param])


@pytest.fixture(scope="module")
def live_urls() -> Iterator[dict[str, str]]:
    with serving_live() as urls:
        yield urls


# Any service


def test_a_read_returns_exactly_the_requested_frames(place: Place) -> None:
    with place.live() as touch:
        for frames in (1, 479, 80, 0, 1000):
            block = touch.read(frames, timeout=60.0)
            assert block.shape == (frames, touch.channels) and block.dtype == np.float32
        assert touch.frame == 1560
        assert len(touch.full_scale) == len(touch.quantities) == touch.channels


def test_frames_are_whole_numbers_of_any_type(place: Place) -> None:
    frames: Any = np.int64(100)
    with place.live(ahead=np.int64(5), block=np.int32(64)) as touch:
        assert [len(touch.read(frames, timeout=10.0)) for _ in range(3)] == [100, 100, 100]


def test_the_sound_follows_the_hand_from_the_next_read_on(place: Place) -> None:
    with place.live() as touch:
        assert touch.applied is None
        touch.read(200, timeout=60.0)
        seq = touch.move(0.01, 0.2)
        touch.read(100, timeout=60.0)
        assert touch.applied == (seq, 200)


def test_a_finger_moves_over_an_area(place: Place) -> None:
    with place.live() as touch:
        touch.read(200, timeout=60.0)
        seq = touch.move(x=-0.01, y=0.02, load=0.2)
        touch.read(100, timeout=60.0)
        assert touch.applied == (seq, 200) and not touch.problems


@pytest.mark.parametrize(
    "given",
    [
        {},
        {"x": 0.1},
        {"y": 0.1},
        {"direction": 0.1},
        {"position": 0.1, "x": 0.1, "y": 0.1},
        {"position": 0.1, "direction": 0.1},
        {"x": 0.1, "direction": 0.1},
    ],
    ids=lambda given: "+".join(given) or "nothing",
)
def test_a_move_says_in_one_way_where_the_finger_is(given: dict[str, float]) -> None:
    with MemoryPlace().live() as touch, pytest.raises(InvalidRequest) as refused:
        touch.move(**given, load=0.1)
    (fault,) = refused.value.faults
    assert fault.value == (" and ".join(given) or "no position, x or y") and "only with x and y" in fault.allowed


def test_breaks_leave_the_samples_of_an_undisturbed_run(place: Place) -> None:
    with place.live() as touch:
        whole = stroke(touch, READS)
    with place.live(cuts=(1500, 1500, 2200, 3000)) as touch:
        broken = stroke(touch, READS)
        assert touch.reconnections > 1
        assert touch.gaps == ()
        assert touch.frame == sum(READS)
    assert np.array_equal(broken, whole)


def test_the_async_stream_is_the_same(place: Place) -> None:
    with place.live() as touch:
        whole = stroke(touch, READS)

    async def broken() -> Block:
        async with place.live_async(cuts=(1500, 1500, 2200, 3000)) as touch:
            block = await stroke_async(touch, READS)
            assert touch.reconnections > 1
            return block

    assert np.array_equal(asyncio.run(broken()), whole)


def test_int16_is_the_float_sound_rounded(place: Place) -> None:
    with place.live() as touch:
        whole = stroke(touch, READS)
    with place.live(format="s16le") as touch:
        assert np.abs(stroke(touch, READS) - whole).max() <= 0.5 / 32768


def test_a_stopped_stream_returns_its_fade_and_then_raises_its_end(place: Place) -> None:
    with place.live() as touch:
        touch.read(100, timeout=60.0)
        tail = touch.stop(timeout=60.0)
        assert tail.shape[1] == touch.channels and len(tail) > 0
        with pytest.raises(StreamEnded) as ended:
            touch.read(1, timeout=60.0)
        assert ended.value.reason == "stopped"

    async def stopped() -> Block:
        async with place.live_async() as touch:
            await touch.read(100)
            return await touch.stop()

    assert asyncio.run(stopped()).shape == tail.shape


def test_a_refused_scene_raises_its_faults(place: Place) -> None:
    with pytest.raises(RefusedError) as refused, place.live({"nonsense": 1}):
        pass
    assert refused.value.problem.status == 422
    assert [fault.pointer for fault in refused.value.faults] == ["/nonsense"]

    async def opened() -> None:
        async with place.live_async({"nonsense": 1}):
            pass

    with pytest.raises(RefusedError):
        asyncio.run(opened())


def test_a_change_updates_the_plan_and_a_refused_one_is_a_problem(place: Place) -> None:
    with place.live() as touch:
        assert touch.changed_frame is None
        touch.change({"scan": {"load": 0.2}})
        until(lambda: bool(touch.read(80, timeout=60.0).size) and touch.changed_frame is not None)
        assert touch.changed_frame in range(touch.frame) and touch.plan
        touch.change({"nonsense": 1})
        until(lambda: bool(touch.read(80, timeout=60.0).size) and len(touch.problems) == 1)
        assert touch.problems[0].kind == "scene-refused"
        assert touch.read(80, timeout=60.0).shape == (80, touch.channels)


def test_realtime_blocks_arrive_without_credit(place: Place) -> None:
    if isinstance(place, MemoryPlace):
        pytest.skip("time does not pass in memory")
    with place.live(pacing="realtime") as touch:
        touch.move(0.01, 0.2)
        assert touch.read(400, timeout=60.0).shape == (400, touch.channels)
        assert touch.frame == 400 and touch.late >= 0.0
        assert len(touch.stop(timeout=60.0)) > 0


# The service of these tests


def test_the_samples_are_those_of_the_frames_that_are_read() -> None:
    with MemoryPlace().live({"output": {"channels": ["velocity", "force"]}}) as touch:
        assert np.array_equal(touch.read(100), sound(0, 100, 2))
        assert np.array_equal(touch.read(50), sound(100, 50, 2))
        assert touch.full_scale == (FULL_SCALE, FULL_SCALE) and touch.sample_rate == RATE


def test_a_lost_session_ends_the_stream_or_a_new_one_begins() -> None:
    place = MemoryPlace()
    with place.live() as touch:
        touch.read(100)
        place.service.forget()
        _break(touch)
        with pytest.raises(ResumeLost):
            touch.read(1, timeout=60.0)
    with place.live(reconnect="new") as touch:
        first = touch.session
        touch.read(100)
        place.service.forget()
        _break(touch)
        assert np.array_equal(touch.read(80, timeout=60.0), sound(0, 80, 1))
        assert touch.gaps == (100,) and touch.frame == 180 and touch.session != first


def test_without_reconnection_a_break_is_an_error_once_the_sound_is_read() -> None:
    with MemoryPlace().live(reconnect=False, ahead=100) as touch:
        until(lambda: round(touch.late * touch.sample_rate) == 100)  # frames come in several parts
        _break(touch)
        until(lambda: touch._protocol.over is not None)
        assert touch.read(100).shape == (100, 1)
        with pytest.raises(ConnectionLost):
            touch.read(1)


def _break(touch: Live) -> None:
    connection = touch._connection
    assert isinstance(connection, MemoryConnection)
    connection.cut()


def test_a_service_that_does_not_come_back_is_given_up() -> None:
    network = ThreadNetwork(Service())
    with Live(connect=network, backoff=Backoff(0.0, 0.0, patience=0.0)) as touch:
        touch.read(10)
        network.refuse = [Closure(None, "nobody listens")] * 10000
        _break(touch)
        with pytest.raises(ConnectionLost, match="nobody listens"):
            touch.read(10, timeout=60.0)


def test_a_move_does_not_wait_for_a_connection_that_takes_nothing() -> None:
    gate = threading.Event()

    class Stalled(MemoryConnection):
        def send(self, message: str | bytes) -> None:
            if isinstance(message, bytes):
                assert gate.wait(60.0)
            super().send(message)

    service = Service()
    with Live(connect=lambda address: Stalled(service, ThreadNetwork(service).line(address))) as touch:
        for step in range(1000):
            touch.move(0.001 * step)
        gate.set()
        touch.read(80, timeout=60.0)
        numbers = [contact[3] for contact in service.contacts()]
        assert numbers[-1] == 999 and len(numbers) <= 2


def test_a_read_that_times_out_loses_nothing() -> None:
    held: list[Callable[[], None]] = []

    class Held(MemoryConnection):
        def send(self, message: str | bytes) -> None:
            if isinstance(message, str) and '"more"' in message and not held:
                held.append(lambda: MemoryConnection.send(self, message))
            else:
                super().send(message)

    service = Service()
    with Live(connect=lambda address: Held(service, ThreadNetwork(service).line(address))) as touch:
        with pytest.raises(TimeoutError):
            touch.read(100, timeout=0.01)
        until(lambda: bool(held))
        held[0]()
        assert np.array_equal(touch.read(100, timeout=60.0), sound(0, 100, 1))


def test_a_cancelled_read_loses_nothing() -> None:
    async def cancelled() -> Block:
        async with MemoryPlace().live_async() as touch:
            reading = asyncio.create_task(touch.read(100))
            await asyncio.sleep(0)
            reading.cancel()
            await asyncio.gather(reading, return_exceptions=True)
            return await touch.read(150)

    assert np.array_equal(asyncio.run(cancelled()), sound(0, 150, 1))


def test_leaving_stops_the_session_and_ends_every_thread() -> None:
    service = Service()
    before = threading.active_count()
    with Live(connect=ThreadNetwork(service)) as touch:
        touch.read(10)
    assert service.heard("stop") == [{"type": "stop"}]
    assert threading.active_count() == before
    with pytest.raises(StreamEnded):
        touch.read(1)


def test_leaving_a_stream_that_has_just_ended_lets_its_connection_close() -> None:
    class SlowToClose(AsyncMemoryConnection):
        closed = 0

        async def close(self) -> None:
            for _ in range(20):
                await asyncio.sleep(0)
            await super().close()
            self.closed += 1

    async def stopped() -> SlowToClose:
        service = Service()
        connection = SlowToClose(service, Line(None))

        async def connect(_: object) -> SlowToClose:
            return connection

        async with AsyncLive(connect=connect) as touch:
            await touch.read(80)
            await touch.stop()
        return connection

    assert asyncio.run(stopped()).closed >= 1


def test_a_bug_in_a_connection_reaches_the_reader() -> None:
    def connect(_: object) -> MemoryConnection:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError), Live(connect=connect):
        pass


def test_a_stream_is_used_inside_with() -> None:
    touch = Live(connect=ThreadNetwork(Service()))
    with pytest.raises(ConnectionLost, match="inside `with`"):
        touch.read(1)


@pytest.mark.parametrize(
    ("options", "pointer"),
    [
        ({"url": "http://127.0.0.1:8000/v1/live"}, "/url"),
        ({"url": "ws://127.0.0.1:99999/v1/live"}, "/url"),
        ({"url": "ws://127.0.0.1:port/v1/live"}, "/url"),
        ({"url": "ws://[::1/v1/live"}, "/url"),
        ({"url": f"ws://{64 * 'a'}.b/v1/live"}, "/url"),
        ({"url": "ws://127.0.0.1:8000/v1/live#here"}, "/url"),
        ({"url": 5}, "/url"),
        ({"key": 5}, "/key"),
        ({"format": "wav"}, "/format"),
        ({"pacing": "fast"}, "/pacing"),
        ({"ahead": -1}, "/ahead"),
        ({"reconnect": "New"}, "/reconnect"),
        ({"block": 480.0}, "/block"),
        ({"scene": "paper-finger"}, ""),
    ],
)
def test_invalid_arguments_are_refused_at_once(options: dict[str, Any], pointer: str) -> None:
    with pytest.raises(InvalidRequest) as refused:
        Live(**options)
    assert [fault.pointer for fault in refused.value.faults] == [pointer]


@pytest.mark.parametrize("partial", ["grating-1mm-31um", None, [1]])
def test_a_change_that_is_no_mapping_is_refused_and_leaves_the_stream(partial: Any) -> None:
    with Live(connect=ThreadNetwork(Service())) as touch:
        with pytest.raises(InvalidRequest, match="a partial scene"):
            touch.change(partial)
        assert len(touch.read(10, timeout=10.0)) == 10


def test_a_checked_scene_of_the_engine_is_a_scene() -> None:
    from synth.scene.scene import parse_scene

    service = Service()
    with Live(parse_scene({"scan": {"load": "0.2 N"}}), connect=ThreadNetwork(service)):
        assert service.heard("hello")[0]["scene"]["scan"]["load"] == 0.2
