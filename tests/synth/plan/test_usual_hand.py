"""The full scale of a hand: what it is, and what it costs to find."""

from __future__ import annotations

import math
from typing import Any

import pytest

from synth.plan import usual_hand
from synth.plan.usual_hand import prepare_hand, with_hand_scale
from synth.response.spectrum import Spectrum, solve_spectrum
from synth.response_cache import ResponseCache
from synth.scene.scene import parse_scene

WAVE = [20e-6 * math.sin(0.1 * math.pi * point) for point in range(20)]


def hand_on(waves: int, monkeypatch: pytest.MonkeyPatch) -> tuple[float | None, int]:
    """Return the full scale of a hand at rest on a profile of so many equal waves, and the phases of its series."""
    phases = []

    def counted(*words: Any) -> Spectrum:
        found = solve_spectrum(*words)
        phases.append(found.phases)
        return found

    monkeypatch.setattr(usual_hand, "solve_spectrum", counted)
    texture = {"kind": "profile", "heights": waves * WAVE, "spacing": "20 um"}
    scene = parse_scene({"finger": {"contact_length": "3 mm"}, "texture": texture, "scan": {"speed": 0, "load": 0}})
    cache = ResponseCache()
    (channel,) = with_hand_scale(prepare_hand(scene, (None,), cache), cache).channels
    return channel.full_scale, max(phases)


def test_a_texture_that_repeats_within_its_period_is_as_loud_and_costs_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    """No harmonic below that of the wave moves: an error relative to these took 131,072 phases, and 12 s."""
    scale, phases = hand_on(1, monkeypatch)
    repeated, more = hand_on(5, monkeypatch)
    assert repeated == pytest.approx(scale, rel=0.03)
    assert max(phases, more) <= 4096
