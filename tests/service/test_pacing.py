"""Deadlines by the clock of the test, and sleeps that end early."""

from __future__ import annotations

import asyncio
import time

import pytest

from service.sessions.pacer import Behind, Bell, Pacer


def test_blocks_are_due_ahead_by_the_lead_and_do_not_drift() -> None:
    pacer = Pacer(48000, 100.0, lead=0.25)
    assert pacer.due == pytest.approx(99.75)
    for block in range(1, 1000):
        pacer.advance(960 * block)
        assert pacer.behind(pacer.due + 0.003) is Behind.FINE  # every sleep is 3 ms late
        assert pacer.due == pytest.approx(100.0 + 0.02 * block - 0.25)


def test_a_short_hiccup_is_caught_up_and_a_long_stall_is_forgiven() -> None:
    pacer = Pacer(48000, 0.0, lead=0.25)
    pacer.behind(0.9)
    assert pacer.due == pytest.approx(-0.25)
    pacer.advance(48000)
    pacer.behind(5.0)
    assert pacer.due == pytest.approx(4.75)
    pacer.advance(96000)
    pacer.behind(5.75)
    assert pacer.due == pytest.approx(5.75)


def test_time_that_the_service_lost_is_skipped_and_time_that_its_reader_took_is_not() -> None:
    pacer = Pacer(48000, 0.0, lead=0.25)

    def skipped(frame: int, now: float) -> float:
        pacer.advance(frame)
        pacer.behind(now)
        return pacer.take_skipped(own=True)

    assert skipped(24000, 3.0) == pytest.approx(2.5) and pacer.due == pytest.approx(2.75)
    assert skipped(24960, 3.0) == 0.0 and pacer.due == pytest.approx(2.77)
    pacer.writing(3.0)
    pacer.written(10.0)
    assert skipped(25920, 10.0) == 0.0 and pacer.due == pytest.approx(9.75)
    assert skipped(26880, 13.0) == pytest.approx(2.98) and pacer.due == pytest.approx(12.75)


def test_what_the_service_was_late_is_not_what_the_reader_took() -> None:
    pacer, now = Pacer(1000, 0.0, slow_reader=1.0), 0.48
    pacer.advance(0)
    assert pacer.own_late(now) == pytest.approx(0.48)
    pacer.writing(now)
    found = {}
    for step in range(1, 25):
        found[step] = pacer.behind(now + 0.05 * step)
    assert found[9] is Behind.FINE and found[11] is Behind.SLOW, "half of the bound has been waited for"
    assert found[19] is Behind.SLOW and found[21] is Behind.TOO_SLOW
    pacer.written(now + 1.2)
    assert pacer.own_late(now + 1.2) == pytest.approx(0.48)


def test_a_bell_ends_a_sleep_and_every_later_one() -> None:
    async def scenario() -> float:
        bell = Bell()
        asyncio.get_running_loop().call_soon(bell.ring)
        began = time.perf_counter()
        await bell.sleep(60.0)
        await bell.sleep(60.0)
        await bell.wait()
        return time.perf_counter() - began

    assert asyncio.run(scenario()) < 30.0


def test_an_unrung_bell_sleeps_its_time() -> None:
    async def scenario() -> float:
        began = time.perf_counter()
        await Bell().sleep(0.05)
        return time.perf_counter() - began

    assert asyncio.run(scenario()) >= 0.049
