"""Excess messages are dropped unread, a flood closes the connection, and `stop` is always read."""

from __future__ import annotations

from tests.service.harness import settings_of
from tests.service.live.driver import Driver, contact


def flooded(a_second: int, seconds: float, allowed: int = 2000) -> Driver:
    driver = Driver(settings_of(max_updates=allowed))
    driver.hello(pacing="realtime")
    for seq in range(round(a_second * seconds)):
        driver.binary(contact(seq + 1, load=0.1))
        driver.now += 1 / a_second
        driver.write()
    return driver


def test_as_many_as_allowed_are_all_read() -> None:
    driver = flooded(1990, 3.0)
    assert driver.texts("problem") == [] and driver.closed is None


def test_ten_thousand_a_second_are_thinned_and_told_once_a_second() -> None:
    driver = flooded(10_000, 3.5)
    told = driver.texts("problem")
    assert driver.closed is None and 2 <= len(told) <= 4
    assert all(message["problem"] == "/docs#problem-too-fast" and message["status"] == 429 for message in told)
    newest = [message["seq"] for message in driver.texts("applied")]
    assert newest == sorted(newest) and newest[-1] > 30_000
    assert len(driver.blocks()) == 351, "the sound does not suffer"


def test_ten_times_as_many_close_the_connection() -> None:
    driver = flooded(25_000, 2.0)
    assert driver.closed is not None and driver.closed.code == 1008
    assert driver.texts("end")[0]["reason"] == "policy" and driver.pcm()[-1] == 0.0


def test_text_counts_too_and_a_stop_is_always_read() -> None:
    driver = Driver(settings_of(max_updates=10))
    driver.hello(pacing="realtime")
    for _ in range(30):
        driver.say("more", frames=1)
    kinds = [message["problem"].rpartition("-")[2] for message in driver.texts("problem")]
    assert kinds.count("fast") == 1 and kinds.count("refused") == 9
    driver.say("stop")
    assert driver.texts("end")[0]["reason"] == "stopped"


def test_after_a_pause_the_count_begins_anew() -> None:
    driver = Driver(settings_of(max_updates=10))
    driver.hello(pacing="realtime")
    for _ in range(20):
        for seq in range(9):
            driver.binary(contact(seq))
        driver.now += 1.0
    assert driver.texts("problem") == []


def test_after_200_refusals_the_rest_of_the_second_is_dropped_unread() -> None:
    driver = Driver(settings_of())
    driver.hello(pacing="realtime")
    for _ in range(3000):
        driver.say("nonsense")
        driver.now += 0.001
    kinds = [message["problem"].rpartition("problem-")[2] for message in driver.texts("problem")]
    assert driver.closed is None and kinds.count("message-refused") == 600 and kinds.count("too-fast") == 3
    assert driver.texts("problem")[200]["detail"].startswith("200 messages were refused in a second: further")
    driver.say("stop")
    assert driver.texts("end")[0]["reason"] == "stopped"


def test_a_flood_of_refused_messages_closes_the_connection() -> None:
    driver = Driver(settings_of())
    driver.hello(pacing="realtime")
    for _ in range(20_000):
        driver.say("nonsense")
    assert driver.closed is not None and driver.closed.code == 1008


def test_a_hand_that_is_refused_now_and_then_loses_nothing() -> None:
    driver = Driver(settings_of())
    driver.hello(pacing="realtime")
    for seq in range(3000):
        driver.binary(contact(seq, load=0.1 if seq % 6 else -0.1))
        driver.now += 0.001
        driver.write()
    assert {message["problem"] for message in driver.texts("problem")} == {"/docs#problem-message-refused"}
    assert len(driver.texts("problem")) == 500 and driver.texts("applied")[-1]["seq"] == 2999
