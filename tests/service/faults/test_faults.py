"""Faulty networks and clients disturb no other stream, leave no resources behind, and get an error.

Witnesses (`witnesses`) run beside each fault: well-behaved real-time streams in their own process. The tests assert:
    always: no block of a witness is missing, out of place or of a wrong size, and no witness sees an error of protocol;
    in one of `ATTEMPTS` runs: the latest block during the fault is at most one block later than the latest block of the
        calm time before it, plus what the machine itself was late in waking (`wakes`);
    always: afterwards the server has no more tasks, file descriptors and sessions than before (polled, since sessions
        of broken connections are kept for a while), and a repetition of the fault raises its resident memory, after a
        full garbage collection, by at most `GROWTH`.
"""

from __future__ import annotations

import random
import socket
import struct
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import httpx
import numpy as np
import pytest

from tests.bench.live_frames import BINARY, TEXT, contact_frames, frame
from tests.service.faults.caller import PATIENCE, Caller
from tests.service.faults.proxy import Proxy, proxied
from tests.service.faults.serve_inspected import PATH
from tests.service.faults.witnesses import BLOCK, RATE, witnesses
from tests.service.harness import Child, roomy_environment, until
from tests.service.wakes import wakes

MODULE = "tests.service.faults.serve_inspected"
KEPT_SECONDS = 1.0  # that the server keeps the session of a broken connection in these tests
GROWTH = 0.05  # of the resident memory
SETTLE_SECONDS = 30.0  # for what a fault leaves: unanswered pings, and what closing a dead peer takes
ATTEMPTS = 3
SLOW_SECONDS = 2.0  # longer than a reader may be behind; more decides nothing
CALM_SECONDS = 1.0
SLOW_READER = 4408  # close code
Fault = Callable[[], None]

ALONE = pytest.mark.alone  # with witnesses, or with a proxy that must keep up with a stream


