"""Live connections in the metrics and the log, and their limits."""

from __future__ import annotations

import gc
import json
import logging
from collections.abc import Iterator
from typing import Any

import pytest
from websockets.exceptions import InvalidStatus

from service.lifespan import Service
from service.live.live_metrics import BROKEN, code_of
from service.operations.logs import SubjectFilter
from tests.service.harness import Running, serving, settings_of, until
from tests.service.live.client import live
from tests.service.live.driver import RATE, Driver, contact
from tests.service.plain_engine import PlainEngine
from tests.service.scraping import Scrape, scrape


def updates(shown: Scrape) -> tuple[float, ...]:
    return tuple(shown.value(f"updates_{what}_total") for what in ("received", "applied", "dropped"))


@pytest.fixture
def log(caplog: pytest.LogCaptureFixture) -> Iterator[pytest.LogCaptureFixture]:
    """What is logged, with what the filter writes into it."""
    caplog.set_level(logging.INFO)
    subjects = SubjectFilter()
    caplog.handler.addFilter(subjects)
    yield caplog
    caplog.handler.removeFilter(subjects)


# Metrics


def test_a_live_stream_counts_while_it_lasts_and_its_sound_for_good(running: Running) -> None:
    with live(running) as client:
        client.hello(pacing="realtime")
        client.frames(4800)
        shown = scrape(running.client)
        assert shown.value("streams", kind="live") == shown.value("streams_opened_total", kind="live") == 1
        client.say("stop")
        frames = len(client.rest())
    until(lambda: scrape(running.client).value("streams", kind="live") == 0)
    shown = scrape(running.client)
    assert shown.value("streams_opened_total", kind="live") == 1
    assert shown.value("frames_sent_total", kind="live") == frames
    assert shown.value("block_lateness_seconds_count", kind="live") >= 10
    assert shown.value("build_seconds_count", what="voice") == 1
    assert shown.value("live_closes_total", code="1000") == 1


def test_a_pulled_block_has_no_lateness(running: Running) -> None:
    with live(running) as client:
        client.hello()
        client.say("more", frames=4800)
        client.frames(4800)
        shown = scrape(running.client)
    assert shown.value("frames_sent_total", kind="live") == 4800
    assert shown.value("block_lateness_seconds_count", kind="live") == 0


def test_updates_are_received_then_applied_or_dropped(running: Running) -> None:
    with live(running) as client:
        client.hello()
        for seq in (1, 2, 3, 3):
            client.contact(seq)
        client.contact(4, load=5000.0)  # refused
        client.until("problem")
        until(lambda: updates(scrape(running.client)) == (5, 0, 4))  # 3 still waits for a block
        client.say("more", frames=480)
        client.until("applied")
        client.contact(5)
        until(lambda: updates(scrape(running.client)) == (6, 1, 4))
        client.say("contact", seq=6, time=0.0, speed=0.1)
        until(lambda: updates(scrape(running.client)) == (7, 1, 5))
        client.say("stop")
        client.rest()
    until(lambda: updates(scrape(running.client)) == (7, 1, 6))  # nobody will apply it any more
    assert scrape(running.client).value("problems_total", type="message-refused") == 1


def test_a_prepared_change_is_a_build_and_a_refused_one_is_a_problem(running: Running) -> None:
    with live(running) as client:
        client.hello(pacing="realtime")
        client.say("scene", scene={"output": {"sample_rate": 44100}})
        client.until("problem")
        client.say("scene", scene={"scan": {"speed": "160 mm/s"}})
        client.until("scene")
        shown = scrape(running.client)
    assert shown.value("build_seconds_count", what="change") == 1
    assert shown.value("problems_total", type="fixed") == 1


def test_what_the_limiter_turned_down_is_counted(running: Running, engine: PlainEngine) -> None:
    with live(running) as client:
        client.hello()
        engine.hands[-1].reduction_db = 6.0
        client.say("more", frames=960)
        client.frames(960)
        engine.hands[-1].reduction_db = 0.0
        client.say("more", frames=960)
        client.frames(1920)
        until(lambda: scrape(running.client).value("limited_blocks_total") == 2)
        shown = scrape(running.client)
    assert shown.value("limited_seconds_total") == pytest.approx(0.02)
    assert shown.value("limiter_largest_reduction_decibels") == 6.0


def test_a_broken_connection_is_1006_and_a_resumed_session_opens_a_stream_again(running: Running) -> None:
    with live(running) as client:
        session = client.hello(pacing="realtime")["session"]
        client.break_off()
    until(lambda: scrape(running.client).value("live_closes_total", code="1006") == 1)
    with live(running) as client:
        client.hello(resume={"session": session, "frame": 0})
        assert scrape(running.client).value("streams", kind="live") == 1
        client.socket.close(1001)
    until(lambda: scrape(running.client).value("live_closes_total", code="1001") == 1)
    assert scrape(running.client).value("streams_opened_total", kind="live") == 2


