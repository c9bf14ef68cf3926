"""The sound before the limiter, for clients that ask for it: where the limiter acted, exactly, and nowhere else."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
import pytest

from tests.service.harness import kept_engine, serving
from tests.service.live.client import live
from tests.service.live.driver import Driver, started

LOUD = {"texture": {"period": "0.5 mm", "amplitude": "30 um"}, "output": {"full_scale": 0.05}}
BLOCK = 480


def before(message: dict[str, Any], channels: int = 1) -> np.ndarray[Any, Any]:
    return np.frombuffer(base64.b64decode(message["samples"]), "<f4").reshape(-1, channels)


def pulled(driver: Driver) -> None:
    """Pull one block."""
    driver.say("more", frames=BLOCK)
    driver.write()


def limiting(driver: Driver, blocks: int, at: tuple[int, ...]) -> list[np.ndarray[Any, Any]]:
    """Send blocks; those `at` are limited. Return what these were before the limiter."""
    loud = []
    for index in range(blocks):
        values = np.full((BLOCK, 1), 2.0 + index, np.float32)
        driver.hand.before_limiter = values if index in at else None
        driver.hand.reduction_db = 6.0 if index in at else 0.0
        loud += [values] if index in at else []
        pulled(driver)
    return loud


def test_what_was_limited_comes_just_before_its_block() -> None:
    driver = started("pull", before_limiter=True)
    first, second = limiting(driver, 6, at=(1, 4))
    told = driver.texts("before_limiter")
    assert [message["frame"] for message in told] == [BLOCK, 4 * BLOCK]
    assert np.array_equal(before(told[0]), first) and np.array_equal(before(told[1]), second)
    places = [index for index, message in enumerate(driver.sent) if message in told]
    assert all(isinstance(driver.sent[place + 1], bytes) for place in places)


def test_nothing_is_told_to_a_client_that_did_not_ask() -> None:
    driver = started("pull")
    limiting(driver, 6, at=(1, 4))
    assert driver.texts("before_limiter") == []


def test_a_client_that_resumes_gets_it_again_for_the_frames_that_it_gets_again() -> None:
    driver = started("pull", before_limiter=True)
    first, second = limiting(driver, 6, at=(1, 4))
    again = Driver(streams=driver.streams, now=driver.now)
    frame = BLOCK + 100
    again.hello(resume={"session": "s0", "frame": frame})
    for _ in range(8):
        pulled(again)
    told = again.texts("before_limiter")
    kept = np.concatenate([before(message) for message in told])
    assert np.array_equal(kept, np.concatenate([first[100:], second]))
    assert told[0]["frame"] == frame
    assert sum(len(before(message)) for message in told[1:]) + 380 == len(kept)


def test_samples_that_are_not_finite_are_zeros() -> None:
    driver = started("pull", before_limiter=True)
    driver.hand.before_limiter = np.array([[np.nan], [np.inf], [3.0]], np.float32)
    pulled(driver)
    assert before(driver.texts("before_limiter")[0]).ravel().tolist() == [0.0, 0.0, 3.0]


@pytest.mark.parametrize(("name", "kind", "step"), [("f32le", "<f4", 2e-7), ("s16le", "<i2", 1 / 32768)])
def test_the_sound_is_this_times_a_gain(name: str, kind: str, step: float) -> None:
    """With 16 bits the gain is known to a step of the samples only; what was before is exact in both."""
    with serving(kept_engine()) as running, live(running) as client:
        client.hello(scene=LOUD, format=name, before_limiter=True)
        for seq in range(1, 6):
            client.contact(seq, speed=0.1, load=0.5)
            client.say("more", frames=2400)
            while client.sound < seq * 2400 * np.dtype(kind).itemsize:
                assert client.next() is not None
        client.say("stop")
        client.until("end")
    sound = np.frombuffer(b"".join(part for part in client.received if isinstance(part, bytes)), kind).astype(float)
    sound /= 1.0 if name == "f32le" else 32768.0
    told = client.texts("before_limiter")
    assert len(told) > 10
    for message in told:
        values = before(message)[:, 0].astype(float)
        heard = sound[message["frame"] :][: len(values)]
        loud = np.abs(values) > 0.01
        gains = heard[loud] / values[loud]
        assert np.abs(heard).max() <= 1.0
        assert gains.min() > 0.0 and gains.max() <= 1.0 + step / 0.01
    assert max(np.abs(before(message)).max() for message in told) > 10.0
