"""A process at its capacity refuses further streams in words; those that it admitted are not touched."""

from __future__ import annotations

import asyncio
import time
from contextlib import ExitStack
from typing import Any

import pytest

from service.operations.load_meter import LoadMeter
from service.problems import Problem
from service.sessions.admission import FEW, LATE_SECONDS, MANY, ONE_IN, PROVEN_SECONDS, stream_admitted
from tests.service.harness import Running, problem, serving, until, warmed_up
from tests.service.live.client import LiveClient, live
from tests.service.plain_engine import PlainEngine


class Times:
    """Two clocks that the test moves: seconds that passed, and seconds in which the thread ran."""

    def __init__(self) -> None:
        self.now = self.used = 0.0

    def meter(self, streams: int = 0) -> LoadMeter:
        made = LoadMeter(lambda: self.now, lambda: self.used)
        made.streams = streams
        return made

    def pass_by(self, meter: LoadMeter, seconds: float, *, busy: float, late: float | None = None) -> None:
        """Let `seconds` pass, with a look and a block every 50 ms."""
        for _ in range(round(seconds / 0.05)):
            self.now, self.used = self.now + 0.05, self.used + 0.05 * busy
            if late is not None:
                meter.sent(late)
            meter.look()


def admitted(meter: LoadMeter, full_at: float = 0.9) -> str:
    """Return what a refusal says; "" where the stream is admitted."""
    try:
        asyncio.run(stream_admitted(meter, full_at))
    except Problem as refused:
        assert refused.kind == "full" and int(refused.headers["Retry-After"]) > 0
        return str(refused.detail)
    return ""


def test_the_load_is_that_of_the_last_second() -> None:
    times = Times()
    meter = times.meter()
    assert (meter.busy, meter.late) == (0.0, 0.0)
    times.pass_by(meter, 5.0, busy=0.97, late=0.3)
    assert meter.busy == pytest.approx(0.97) and meter.late == pytest.approx(0.3)
    times.pass_by(meter, 0.5, busy=0.37, late=0.1)
    assert meter.busy == pytest.approx(0.67, abs=0.04) and meter.late == pytest.approx(0.2, abs=0.02)
    times.pass_by(meter, 1.2, busy=0.1)
    assert meter.busy == pytest.approx(0.1) and meter.late == 0.0, "nothing was sent in the last second"


@pytest.mark.parametrize(("busy", "late", "words"), [
    (0.93, 0.0, ["93 %", "RIDGEWAVE_FULL_AT: 90 %", "longer blocks", "more workers"]),
    (0.40, 1.5 * LATE_SECONDS, ["40 % of the time only", "30 ms late", "allowed: 20 ms", "Other work on this machine"]),
])  # fmt: skip
def test_a_refusal_says_what_was_measured_and_what_to_change(busy: float, late: float, words: list[str]) -> None:
    times = Times()
    meter = times.meter(streams=40)
    times.pass_by(meter, 2.0, busy=busy, late=late)
    refused = admitted(meter)
    assert all(word in refused for word in ["40 streams", *words])
    assert admitted(meter, full_at=1.0) == "", "1 turns it off"
    meter.streams = FEW - 1
    assert admitted(meter) == "", "a few streams are always admitted"


def test_streams_that_no_hand_moves_yet_count_as_if_one_did() -> None:
    times = Times()
    meter = times.meter(streams=40)
    meter.live = 40
    times.pass_by(meter, 2.0, busy=0.612)
    refused = admitted(meter)
    assert "61 % of the time, which would be 92 % if hands moved its 40 resting streams" in refused
    for stream in range(30):
        meter.moved(stream)
    assert admitted(meter) == "" and meter.resting == 10, "their work is in what was measured"
    times.pass_by(meter, 1.5, busy=0.612)
    assert meter.resting == 40 and admitted(meter), "their hands have gone"


def test_a_process_with_room_admits() -> None:
    times = Times()
    meter = times.meter(streams=40)
    times.pass_by(meter, 2.0, busy=0.85, late=0.5 * LATE_SECONDS)
    assert admitted(meter) == ""


@pytest.mark.parametrize(("streams", "busy", "at_a_time"), [
    (0, 0.0, MANY), (40, 0.4, MANY), (2, 0.5, FEW), (40, 0.5, FEW), (10 * ONE_IN, 0.6, 10)])  # fmt: skip
def test_few_streams_at_a_time_are_unproven(
    streams: int, busy: float, at_a_time: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The rest of a burst waits; the waiting ends when those before are proven, or after TURN_SECONDS."""
    times = Times()
    meter = times.meter(streams)
    times.pass_by(meter, 2.0, busy=busy)
    waits: list[float] = []

    async def pass_by(seconds: float) -> None:
        waits.append(seconds)
        times.now += seconds

    monkeypatch.setattr("service.sessions.admission.sleep", pass_by)
    for _ in range(at_a_time):
        assert admitted(meter) == "" and waits == []
    assert admitted(meter) == ""
    assert sum(waits) == pytest.approx(PROVEN_SECONDS, abs=0.06)
    monkeypatch.setattr(LoadMeter, "begun", lambda *_: at_a_time)
    assert "More streams begin" in admitted(meter)


def burn(engine: PlainEngine, seconds: float) -> None:
    """Make every block of the newest voice take `seconds` of the event loop."""
    voice = engine.hands[-1]
    render = voice.render

    def slowly(frames: int) -> Any:
        time.sleep(seconds)
        return render(frames)

    voice.render = slowly  # type: ignore[method-assign]


def listening(running: Running, engine: PlainEngine, clients: ExitStack) -> LiveClient:
    """Open another live stream, which takes the event loop for half of its time."""
    client = clients.enter_context(live(running))
    client.hello(pacing="realtime", block=480)
    client.frames(480)
    burn(engine, 0.005)
    return client


def test_a_stream_beyond_the_capacity_is_refused_live_and_over_http() -> None:
    """Four streams of half a processor each; the fifth is closed with 1013, and the stream of a session is a 503."""
    engine = PlainEngine()
    with serving(engine, full_at=0.9) as running, ExitStack() as clients:
        warmed_up(running, engine)
        session = running.client.post("/v1/sessions", json={}).json()
        under_way = [listening(running, engine, clients) for _ in range(FEW)]
        load = running.service.metrics.load
        until(lambda: load.late > 2.0 * LATE_SECONDS)
        fifth = clients.enter_context(live(running))
        fifth.say("hello", pacing="realtime", block=480)
        fifth.rest()
        assert fifth.code == 1013
        (refusal,) = fifth.texts("problem")
        assert "capacity" in refusal["detail"]
        answer = running.client.get(f"/v1/sessions/{session['id']}/stream")
        assert "capacity" in problem(answer, 503, "full")["detail"]
        assert int(answer.headers["retry-after"]) > 0
        assert all(client.code is None for client in under_way)
