"""`Live` and `AsyncLive`: what a person does with them, over connections in memory and over a real WebSocket.

What goes through `place` holds of every service that speaks the protocol; here that is the service of `fake_live`.
"""

from __future__ import annotations

import asyncio
import socket
import threading
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import ExitStack, asynccontextmanager, contextmanager
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clients import AsyncLive, Client, ConnectionLost, Live, RefusedError, ResumeLost, StreamEnded
from clients.live_reconnect import Backoff, Closure
from synth.errors import AskedWrong
from tests.clients.fake_live import FULL_SCALE, RATE, Service, sound
from tests.clients.loopback import LoopbackService, cutting
from tests.clients.memory_connection import LoopNetwork, MemoryConnection, ThreadNetwork
from tests.service.harness import until

AT_ONCE = {"first": 0.0, "largest": 0.0}
Block = npt.NDArray[np.float32]
Cuts = tuple[int | None, ...]


class Place(Protocol):
    """Where a service is to be had; cuts: the byte from the service after which each connection breaks."""

    def live(self, scene: Any = None, cuts: Cuts = (), **options: Any) -> Any: ...
    def live_async(self, scene: Any = None, cuts: Cuts = (), **options: Any) -> Any: ...


class MemoryPlace:
    """No socket."""

    def __init__(self) -> None:
        self.service = Service()

    @contextmanager
    def live(self, scene: Any = None, cuts: Cuts = (), **options: Any) -> Iterator[Live]:
        options.setdefault("backoff", Backoff(**AT_ONCE))
        with Live(scene, connect=ThreadNetwork(self.service, cuts), **options) as touch:
            yield touch

    @asynccontextmanager
    async def live_async(self, scene: Any = None, cuts: Cuts = (), **options: Any) -> AsyncIterator[AsyncLive]:
        options.setdefault("backoff", Backoff(**AT_ONCE))
        async with AsyncLive(scene, connect=LoopNetwork(self.service, cuts), **options) as touch:
            yield touch


class WebSocketPlace:
    """A real WebSocket to `url`, through a proxy where there are cuts."""

    def __init__(self, url: str) -> None:
        self.url = url

    @contextmanager
    def live(self, scene: Any = None, cuts: Cuts = (), **options: Any) -> Iterator[Live]:
        options.setdefault("backoff", Backoff(**AT_ONCE))
        with ExitStack() as opened:
            url = opened.enter_context(cutting(self.url, cuts)) if cuts else self.url
            yield opened.enter_context(Live(scene, url=url, **options))

    @asynccontextmanager
    async def live_async(self, scene: Any = None, cuts: Cuts = (), **options: Any) -> AsyncIterator[AsyncLive]:
        options.setdefault("backoff", Backoff(**AT_ONCE))
        with ExitStack() as opened:
            url = opened.enter_context(cutting(self.url, cuts)) if cuts else self.url
            async with AsyncLive(scene, url=url, **options) as touch:
                yield touch


@pytest.fixture(scope="module")
def loopback() -> Iterator[LoopbackService]:
    with LoopbackService(Service()) as service:
        yield service


@pytest.fixture(params=["memory", "websocket"])
def place(request: pytest.FixtureRequest) -> Place:
    if request.param == "memory":
        return MemoryPlace()
    return WebSocketPlace(request.getfixturevalue("loopback").url)


def stroke(touch: Live, reads: list[int]) -> Block:
    """Move before each read; return all that was read."""
    blocks = []
    for number, frames in enumerate(reads):
        touch.move(0.001 * number, 0.3)
        blocks.append(touch.read(frames, timeout=20.0))
    return np.concatenate(blocks)


async def stroke_async(touch: AsyncLive, reads: list[int]) -> Block:
    blocks = []
    for number, frames in enumerate(reads):
        touch.move(0.001 * number, 0.3)
        async with asyncio.timeout(20.0):
            blocks.append(await touch.read(frames))
    return np.concatenate(blocks)


READS = [80, 1, 200, 80, 37, 160, 800]


# Any service


