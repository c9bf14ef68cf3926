"""An automatic full scale of a scan that changes: its peak is 0.8, wherever that is."""

from __future__ import annotations

import numpy as np
import pytest

from synth.plan import motion_peak
from synth.plan.motion_peak import peaks_along
from synth.plan.preparation import prepare
from synth.scene.scene import Scene
from synth.voice.voice import blocks, open_voice
from tests.synth.engine_cases import QUANTITIES, Real, scene_of
from tests.synth.voice.recorded_cases import Points, random_recording

GETS_LOUDER = [[0, 0, 0.1], [0.1, 0.008, 0.3], [0.2, 0.016, 1.0], [0.3, 0.02, 0.2]]


def recording(points: Points, **output: object) -> Scene:
    lasting = {"duration": points[-1][0] + 0.03, "channels": list(QUANTITIES), **output}
    return scene_of(finger={"contact_length": "3 mm"}, scan={"trajectory": points}, output=lasting)


def peaks(scene: Scene) -> Real:
    return np.asarray(np.max(np.abs(np.concatenate(list(blocks(open_voice(scene))))), axis=0), dtype=float)


def test_a_recording_is_scaled_by_its_loudest_place_and_not_by_its_largest_load() -> None:
    """It had peaked at 76 in a float file: pressed by 1 N the texture hardly moves the finger."""
    scene = scene_of(scan={"trajectory": GETS_LOUDER}, output={"duration": 0.3})
    assert peaks(scene) == pytest.approx([0.8], rel=0.02)


@pytest.mark.parametrize(
    "seeds", [range(3), pytest.param(range(3, 500), marks=pytest.mark.thorough)], ids=["some", "all"]
)
def test_recordings_peak_at_four_fifths(seeds: range) -> None:
    for seed in seeds:
        points = random_recording(seed)
        found = peaks(recording(points, sample_rate=8000))
        touches = any(load > 0.0 for _time, _place, load in points)
        assert np.all(found <= 0.9), seed
        assert np.all(found >= 0.7) if touches else not found.any(), seed


def test_a_long_recording_is_solved_where_it_is_loud(monkeypatch: pytest.MonkeyPatch) -> None:
    """0.1 s of 3 s are ten times as fast: they are found though a fifth of the recording is solved."""
    places = np.cumsum(0.02 * np.where((np.arange(150) > 100) & (np.arange(150) < 105), 0.1, 0.01))
    points = [[0.02 * number, place, 0.3] for number, place in enumerate(places)]
    solved = prepare(recording(points, sample_rate=8000))
    assert solved.contact is not None and solved.mean is not None
    whole = peaks_along(solved.contact, solved.scene, solved.mean, (0, 1, 2))
    monkeypatch.setattr(motion_peak, "PATIENCE", 0.02)
    part = peaks_along(solved.contact, solved.scene, solved.mean, (0, 1, 2))
    assert part == pytest.approx(whole, rel=0.1)


@pytest.mark.parametrize("length", ["0.2 mm", "1 mm", "30 mm"])
def test_strokes_peak_at_four_fifths(length: str) -> None:
    stroke = {"length": length, "speed": "80 mm/s"}
    scene = scene_of(scan={"stroke": stroke}, output={"channels": list(QUANTITIES), "duration": 0.8})
    found = peaks(scene)
    assert np.all(found <= 0.9) and np.all(found >= 0.6)
