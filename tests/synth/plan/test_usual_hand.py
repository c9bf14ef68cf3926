"""The full scale of a hand."""

from __future__ import annotations

import math

import pytest

from synth.plan.usual_hand import prepare_hand, with_hand_scale
from synth.response_cache import ResponseCache
from synth.scene.scene import parse_scene

WAVE = [20e-6 * math.sin(0.1 * math.pi * point) for point in range(20)]


def hand_on(waves: int) -> float | None:
    """Return the full scale of a hand at rest on a profile of so many equal waves."""
    texture = {"kind": "profile", "heights": waves * WAVE, "spacing": "20 um"}
    scene = parse_scene({"finger": {"contact_length": "3 mm"}, "texture": texture, "scan": {"speed": 0, "load": 0}})
    cache = ResponseCache()
    (channel,) = with_hand_scale(prepare_hand(scene, (None,), cache), cache).channels
    return channel.full_scale


def test_a_texture_that_repeats_within_its_period_is_as_loud() -> None:
    """No harmonic below that of the wave moves."""
    assert hand_on(5) == pytest.approx(hand_on(1), rel=0.03)