def test_a_read_has_exactly_the_frames_asked_for(place: Place) -> None:
    with place.live() as touch:
        for frames in (1, 479, 80, 0, 1000):
            block = touch.read(frames, timeout=20.0)
            assert block.shape == (frames, touch.channels) and block.dtype == np.float32
        assert touch.frame == 1560
        assert len(touch.full_scale) == len(touch.quantities) == touch.channels


def test_the_sound_follows_the_hand_from_the_next_read_on(place: Place) -> None:
    with place.live() as touch:
        assert touch.applied is None
        touch.read(200, timeout=20.0)
        seq = touch.move(0.01, 0.2)
        touch.read(100, timeout=20.0)
        assert touch.applied == (seq, 200)


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


def test_a_stopped_stream_gives_its_fade_and_then_its_end(place: Place) -> None:
    with place.live() as touch:
        touch.read(100, timeout=20.0)
        tail = touch.stop(timeout=20.0)
        assert tail.shape[1] == touch.channels and len(tail) > 0
        with pytest.raises(StreamEnded) as ended:
            touch.read(1, timeout=20.0)
        assert ended.value.reason == "stopped"

    async def stopped() -> Block:
        async with place.live_async() as touch:
            await touch.read(100)
            return await touch.stop()

    assert asyncio.run(stopped()).shape == tail.shape


def test_a_refused_scene_is_an_exception_that_says_what_is_wrong(place: Place) -> None:
    with pytest.raises(RefusedError) as refused, place.live({"nonsense": 1}):
        pass
    assert refused.value.problem.status == 422
    assert [fault.pointer for fault in refused.value.faults] == ["/nonsense"]

    async def opened() -> None:
        async with place.live_async({"nonsense": 1}):
            pass

    with pytest.raises(RefusedError):
        asyncio.run(opened())


def test_a_change_is_told_by_the_plan_and_a_refused_one_by_a_problem(place: Place) -> None:
    with place.live() as touch:
        before = touch.plan
        touch.change({"scan": {"load": 0.2}})
        until(lambda: bool(touch.read(80, timeout=20.0).size) and touch.plan != before)
        touch.change({"nonsense": 1})
        until(lambda: bool(touch.read(80, timeout=20.0).size) and len(touch.problems) == 1)
        assert touch.problems[0].kind == "scene-refused"
        assert touch.read(80, timeout=20.0).shape == (80, touch.channels)


def test_realtime_comes_by_itself(place: Place) -> None:
    if isinstance(place, MemoryPlace):
        pytest.skip("time does not pass in memory")
    with place.live(pacing="realtime") as touch:
        touch.move(0.01, 0.2)
        assert touch.read(400, timeout=20.0).shape == (400, touch.channels)
        assert touch.frame == 400 and touch.late >= 0.0
        assert len(touch.stop(timeout=20.0)) > 0


# The service of these tests


def test_the_samples_are_those_of_the_frames_that_are_read() -> None:
    with MemoryPlace().live({"output": {"channels": ["velocity", "force"]}}) as touch:
        assert np.array_equal(touch.read(100), sound(0, 100, 2))
        assert np.array_equal(touch.read(50), sound(100, 50, 2))
        assert touch.full_scale == (FULL_SCALE, FULL_SCALE) and touch.sample_rate == RATE


def test_a_session_that_is_gone_ends_the_stream_or_begins_another() -> None:
    place = MemoryPlace()
    with place.live() as touch:
        touch.read(100)
        place.service.forget()
        _break(touch)
        with pytest.raises(ResumeLost):
            touch.read(1, timeout=20.0)
    with place.live(reconnect="new") as touch:
        first = touch.session
        touch.read(100)
        place.service.forget()
        _break(touch)
        assert np.array_equal(touch.read(80, timeout=20.0), sound(0, 80, 1))
        assert touch.gaps == (100,) and touch.frame == 180 and touch.session != first


def test_without_reconnection_a_break_is_an_error_once_the_sound_is_read() -> None:
    with MemoryPlace().live(reconnect=False, ahead=100) as touch:
        until(lambda: touch.late > 0.0)
        _break(touch)
        until(lambda: touch._core.over is not None)
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
            touch.read(10, timeout=20.0)


