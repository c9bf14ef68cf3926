"""Blocks of one frame and of a million, at every rate: the same samples as one block."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from synth.arrays import Block
from synth.motion.motion import Motion
from synth.voice.voice import open_voice
from tests.few import paired
from tests.synth.engine_cases import scene_of
from tests.synth.hard.bounds import ALL, check_fit, finite

MILLION = 1_000_000
RATES = (1000, 8000, 44100, 48000, 96000, 192000)
SCANS: dict[str, dict[str, Any]] = {
    "steady": {"speed": 0.0613},
    "backwards": {"speed": -0.031},
    "full contact": {"load": 60},
    "stroke": {"stroke": {"length": "10 mm", "turn_time": "50 ms"}},
    "trajectory": {"trajectory": [[0, 0, 0.3], [0.01, 6e-4, 0.4], [0.02, 1e-3, 0.25], [0.03, 8e-4, 0.3]]},
}


@pytest.mark.parametrize(("name", "rate"), paired(SCANS, RATES))
def test_blocks_of_one_frame_are_one_block(name: str, rate: int) -> None:
    output = {**ALL, "sample_rate": rate, "bandwidth": 300.0}
    finger = {"contact_length": "2 mm"}
    scene = scene_of(finger=finger, scan=SCANS[name], output=output, accuracy={"tolerance": 3e-2})
    whole, voice = open_voice(scene).render(1500), open_voice(scene)
    assert finite(whole)
    assert whole.any(axis=0).all()
    assert np.array_equal(np.concatenate([voice.render(1) for _ in range(1500)]), whole)


@pytest.mark.parametrize("name", ["steady", "stroke"])
def test_a_block_of_a_million_frames_is_a_thousand_blocks(name: str) -> None:
    scene = scene_of(scan=SCANS[name], output={**ALL, "bandwidth": 2000.0})
    whole, voice = open_voice(scene).render(MILLION), open_voice(scene)
    check_fit(voice, whole)
    assert np.array_equal(np.concatenate([voice.render(1000) for _ in range(1000)]), whole)


HANDS: dict[str, dict[str, Any]] = {
    "a load that steps at every frame": {"speed": 0.05, "load": np.where(np.arange(MILLION) % 2, 0.25, 0.35)},
    "a speed that jumps at every frame": {
        "speed": np.random.default_rng(78).uniform(-0.2, 0.3, MILLION), "load": 0.3,
    },
}  # fmt: skip


@pytest.mark.parametrize("name", HANDS)
def test_a_block_of_a_million_frames_of_a_hand_is_a_thousand_blocks(name: str) -> None:
    """The time of a block grows with its length, not with the square of it: the last two rows took a minute each when
    every run looked through the rest of the block.
    """
    output = {"quantity": "displacement", "bandwidth": 600.0}
    scene = scene_of(output=output, accuracy={"tolerance": 3e-2})

    def rendered(size: int) -> Block:
        voice, parts = open_voice(scene), []
        for first in range(0, MILLION, size):
            fields = {
                key: value[first : first + size] if isinstance(value, np.ndarray) else value
                for key, value in HANDS[name].items()
            }
            parts.append(voice.render(size, Motion.of(size, **fields)))
        return np.concatenate(parts)

    whole = rendered(MILLION)
    assert finite(whole)
    assert np.array_equal(rendered(1000), whole)


@pytest.mark.parametrize("live", [False, True])
@pytest.mark.parametrize(
    "derivatives", [{}, {"speed_rate": 0.0, "load_rate": 0.0, "load_bend": 0.0}], ids=["", "given"]
)
def test_a_block_of_no_frames_changes_nothing(derivatives: dict[str, float], live: bool) -> None:
    """Before a hand has moved the voice and after, with and without a motion, a block of no frames is left out."""
    voice = open_voice(scene_of(output={**ALL, "bandwidth": 300.0}), live=live)
    assert voice.render(0).shape == (0, 3)
    assert voice.render(0, Motion.of(0, speed=0.1, load=0.3, **derivatives)).shape == (0, 3)
    assert voice.phase == 0
    voice.render(100, Motion.of(100, speed=0.1, load=0.3, **derivatives))
    moved = voice.phase
    assert moved != 0
    for place in ({}, {"position": 1.0}):
        assert voice.render(0, Motion.of(0, speed=0.1, load=0.3, **derivatives, **place)).shape == (0, 3)
        assert voice.phase == moved
    assert voice.render(0).shape == (0, 3)
    assert voice.phase == moved
    assert voice.frame == 100
