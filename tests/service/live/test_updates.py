"""Updates and changes of scene take effect at the reported frame, to the sample; a silent hand is lifted."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from service.live.messages import V2
from service.live.silence_watchdog import SilenceWatchdog
from synth.scene.scene import parse_scene
from tests.service.live.driver import RATE, SILENCE, contact, place, started
from tests.service.plain_hand import Applied, expected

SCENE = parse_scene({})


def test_an_update_is_applied_at_the_first_frame_of_the_next_block_and_told_just_before_it() -> None:
    driver = started()
    driver.run(0.055)
    driver.binary(contact(7, load=0.9))
    driver.run(0.1)
    at = driver.texts("applied")
    assert at == [{"type": "applied", "seq": 7, "frame": 2880}]
    place = driver.sent.index(at[0])
    sent_before = sum(len(message) // 4 for message in driver.sent[:place] if isinstance(message, bytes))
    assert sent_before == 2880 and isinstance(driver.sent[place + 1], bytes)
    pcm = driver.pcm()
    np.testing.assert_array_equal(pcm, expected(SCENE, Applied(levels=[(2880, float(np.float32(0.9)))]), len(pcm)))
    assert (pcm[:2880] == expected(SCENE, Applied(), 2880)).all() and pcm[2881] != expected(SCENE, Applied(), 2882)[-1]


def test_of_many_updates_between_two_blocks_the_newest_is_applied_once() -> None:
    driver = started()
    driver.run(0.015)
    for seq in (3, 9, 4, 9, 1):
        driver.binary(contact(seq, load=seq / 10))
    driver.run(0.01)
    driver.binary(contact(9, load=1.0))
    driver.binary(contact(8, load=1.0))
    driver.run(0.1)
    assert [message["seq"] for message in driver.texts("applied")] == [9]
    assert [update.load for _, update in driver.hand.applied.updates] == [pytest.approx(0.9)]


def test_an_update_that_replaces_another_keeps_the_load_and_the_direction_that_it_lacks() -> None:
    driver = started(version=V2, scene={"texture": {"kind": "dots"}})
    driver.run(0.015)
    driver.binary(place(1, 0.1, 0.2, direction=0.5, load=0.75))
    driver.binary(place(2, 0.3, 0.4, load=None))
    driver.binary(contact(3, position=-0.5, load=None))
    driver.run(0.02)
    driver.binary(contact(4, load=0.25))
    driver.binary(contact(5, load=None))
    driver.binary(contact(6, load=0.5))
    driver.run(0.02)
    first, second = (update for _, update in driver.hand.applied.updates)
    assert (first.seq, first.position, first.across, first.direction, first.load) == (3, -0.5, None, 0.5, 0.75)
    assert (second.seq, second.across, second.direction, second.load) == (6, None, None, 0.5)


def test_applied_comes_at_most_once_a_block_in_any_schedule() -> None:
    generator = np.random.default_rng(5)
    driver = started(block=64)
    seq = 0
    for _ in range(2000):
        for _ in range(generator.integers(0, 3)):
            seq += 1
            if generator.random() < 0.5:
                driver.binary(contact(seq, load=float(generator.random())))
            else:
                driver.say("contact", seq=seq, time=0.0, speed=0.1, load=float(generator.random()))
        driver.run(float(generator.exponential(0.003)))
    order = driver.order()
    assert all(after == "pcm" for kind, after in itertools.pairwise(order) if kind == "applied")
    pcm = driver.pcm()
    np.testing.assert_array_equal(pcm, expected(SCENE, driver.hand.applied, len(pcm)))
    told = [(message["frame"], message["seq"]) for message in driver.texts("applied")]
    assert told == [(frame, update.seq) for frame, update in driver.hand.applied.updates]
    assert len(told) > 500


def test_json_and_binary_contacts_are_the_same_update() -> None:
    driver = started()
    driver.binary(contact(1, speed=-0.25, load=0.5))
    driver.run(0.02)
    driver.say("contact", seq=2, time=0, speed=-0.25, load=0.5)
    driver.run(0.02)
    (_, first), (_, second) = driver.hand.applied.updates
    assert (first.speed, first.position, first.load) == (second.speed, second.position, second.load)
    assert isinstance(second.time, float) and isinstance(second.seq, int)


def test_without_updates_the_load_goes_after_the_silence_and_comes_back_with_the_next() -> None:
    driver = started()
    driver.run(2.0)
    assert driver.hand.applied.lifted == [], "a scene moves by itself until the first update"
    driver.binary(contact(1, load=0.8))
    driver.run(0.24)
    driver.binary(contact(2, load=None))
    driver.run(0.24)
    assert driver.hand.applied.lifted == []
    driver.run(0.5)
    (lifted,) = driver.hand.applied.lifted
    heard = 2.0 + 0.24
    assert heard + 0.25 < lifted / RATE <= heard + 0.25 + 0.0101
    driver.binary(contact(3, load=None))
    driver.run(0.1)
    pcm = driver.pcm()
    np.testing.assert_array_equal(pcm, expected(SCENE, driver.hand.applied, len(pcm)))
    assert not pcm[lifted + 96 : lifted + 480].any() and pcm[-480:].any()


def test_a_silence_of_a_service_that_was_busy_is_looked_at_once_more() -> None:
    driver = started()
    driver.binary(contact(1, load=0.8))
    driver.run(0.05)
    driver.now += 0.5  # nothing was read and nothing sent
    driver.write(1)
    assert driver.hand.applied.lifted == []
    driver.binary(contact(2, load=0.8))  # it had come meanwhile, and is read before the next block
    driver.run(0.2)
    assert driver.hand.applied.lifted == []
    driver.now += 0.5
    driver.write(1)
    assert driver.hand.applied.lifted == []
    doubtful = driver.stream.frame
    driver.write(1)
    assert driver.hand.applied.lifted == [doubtful], "the next block, though it is late as well"


def test_a_block_that_is_as_late_as_usual_lifts_the_finger_at_once() -> None:
    watchdog = SilenceWatchdog(SILENCE)
    watchdog.heard(0.0)
    assert not watchdog.lifts(SILENCE, late=0.005)
    assert watchdog.lifts(SILENCE + 0.01, late=0.005)
    assert not watchdog.lifts(SILENCE + 0.02, late=0.005), "once"


def test_an_update_that_is_ignored_does_not_keep_the_hand_alive() -> None:
    driver = started()
    driver.binary(contact(5))
    for _ in range(100):
        driver.run(0.01)
        driver.binary(contact(5))
    assert len(driver.hand.applied.lifted) == 1


def test_a_client_that_stops_pulling_finds_its_hand_lifted() -> None:
    driver = started("pull")
    driver.binary(contact(1))
    driver.pull(480)
    driver.now += 3.0
    driver.pull(480)
    assert driver.hand.applied.lifted == [480]


def test_a_change_of_scene_is_told_just_before_its_first_block() -> None:
    driver = started()
    driver.run(0.055)
    driver.say("scene", scene={"scan": {"speed": "160 mm/s"}})
    driver.run(0.1)
    (told,) = driver.texts("scene")
    assert told["frame"] == 2880 and told["plan"] == driver.hand.plan_document
    assert driver.order()[driver.sent.index(told) + 1] == "pcm"
    pcm = driver.pcm()
    np.testing.assert_array_equal(pcm, expected(SCENE, driver.hand.applied, len(pcm)))
    assert driver.hand.applied.scenes[0][0] == 2880


def test_a_change_waits_for_the_cross_fade_before_it_and_the_newest_wins() -> None:
    driver = started()
    for speed in (0.1, 0.12, 0.14):
        driver.run(0.011)
        driver.say("scene", scene={"scan": {"speed": speed}})
    driver.run(0.2)
    first, second = driver.texts("scene")
    assert second["frame"] - first["frame"] > 0.05 * RATE
    assert [scene.scan.speed for _, scene in driver.hand.applied.scenes] == [0.1, 0.14]


@pytest.mark.parametrize(
    ("patch", "kind"),
    [
        ({"scan": {"load": -1}}, "scene-refused"),
        ({"output": {"sample_rate": 44100}}, "fixed"),
        ({"nonsense": 1}, "scene-refused"),
    ],
)
def test_a_refused_change_leaves_the_stream_going(patch: dict[str, object], kind: str) -> None:
    driver = started()
    driver.run(0.1)
    driver.say("scene", scene=patch)
    driver.run(0.5)
    (found,) = driver.texts("problem")
    assert found["problem"] == f"/docs#problem-{kind}"
    assert driver.texts("scene") == [] and driver.closed is None
    np.testing.assert_array_equal(driver.pcm(), expected(SCENE, Applied(), len(driver.pcm())))


def test_a_change_in_pull_is_heard_with_the_next_credit() -> None:
    driver = started("pull")
    driver.pull(500)
    driver.say("scene", scene={"scan": {"speed": 0.1}})
    driver.pull(500)
    assert [message["frame"] for message in driver.texts("scene")] == [500]
