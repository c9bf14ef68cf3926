"""A block of a hand in one call has the bits that it has in three: the motion, the loops, the limiter."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from synth.motion.update_smoothing import Update
from synth.response.cache import ResponseCache
from synth.scene.scene import parse_scene
from synth.voice.hand_voice import HandVoice
from synth.voice.limiter import Block
from tests.synth.test_live_hand import QUANTITIES

BLOCK = 480
CACHE = ResponseCache()


def pair(quantity: str, **output: Any) -> tuple[HandVoice, HandVoice]:
    """Return two voices of one scene with the same rows, the second without the call that does it all."""
    scene = parse_scene({"output": {"quantity": quantity, "sample_rate": 48000, "bandwidth": "full", **output}})
    first = HandVoice(scene, cache=CACHE)
    edges = first._spare.hand_readers[0].shared.edges_at_first  # type: ignore[union-attr]
    first.close()
    quick, plain = (HandVoice(scene, cache=CACHE, rows=lambda part, place: edges) for _ in range(2))
    assert quick._blocks is not None
    plain._blocks = None
    return quick, plain


def led(voice: HandVoice, by_speed: bool, lift: bool = False) -> Block:
    """Return two seconds of a hand that strokes and presses, from 0.02 to 0.9 N, with gaps and a teleport."""
    made = []
    for block in range(200):
        time = 0.01 * block
        load = 0.46 + 0.44 * math.sin(5.0 * time)
        place = 0.03 * math.sin(4.0 * time) + (0.5 if block > 150 else 0.0)
        speed = 0.12 * math.cos(4.0 * time)
        if block == 90 and lift:
            voice.lift()
        elif block % 7:
            voice.touch(Update(block, time, None if by_speed else place, speed if by_speed else None, load))
        made.append(voice.render(BLOCK if block % 5 else 96))
    return np.concatenate(made)


@pytest.mark.parametrize("by_speed", [False, True])
@pytest.mark.parametrize("quantity", QUANTITIES)
def test_the_bits_are_those_of_three_calls(quantity: str, by_speed: bool) -> None:
    quick, plain = pair(quantity)
    found, wanted = led(quick, by_speed, lift=True), led(plain, by_speed, lift=True)
    assert np.ptp(found) > 0.05
    np.testing.assert_array_equal(found, wanted)


def test_what_is_too_loud_is_turned_down_alike() -> None:
    quick, plain = pair("acceleration", full_scale=0.2)
    found, wanted = led(quick, False), led(plain, False)
    assert np.abs(found).max() > 0.99 and quick._limiter.frames_limited == plain._limiter.frames_limited > 0
    np.testing.assert_array_equal(found, wanted)