@pytest.mark.parametrize(
    ("event", "code"),
    [
        ({"code": 1005}, BROKEN),
        ({"code": 1005, "reason": ""}, 1005),
        ({"code": 1009, "reason": "too big"}, 1009),
        ({"code": 1012}, 1012),
        ({}, BROKEN),
    ],
)
def test_the_code_of_a_connection_that_ended(event: dict[str, Any], code: int) -> None:
    assert code_of(event) == code


# Limits of length


def test_an_address_has_as_many_live_connections_as_it_may_and_one_that_leaves_makes_room() -> None:
    with serving(PlainEngine(), streams_per_address=1) as running:
        with live(running) as client:
            client.hello()
            with pytest.raises(InvalidStatus) as caught, live(running):
                pass
            assert caught.value.response.status_code == 429
            assert json.loads(caught.value.response.body or b"")["type"] == "/docs#problem-too-many-streams"
        until(lambda: not running.service.limits._streams)
        with live(running) as client:
            client.hello()


def test_a_refused_upgrade_takes_no_place() -> None:
    with serving(PlainEngine(), streams_per_address=1) as running:
        with pytest.raises(InvalidStatus), live(running, subprotocols=["ridgewave.v3"]):
            pass
        with live(running) as client:
            client.hello()


def test_a_live_stream_ends_with_a_fade_at_its_longest() -> None:
    driver = Driver(settings_of(max_stream=1.0))
    driver.hello()
    driver.pull(2 * RATE)
    assert driver.sent[-1] == {"type": "end", "reason": "too long", "frame": len(driver.pcm())}
    assert RATE - 480 <= len(driver.pcm()) <= RATE + 480 and driver.pcm()[-1] == 0.0
    assert driver.closed is not None and driver.closed.code == 1008 and driver.finished


def test_a_stream_that_pulls_nothing_ends_at_its_longest_too() -> None:
    driver = Driver(settings_of(max_stream=60.0))
    driver.hello()
    driver.binary(contact(1))
    driver.now += 60.0
    driver.machine.check(driver.now)
    assert driver.machine.take_actions() == []
    driver.now += 60.0
    driver.machine.check(driver.now)
    driver.perform()
    assert driver.texts("end")[0]["reason"] == "too long"


def test_the_service_s_longest_stream_is_that_of_its_settings() -> None:
    with serving(PlainEngine(), max_stream=0.2) as running, live(running) as client:
        client.hello(pacing="realtime")
        client.rest()
        assert (client.code, client.reason) == (1008, "too long")


def test_a_message_that_is_too_large_closes_with_1009_and_is_counted() -> None:
    with serving(PlainEngine(), max_message=1024) as running:
        with live(running) as client:
            client.hello()
            client.socket.send("x" * 1025)
            client.rest()
            assert client.code == 1009
        until(lambda: scrape(running.client).value("live_closes_total", code="1009") == 1)


# The log


def test_the_log_has_a_line_when_a_stream_begins_and_one_when_it_ends(
    running: Running, log: pytest.LogCaptureFixture
) -> None:
    with live(running) as client:
        session = client.hello(pacing="realtime")["session"]
        client.frames(4800)
        client.say("stop")
        frames = len(client.rest())
    until(lambda: any("live stream ended" in record.getMessage() for record in log.records))
    began, ended = (record for record in log.records if record.getMessage().startswith("live stream"))
    assert f"stopped, code 1000, {frames} frames" in ended.getMessage()
    for record in (began, ended):
        assert record.levelno == logging.INFO
        assert vars(record)["session"] == session and vars(record)["request"] == "WEBSOCKET /v1/live"


def test_our_mistake_in_a_stream_names_its_session(
    running: Running, engine: PlainEngine, log: pytest.LogCaptureFixture
) -> None:
    with live(running) as client:
        session = client.hello()["session"]
        engine.hands[-1].fails = RuntimeError("broken")
        client.say("more", frames=480)
        client.rest()
    (record,) = (record for record in log.records if record.levelno == logging.ERROR)
    assert vars(record)["session"] == session
    assert scrape(running.client).value("problems_total", type="internal") == 1


# The process


def test_a_process_that_only_serves_takes_its_warm_heap_from_the_collector(monkeypatch: pytest.MonkeyPatch) -> None:
    frozen: list[bool] = []
    service = Service(settings_of(), PlainEngine())
    monkeypatch.setattr(gc, "freeze", lambda: frozen.append(service.warm))
    service.warm_up()
    assert frozen == []
    service.warm, service.serves_only = False, True
    service.warm_up()
    service.finish()
    assert frozen == [False], "before the first request"
