"""Deadlines by a clock that the test owns, and sleeps that are ended."""

from __future__ import annotations

import asyncio
import time

import pytest

from service.sessions.pacer import Bell, Pacer


def test_blocks_are_due_ahead_by_the_lead_and_do_not_drift() -> None:
    now = 100.0
    pacer = Pacer(48000, 0.25, lambda: now)
    assert pacer.delay(0) == pytest.approx(-0.25)
    for block in range(1, 1000):
        now = 100.0 + 0.02 * block - 0.25 + 0.003  # every sleep is 3 ms late
        assert pacer.delay(960 * block) == pytest.approx(-0.003)


def test_a_short_hiccup_is_caught_up_and_a_long_stall_is_forgiven() -> None:
    now = 0.0
    pacer = Pacer(48000, 0.25, lambda: now)
    now = 0.9
    assert pacer.delay(0) == pytest.approx(-1.15)
    now = 5.0
    assert pacer.delay(48000) == pytest.approx(-0.25)
    now = 5.75
    assert pacer.delay(96000) == pytest.approx(0.0)


def test_time_that_the_service_lost_is_skipped_and_time_that_its_reader_took_is_not() -> None:
    now = 0.0
    pacer = Pacer(48000, 0.25, lambda: now)
    now = 3.0
    assert pacer.delay(24000) == pytest.approx(-0.25) and pacer.skipped == pytest.approx(2.5)
    assert pacer.delay(24960) == pytest.approx(-0.23) and pacer.skipped == 0.0
    now = 10.0
    pacer.waited(7.0)
    assert pacer.delay(25920) == pytest.approx(-0.25) and pacer.skipped == 0.0
    now = 13.0
    assert pacer.delay(26880) == pytest.approx(-0.25) and pacer.skipped == pytest.approx(2.98)


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