def test_a_move_does_not_wait_for_a_connection_that_takes_nothing() -> None:
    gate = threading.Event()

    class Stalled(MemoryConnection):
        def send(self, message: str | bytes) -> None:
            if isinstance(message, bytes):
                assert gate.wait(20.0)
            super().send(message)

    service = Service()
    with Live(connect=lambda address: Stalled(service, ThreadNetwork(service).line(address))) as touch:
        for step in range(1000):
            touch.move(0.001 * step)
        gate.set()
        touch.read(80, timeout=20.0)
        numbers = [contact[3] for contact in service.contacts()]
        assert numbers[-1] == 999 and len(numbers) <= 2


def test_a_read_that_was_given_up_loses_nothing() -> None:
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
        assert np.array_equal(touch.read(100, timeout=20.0), sound(0, 100, 1))


def test_a_cancelled_read_loses_nothing() -> None:
    async def cancelled() -> Block:
        async with MemoryPlace().live_async() as touch:
            reading = asyncio.create_task(touch.read(100))
            await asyncio.sleep(0)
            reading.cancel()
            await asyncio.gather(reading, return_exceptions=True)
            return await touch.read(150)

    assert np.array_equal(asyncio.run(cancelled()), sound(0, 150, 1))


def test_leaving_tells_the_service_to_stop_and_ends_every_thread() -> None:
    service = Service()
    before = threading.active_count()
    with Live(connect=ThreadNetwork(service)) as touch:
        touch.read(10)
    assert service.heard("stop") == [{"type": "stop"}]
    assert threading.active_count() == before
    with pytest.raises(StreamEnded):
        touch.read(1)


def test_a_mistake_of_a_connection_reaches_the_reader() -> None:
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
        ({"format": "wav"}, "/format"),
        ({"pacing": "fast"}, "/pacing"),
        ({"ahead": -1}, "/ahead"),
        ({"scene": "paper-finger"}, ""),
    ],
)
def test_arguments_that_cannot_be_are_refused_at_once(options: dict[str, Any], pointer: str) -> None:
    with pytest.raises(AskedWrong) as refused:
        Live(**options)
    assert [fault.pointer for fault in refused.value.faults] == [pointer]


def test_a_checked_scene_of_the_engine_is_a_scene() -> None:
    from synth.scene import parse_scene

    service = Service()
    with Live(parse_scene({"scan": {"load": "0.2 N"}}), connect=ThreadNetwork(service)):
        assert service.heard("hello")[0]["scene"]["scan"]["load"] == 0.2


# The wire