class Served:
    """The service in a process of its own, and what it holds."""

    def __init__(self, url: str, folder: Path) -> None:
        self.url, self.folder = url, folder
        address = urlsplit(url)
        self.address = (address.hostname or "", address.port or 80)
        self.port = self.address[1]

    def held(self) -> dict[str, Any]:
        """Return what the process holds now."""
        found: dict[str, Any] = httpx.get(self.url + PATH, headers={"Connection": "close"}, timeout=PATIENCE).json()
        return found

    def settled(self, before: dict[str, Any]) -> dict[str, Any]:
        """Wait until the process holds no more tasks, files and sessions than `before`; return what it holds."""
        found = self.held()

        def back() -> bool:
            nonlocal found
            found = self.held()
            counts = [(len(one["tasks"]), one["files"], one["sessions"]) for one in (found, before)]
            return all(now <= then for now, then in zip(*counts, strict=True))

        try:
            until(back, SETTLE_SECONDS)
        except AssertionError:
            pytest.fail(f"left behind: {found} after {before}")
        return found


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    folder = tmp_path_factory.mktemp("faults")
    child = Child(MODULE, folder, RIDGEWAVE_RESUME=str(KEPT_SECONDS), **roomy_environment())
    try:
        made = Served(child.url(), folder)
        with Caller(made.port) as first:  # what a first stream brings with it for good is no leak
            first.hello()
            first.read(lambda: len(first.sound) > 4 * RATE // 10)
        time.sleep(2 * KEPT_SECONDS)
        yield made
        assert "our mistake" not in child.log.read_text(), child.log.read_text()[-4000:]
    finally:
        child.terminate()


@pytest.fixture
def proxy(served: Served) -> Iterator[Proxy]:
    with proxied(served.address) as made:
        yield made


def undisturbed(served: Served, fault: Fault) -> None:
    """Fail unless the witnesses of `fault` get all their blocks, on time in one of several attempts."""
    found = []
    for _ in range(ATTEMPTS):
        with wakes(served.folder) as woken, witnesses(served.url, served.folder) as seen:
            calm = seen.during(lambda: time.sleep(CALM_SECONDS))
            under = seen.during(fault)
            seen.end()
            machine = woken.latest(under)
        assert seen.report["missing"] == 0 and seen.report["mistaken_streams"] == 0, seen.report
        found.append((seen.latest(calm), seen.latest(under), machine))
        if found[-1][1] <= found[-1][0] + BLOCK / RATE + machine:
            return
    pytest.fail(f"witnesses were late, s, calm and under the fault, and the machine: {found}")


def suffered(served: Served, fault: Fault) -> None:
    """Fail unless witnesses do not notice `fault`, nothing of it stays, and it costs no memory when it comes again."""
    before = served.held()
    undisturbed(served, fault)
    warm = served.settled(before)
    fault()
    after = served.settled(before)
    assert after["resident_bytes"] <= (1.0 + GROWTH) * warm["resident_bytes"]


def contiguous(caller: Caller) -> None:
    """Fail unless all the sound came that the end, if there is one, says there was."""
    for end in caller.named("end"):
        assert len(caller.sound) == 4 * end["frame"], "sound was dropped"


def slow(served: Served, proxy: Proxy, **treatment: object) -> None:
    """Make one reader slow for SLOW_SECONDS: it is closed as slow, and receives all but the waiting block."""
    with Caller(proxy.port) as caller:
        caller.hello()
        link = proxy.links[-1]
        caller.read(lambda: len(caller.sound) > 4 * RATE // 5)
        link.treat("down", **treatment)
        time.sleep(SLOW_SECONDS)
        link.treat("down", stalled=False, bytes_per_second=None)
        caller.read()
        assert caller.code == SLOW_READER, caller.messages
        (end,) = caller.named("end")
        assert end["reason"] == "slow reader"
        assert 0 <= end["frame"] - len(caller.sound) // 4 <= BLOCK, "more is lost than the block that waited last"


@ALONE
def test_a_reader_that_stalls_delays_nobody_and_is_closed(served: Served, proxy: Proxy) -> None:
    suffered(served, lambda: slow(served, proxy, stalled=True))


@ALONE
@pytest.mark.thorough  # for the service it stalls, now and then
def test_a_reader_on_a_thin_line_delays_nobody_and_is_closed(served: Served, proxy: Proxy) -> None:
    suffered(served, lambda: slow(served, proxy, bytes_per_second=30_000.0))


@ALONE
def test_a_stall_within_the_bound_costs_no_sound(served: Served, proxy: Proxy) -> None:
    with Caller(proxy.port) as caller:
        caller.hello()
        link = proxy.links[-1]
        caller.read(lambda: len(caller.sound) > 4 * RATE // 5)
        link.treat("down", stalled=True)
        time.sleep(0.3)
        link.treat("down", stalled=False)
        caller.read(lambda: len(caller.sound) > 4 * RATE)
        caller.say(type="stop")
        caller.read()
    assert caller.named("end")[-1]["reason"] == "stopped" and caller.code == 1000
    contiguous(caller)


@ALONE
def test_bytes_split_anywhere_are_the_same_stream(served: Served, proxy: Proxy) -> None:
    with Caller(proxy.port) as caller:
        until(lambda: len(proxy.links) == 1)
        for direction in ("up", "down"):
            proxy.links[0].treat(direction, splits=40)
        caller.hello()
        for seq in range(50):
            caller.say(type="contact", seq=seq, time=seq / 100, position=1e-4 * seq, load=0.3)
            caller.read(lambda count=seq: len(caller.sound) >= 4 * BLOCK * count)
        caller.read(lambda: bool(caller.named("applied")) and caller.named("applied")[-1]["seq"] == 49)
        caller.say(type="stop")
        caller.read()
    assert caller.named("problem") == []
    assert caller.named("end")[-1]["reason"] == "stopped"
    contiguous(caller)


@ALONE
@pytest.mark.thorough  # many of those that connect and leave anyhow are reset
def test_connections_that_are_reset_leave_nothing(served: Served, proxy: Proxy) -> None:
    def fault() -> None:
        for _ in range(50):
            caller = Caller(proxy.port).hello()
            proxy.links[-1].reset()
            caller.connection.close()

    suffered(served, fault)


def test_a_connection_whose_cable_is_pulled_ends_and_leaves_nothing(served: Served, proxy: Proxy) -> None:
    """That it delays nobody is shown by a reader that stalls: to the service both look alike."""
    before = served.held()
    with Caller(proxy.port) as caller:
        caller.hello()
        proxy.links[-1].half_open()
        time.sleep(1.5)
    served.settled(before)


@ALONE
def test_a_hand_whose_cable_was_pulled_picks_its_stream_up_again(served: Served, proxy: Proxy) -> None:
    with Caller(proxy.port) as before:
        before.hello()
        before.read(lambda: len(before.sound) >= 4 * 20 * BLOCK)
        proxy.links[-1].half_open()
        heard = len(before.sound) // 4
        with Caller(served.port) as after:
            after.open().say(type="hello", resume={"session": before.named("ready")[0]["session"], "frame": heard})
            after.read(lambda: len(after.sound) > 4 * 5 * BLOCK)
            assert after.named("ready")[0]["frame"] == heard
            after.say(type="stop")
            after.read()
    assert len(after.sound) == 4 * (after.named("end")[-1]["frame"] - heard)


def churn(served: Served, count: int, seed: int) -> None:
    """Connect and leave `count` times: properly, by reset, in mid-handshake, in mid-message."""
    chance = random.Random(seed)
    for _ in range(count):
        way = chance.randrange(6)
        caller = Caller(served.port)
        request = caller.request()
        if way == 0:  # says nothing
            pass
        elif way == 1:  # in mid-handshake
            caller.connection.sendall(request[: chance.randrange(1, len(request))])
        elif way == 2:  # in mid-hello
            caller.open().connection.sendall(b"\x81\xfe\x01\x00abcd" + bytes(chance.randrange(200)))
        elif way == 3:  # open, without a hello
            caller.open()
        elif way == 4:  # in mid-contact
            caller.hello().connection.sendall(update(0)[: chance.randrange(1, 34)])
        else:  # properly
            caller.hello().say(type="stop")
            caller.read()
        if chance.random() < 0.5:
            caller.break_off()
        else:
            caller.connection.close()


@ALONE
@pytest.mark.parametrize("count", [150, pytest.param(400, marks=pytest.mark.thorough)])
def test_many_that_connect_and_leave_anyhow_leave_nothing(served: Served, count: int) -> None:
    seeds = iter(range(100))
    suffered(served, lambda: churn(served, count, next(seeds)))


def update(seq: int) -> bytes:
    """Return the frame of one contact update."""
    one = np.array([float(seq)])
    return contact_frames(seq, one / 100.0, 1e-6 * one, 0.3 + 0.0 * one, np.random.default_rng(seq))


def garbage(seed: int) -> list[bytes]:
    """Return invalid bytes that a client may send after the handshake."""
    chance = random.Random(seed)
    texts = [
        b"", b"{", b"null", b"[]", b"\xff\xfe", b'"hello"', b'{"type": 1}', b'{"type": "nothing"}', b"[" * 30_000,
        b'{"type": "hello", "block": 1e999}', b'{"type": "hello", "scene": []}', b'{"type": "hello", "block": NaN}',
        b'{"type": "contact", "seq": -1, "time": 0, "position": 0}', b'{"type": "more", "frames": 1e30}',
        b'{"type": "hello", "resume": {"session": "../../etc", "frame": -5}}', b'{"type": "hello\\u0000"}',
    ]  # fmt: skip
    raw = [
        b"\x81\x05plain",  # not masked
        b"\x83\x80abcd",  # a kind that is reserved
        b"\xc1\x80abcd",  # an extension that was not agreed on
        b"\x82\xff\x7f\xff\xff\xff\xff\xff\xff\xffabcd",  # 2^63 bytes are promised
        b"\x82\xff\x00\x00\x00\x00\x00\x02\x00\x00abcd" + bytes(1 << 17),  # more than a message may have
        b"\x80\x80abcd",  # goes on with nothing
        b"\x89\xfe\x00\x80abcd" + bytes(128),  # a ping that is too long
        b"GET / HTTP/1.1\r\n\r\n",
    ]
    made = [frame(TEXT, text) for text in texts] + raw
    made += [frame(BINARY, chance.randbytes(chance.randrange(64))) for _ in range(8)]
    made += [chance.randbytes(chance.randrange(1, 400)) for _ in range(8)]
    return made


def contact(version: int, flags: int, number: int, time_s: float, value: float, load: float) -> bytes:
    """Return the payload of a binary update, right or wrong."""
    return struct.pack("<BBHIddf", version, flags, number, 1, time_s, value, load)


NO_UPDATES = [
    contact(2, 0, 0, 0.0, 0.0, 0.3),
    contact(1, 255, 0, 0.0, 0.0, 0.3),
    contact(1, 0, 7, 0.0, 0.0, 0.3),
    contact(1, 0, 0, float("nan"), 0.0, 0.3),
    contact(1, 0, 0, 0.0, float("inf"), 0.3),
    contact(1, 0, 0, 0.0, 0.0, float("nan")),
    contact(1, 1, 0, 0.0, 1e300, 0.3),
    contact(1, 0, 0, 0.0, 0.0, -1.0),
    contact(1, 0, 0, 0.0, 0.0, 0.3)[:-1],
]


@ALONE
def test_garbage_is_answered_with_a_close_and_disturbs_nobody(served: Served) -> None:
    def fault() -> None:
        for text in garbage(1):
            with Caller(served.port) as caller:
                caller.open().connection.sendall(text)
                caller.connection.shutdown(1)
                caller.read()
                assert caller.over and not caller.sound, text[:60]

    suffered(served, fault)


@pytest.mark.parametrize("payload", NO_UPDATES, ids=range(len(NO_UPDATES)))
def test_an_update_that_is_none_is_a_problem_and_the_stream_goes_on(served: Served, payload: bytes) -> None:
    with Caller(served.port) as caller:
        caller.hello()
        caller.send(BINARY, payload)
        caller.read(lambda: bool(caller.named("problem")))
        heard = len(caller.sound)
        caller.read(lambda: len(caller.sound) >= heard + 4 * 10 * BLOCK)
        caller.say(type="stop")
        caller.read()
    assert caller.named("end")[-1]["reason"] == "stopped", caller.messages
    assert caller.named("applied") == []
    contiguous(caller)


def flood(served: Served, seconds: float, rate_hz: float = 10_000.0) -> None:
    """Send updates at `rate_hz` for `seconds`, read what comes meanwhile, and break off: a stop would wait its turn."""
    with Caller(served.port) as caller:
        caller.hello()
        reading = threading.Thread(target=caller.read)
        reading.start()
        begin, sent = time.perf_counter(), 0
        while (elapsed := time.perf_counter() - begin) < seconds:
            due = int(elapsed * rate_hz) - sent
            times = np.arange(sent, sent + due) / rate_hz
            random_masks = np.random.default_rng(sent)
            position = 1e-3 * np.sin(times)
            frames = contact_frames(sent, times, position, np.full(due, 0.3), random_masks)
            caller.connection.sendall(frames)
            sent += due
            time.sleep(0.002)
        caller.connection.shutdown(socket.SHUT_RDWR)
        reading.join(PATIENCE)
        assert not reading.is_alive(), "the stream did not end"
        contiguous(caller)


@ALONE
@pytest.mark.parametrize("seconds", [1.5, pytest.param(4.0, marks=pytest.mark.thorough)])
def test_a_flood_of_updates_delays_nobody(served: Served, seconds: float) -> None:
    suffered(served, lambda: flood(served, seconds))
