"""Pull gives exactly what was granted; realtime keeps absolute deadlines."""

from __future__ import annotations

import numpy as np
import pytest

from synth.scene.scene import parse_scene
from tests.service.harness import settings_of
from tests.service.live.driver import BLOCK, RATE, Driver, contact, problem_of, started
from tests.service.plain_hand import Applied, expected

SCENE = parse_scene({})


def test_credit_is_exact_and_adds_up() -> None:
    driver = started("pull")
    for frames in (1, 479, 480, 481, 960, 10_000):
        before = len(driver.pcm())
        driver.pull(frames)
        assert len(driver.pcm()) == before + frames
        assert driver.write() == 0
    sizes = [len(block) // 4 for block in driver.blocks()]
    assert max(sizes) == BLOCK and sizes[:5] == [1, 479, 480, 480, 1]
    np.testing.assert_array_equal(driver.pcm(), expected(SCENE, Applied(), len(driver.pcm())))


def test_outstanding_credit_is_bounded_to_a_minute() -> None:
    driver = started("pull")
    driver.say("more", frames=60 * RATE - 10)
    driver.say("more", frames=11)
    assert problem_of(driver)["errors"][0]["pointer"] == "/frames"
    driver.say("more", frames=10)
    driver.write()
    assert len(driver.pcm()) == 60 * RATE and len(driver.texts("problem")) == 1


def test_there_is_no_credit_in_realtime() -> None:
    driver = started()
    driver.say("more", frames=48000)
    fault = problem_of(driver)["errors"][0]
    assert fault["pointer"] == "/frames" and fault["allowed"] == "no credit with pacing realtime"
    driver.run(0.1)
    assert len(driver.blocks()) == 11


def test_realtime_blocks_are_due_at_absolute_times_with_no_lead() -> None:
    driver = started(block=441)
    opened = driver.now
    driver.run(100.0)
    times = [at for at, message in zip(driver.times, driver.sent, strict=True) if isinstance(message, bytes)]
    assert len(times) == 1 + int(100.0 * RATE / 441)
    due = opened + np.arange(len(times)) * 441 / RATE
    assert (np.array(times) >= due).all() and np.abs(np.array(times) - due).max() < 1e-9


def test_a_late_block_does_not_move_those_after_it() -> None:
    driver = started()
    opened = driver.now
    driver.run(0.1)
    driver.now += 0.137
    driver.write()
    driver.run(1.0)
    assert len(driver.blocks()) == int((driver.now - opened) / 0.01 + 1e-9) + 1
    assert driver.texts("problem") == []


def test_late_by_our_own_fault_for_long_the_clock_starts_anew() -> None:
    driver = started()
    driver.run(0.1)
    before = len(driver.blocks())
    driver.now += 30.0
    driver.write()
    assert len(driver.blocks()) == before + 1 and driver.closed is None
    (told,) = driver.texts("skipped")
    assert told["frame"] == before * BLOCK and told["seconds"] == pytest.approx(30.0, abs=0.011)
    assert driver.order()[-2:] == ["skipped", "pcm"]
    np.testing.assert_array_equal(driver.pcm(), expected(SCENE, Applied(), len(driver.pcm())))


@pytest.mark.parametrize("slow_reader", [0.05, 1.0, 60.0])
def test_who_may_read_slowly_is_told_of_skipped_time_all_the_same(slow_reader: float) -> None:
    driver = Driver(settings_of(slow_reader=slow_reader))
    driver.hello(pacing="realtime")
    driver.run(0.1)
    for _ in range(3):
        driver.now += 2.5
        driver.machine.check(driver.now)  # whoever looks first: the clock is put off once
        driver.run(0.1)
    assert [round(told["seconds"], 1) for told in driver.texts("skipped")] == [2.5] * 3
    assert driver.closed is None and driver.texts("problem") == []


def test_a_hand_is_not_lifted_at_once_by_the_service_s_own_gap() -> None:
    driver = started()
    driver.binary(contact(1))
    driver.run(0.1)
    driver.now += 2.5
    driver.write()
    assert driver.hand.applied.lifted == []  # what the hand sent meanwhile has not been read yet


def test_limited_is_told_at_most_once_a_second_with_the_largest_reduction() -> None:
    driver = started()
    for index in range(350):
        driver.hand.reduction_db = {20: 3.0, 21: 5.5, 22: 1.0, 60: 2.0, 150: 4.0}.get(index, 0.0)
        driver.now += 0.01
        driver.write()
    told = driver.texts("limited")
    assert [message["gain_reduction_db"] for message in told] == [3.0, 5.5, 4.0]
    frames = [message["frame"] for message in told]
    assert frames[1] - frames[0] == 480 and len(told) == 3
    times = [at for at, message in zip(driver.times, driver.sent, strict=True) if message in told]
    assert (np.diff(times) >= 1.0 - 1e-9).all()
