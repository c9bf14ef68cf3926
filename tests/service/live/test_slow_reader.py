"""A client that does not read is warned and closed; lateness of the service does not count."""

from __future__ import annotations

from typing import Any

from service.sessions.pacer import Behind, Pacer
from tests.service.harness import settings_of
from tests.service.live.driver import Driver


def stalled(seconds: float) -> Driver:
    """Return a stream of which one write took `seconds`."""
    driver = Driver(settings_of(slow_reader=1.0))
    driver.hello(pacing="realtime")
    driver.run(0.5)
    driver.now += 0.01
    stall(driver, seconds)
    driver.now += 0.001
    driver.write()
    return driver


def stall(driver: Driver, seconds: float) -> None:
    block = driver.machine.next_block(lambda: driver.now)
    assert block is not None
    messages: list[Any] = block.messages or []
    driver.machine.blocks.pace.writing(driver.now)
    until = driver.now + seconds
    while driver.now < until and driver.closed is None:
        driver.now += 0.05
        driver.machine.check(driver.now)
        driver.perform()
    if driver.closed is None:
        driver.sent += messages
        driver.times += [driver.now] * len(messages)
        driver.machine.blocks.pace.written(driver.now)


def test_a_short_stall_is_caught_up_without_a_word() -> None:
    driver = stalled(0.4)
    assert driver.texts("problem") == [] and driver.closed is None
    assert len(driver.blocks()) == int((driver.now - 100.0) / 0.01) + 1


def test_past_half_of_the_bound_it_is_told_once() -> None:
    driver = stalled(0.7)
    assert [message["problem"] for message in driver.texts("problem")] == ["/docs#problem-slow-reader"]
    driver.run(0.5)
    driver.now += 0.01
    stall(driver, 0.7)
    driver.run(0.5)
    assert len(driver.texts("problem")) == 1 and driver.closed is None
    sent = sum(len(block) // 4 for block in driver.blocks())
    assert sent == driver.stream.frame, "blocks wait, none is dropped"


def test_past_the_bound_it_is_closed_with_4408_while_the_write_still_waits() -> None:
    driver = stalled(3.0)
    assert driver.closed is not None and (driver.closed.code, driver.closed.at_once) == (4408, True)
    assert driver.texts("end")[0]["reason"] == "slow reader"
    assert driver.now < 100.0 + 0.5 + 0.01 + 1.16 and driver.finished


def test_many_small_waits_add_up() -> None:
    """The client reads at four fifths of the rate."""
    driver = Driver(settings_of(slow_reader=1.0))
    driver.hello(pacing="realtime")
    for _ in range(2000):
        if driver.closed is not None:
            break
        block = driver.machine.next_block(lambda: driver.now)
        driver.perform()
        if block is not None:
            driver.machine.blocks.pace.writing(driver.now)
            driver.now += 0.0125
            driver.machine.blocks.pace.written(driver.now)
    assert driver.closed is not None and driver.closed.code == 4408 and driver.order().count("problem") == 1


def test_in_pull_a_peer_takes_its_time() -> None:
    driver = Driver(settings_of(slow_reader=1.0))
    driver.hello()
    driver.pull(4800)
    driver.now += 100.0
    driver.machine.check(driver.now)
    driver.pull(4800)
    assert driver.texts("problem") == [] and driver.closed is None


def test_an_end_that_the_peer_does_not_take_is_cut() -> None:
    driver = Driver()
    driver.hello(pacing="realtime")
    driver.run(0.1)
    driver.machine.end("stopped")
    driver.machine.cut()
    driver.perform()
    assert driver.closed is not None and (driver.closed.code, driver.closed.at_once) == (1000, True)
    driver.machine.cut()
    driver.perform()


def test_lateness_that_is_ours_starts_the_clock_anew() -> None:
    pace = Pacer(1000, 0.0, slow_reader=1.0)
    pace.advance(10)
    assert pace.due == 0.01
    assert pace.behind(0.9) is Behind.FINE and pace.due == 0.01
    assert pace.behind(1.5) is Behind.FINE and pace.due == 1.5
    pace.advance(20)
    assert abs(pace.due - 1.51) < 1e-12
