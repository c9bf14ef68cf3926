"""The approach: z of eq. 1 itself, with what pressing alone moves, wherever a quantity may be named."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from synth.motion.motion import LOAD, Update
from synth.motion.scan_motion import ScanMotion
from synth.scene.scene import Scene
from synth.voice.hand_voice import HandVoice
from synth.voice.voice import blocks, open_voice
from tests.synth.engine_cases import Real, contact_of, scene_of

PRESSING = [[0, 1e-4, 0.1], [0.05, 1e-4, 0.1], [0.15, 1e-4, 1.0], [0.2, 1e-4, 1.0]]


def scene(rate: int = 8000, **sections: Any) -> Scene:
    both = [{"quantity": "approach", "full_scale": 1.0}, {"quantity": "displacement", "full_scale": 1.0}]
    return scene_of(output={"channels": both, "sample_rate": rate, "duration": 0.2}, **sections)


def samples(scene: Scene) -> Real:
    return np.concatenate(list(blocks(open_voice(scene)))).astype(float)


def heights(scene: Scene) -> Real:
    """Return z (m) along the scan of `scene`."""
    motion = ScanMotion(scene).at(0, 9600)
    return np.asarray(contact_of(scene).heights(motion.position / scene.texture.period, motion.samples[LOAD]))


@pytest.mark.parametrize("scan", [{}, {"stroke": {"length": "5 mm"}}, {"trajectory": PRESSING}], ids=str)
def test_the_approach_is_z(scan: dict[str, Any]) -> None:
    asked = scene(48000, scan=scan)
    found, wanted = samples(asked)[:, 0], heights(asked)
    assert np.max(np.abs(found - wanted)) <= 2e-3 * 2e-6  # of the peak-to-peak: the band cuts little


def test_pressing_moves_the_approach_and_not_the_displacement() -> None:
    found = samples(scene(scan={"trajectory": PRESSING}))
    assert found[100, 0] - found[-100, 0] == pytest.approx(33.7e-6, abs=0.1e-6)  # z falls as the finger is pressed
    assert abs(found[100, 1] - found[-100, 1]) <= 3e-6


@pytest.mark.parametrize("effects", [{"inertia": {}}, {"adhesion": {}}, {"contact_growth": {}}], ids=str)
def test_with_effects_it_is_their_z(effects: dict[str, Any]) -> None:
    found = samples(scene(effects=effects))
    level = found[:, 0] - found[:, 1]
    assert np.ptp(level) <= 1e-10 and 2e-5 <= level[0] <= 5e-5


def test_its_automatic_full_scale_holds_its_level() -> None:
    for scan in ({}, {"trajectory": PRESSING}):
        asked = scene_of(scan=scan, output={"quantity": "approach", "sample_rate": 8000, "duration": 0.23})
        voice = open_voice(asked)
        assert np.max(np.abs(np.concatenate(list(blocks(voice))))) == pytest.approx(0.8, rel=0.01)
        assert voice.plan.response["channels"][0]["unit"] == "m"
        assert voice.plan.estimated_error["approach"] <= 1e-3


def test_a_hand_feels_it_and_is_not_limited() -> None:
    voice = HandVoice(scene_of(output={"quantity": "approach", "sample_rate": 8000}))
    levels: list[float] = []
    for load in (0.1, 1.0):
        for _ in range(30):
            voice.touch(Update(len(levels), 0.01 * len(levels), 8e-4 * len(levels), None, load))
            levels.append(float(voice.render(80).mean()))
            assert voice.reduction_db == 0.0
    moved = (np.mean(levels[24:30]) - np.mean(levels[54:60])) * voice.full_scale[0]
    assert moved == pytest.approx(33e-6, abs=1.5e-6)