def test_the_opening_is_what_the_protocol_says_to_the_byte() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
        heads: list[bytes] = []

        def answer() -> None:
            client, _ = listener.accept()
            with client:
                head = b""
                while not head.endswith(b"\r\n\r\n"):
                    head += client.recv(65536)
                heads.append(head)
                client.sendall(b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\nConnection: close\r\n\r\n")

        thread = threading.Thread(target=answer, daemon=True)
        thread.start()
        with pytest.raises(RefusedError) as refused, Live(url=f"ws://127.0.0.1:{port}/v1/live", key="se/cr+et"):
            pass
        thread.join(20.0)
    assert refused.value.problem.status == 404
    lines = heads[0].decode().split("\r\n")
    assert lines[0] == "GET /v1/live HTTP/1.1"
    assert "Sec-WebSocket-Protocol: ridgewave.v1, ridgewave.key.c2UvY3IrZXQ" in lines
    assert not any(line.lower().startswith(("sec-websocket-extensions", "authorization")) for line in lines)


def test_a_key_lets_in_and_its_lack_is_a_problem() -> None:
    with LoopbackService(Service(), key="a2V5") as service:
        with Live(url=service.url, key="key") as touch:
            touch.read(10, timeout=20.0)
        with pytest.raises(RefusedError) as refused, Live(url=service.url):
            pass
    assert refused.value.problem.kind == "key-required"


def test_a_service_of_another_kind_is_not_taken_for_this_one() -> None:
    from websockets.sync.server import serve

    with serve(lambda connection: None, "127.0.0.1", 0) as server:
        thread = threading.Thread(target=server.serve_forever, daemon=True)
        thread.start()
        port = server.socket.getsockname()[1]
        with pytest.raises(ConnectionLost, match=r"does not speak ridgewave\.v1"), Live(url=f"ws://127.0.0.1:{port}/"):
            pass
        server.shutdown()
        thread.join(20.0)


def test_nobody_listening_is_said_at_once() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
    with pytest.raises(ConnectionLost), Live(url=f"ws://127.0.0.1:{port}/v1/live"):
        pass

    async def opened() -> None:
        async with AsyncLive(url=f"ws://127.0.0.1:{port}/v1/live"):
            pass

    with pytest.raises(ConnectionLost):
        asyncio.run(opened())


def test_a_peer_that_is_gone_without_a_word_is_found_by_a_ping(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("clients.live_connection.PING_SECONDS", 0.1)
    monkeypatch.setattr("clients.live_connection.CLOSE_SECONDS", 0.1)
    with (
        LoopbackService(Service()) as service,
        silenced(service.url) as (url, silence),
        Live(url=url, backoff=Backoff(**AT_ONCE)) as touch,
    ):
        first = touch.read(100, timeout=20.0)
        silence.set()
        assert np.array_equal(touch.read(100, timeout=20.0), sound(100, 100, 1))
        assert touch.reconnections == 1
    assert np.array_equal(first, sound(0, 100, 1))


@contextmanager
def silenced(url: str) -> Iterator[tuple[str, threading.Event]]:
    """Yield the address of a proxy to `url`, and what makes its first connection pass nothing more, and not end."""
    host, _, port = url.removeprefix("ws://").partition("/")[0].partition(":")
    silence = threading.Event()
    listener = socket.create_server(("127.0.0.1", 0))
    pairs: list[socket.socket] = []

    def pass_on(source: socket.socket, sink: socket.socket, mute: threading.Event | None) -> None:
        try:
            while data := source.recv(65536):
                if mute is None or not mute.is_set():
                    sink.sendall(data)
            sink.shutdown(socket.SHUT_WR)
        except OSError:
            pass

    def accept() -> None:
        mute: threading.Event | None = silence
        while True:
            try:
                client, _ = listener.accept()
            except OSError:
                return
            server = socket.create_connection((host, int(port)))
            pairs.extend((client, server))
            for source, sink in ((client, server), (server, client)):
                threading.Thread(target=pass_on, args=(source, sink, mute), daemon=True).start()
            mute = None

    thread = threading.Thread(target=accept, daemon=True)
    thread.start()
    try:
        yield f"ws://127.0.0.1:{listener.getsockname()[1]}/v1/live", silence
    finally:
        listener.shutdown(socket.SHUT_RDWR)
        listener.close()
        thread.join(20.0)
        for sock in pairs:
            sock.close()


def test_the_recording_is_fetched_from_the_same_service(loopback: LoopbackService) -> None:
    with Live(url=loopback.url, record=True) as touch:
        touch.move(0.25, 0.1)
        touch.read(80, timeout=20.0)
        assert touch.recording() == {"contacts": [{"seq": 0, "value": 0.25}]}
        with Client(loopback.http) as client:
            assert client.recording(touch.session) == touch.recording()

    async def recorded() -> dict[str, Any]:
        async with AsyncLive(url=loopback.url, record=True) as touch:
            touch.slide(0.5, 0.1)
            await touch.read(80)
            return await touch.recording()

    assert asyncio.run(recorded()) == {"contacts": [{"seq": 0, "value": 0.5}]}


@settings(max_examples=12)
@given(cuts=st.lists(st.integers(800, 4000), min_size=1, max_size=4))
def test_resets_at_any_byte_of_a_real_socket_leave_the_same_samples(loopback: LoopbackService, cuts: list[int]) -> None:
    place = WebSocketPlace(loopback.url)
    with place.live() as touch:
        whole = stroke(touch, READS)
    with place.live(cuts=tuple(cuts)) as touch:
        assert np.array_equal(stroke(touch, READS), whole)
