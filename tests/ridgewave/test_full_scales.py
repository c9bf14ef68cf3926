"""A sound at another full scale: its range, its scene, and its file rendered again."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import ridgewave as rw
from synth.scene.output_section import FULL_SCALE_RANGES

OUTPUT = {"duration": 0.05, "sample_rate": 8000}
SCENES: list[dict[str, Any]] = [
    {"output": OUTPUT},
    {"output": {**OUTPUT, "quantity": "velocity", "full_scale": "2 m/s"}},
    {"output": {**OUTPUT, "channels": ["velocity", {"quantity": "displacement", "full_scale": "1 mm"}]}},
    {"output": OUTPUT, "effects": {"tangential": {}, "propagation": {}}},
]


@pytest.mark.parametrize("scene", SCENES)
def test_a_file_at_another_scale_is_rendered_at_that_scale_again(scene: dict[str, Any], tmp_path: Path) -> None:
    sound = rw.render(scene)
    scales = tuple(scale * (2.0 + number) for number, scale in enumerate(sound.full_scale))
    changed = sound.with_full_scale(scales)
    np.testing.assert_allclose(changed.values, sound.values, rtol=1e-6)
    path = changed.save(tmp_path / "x.wav")
    again = rw.render(path)
    assert again.full_scale == changed.full_scale == scales
    assert rw.load(path).scene == changed.scene != sound.scene
    np.testing.assert_allclose(again.frames, changed.frames, rtol=0, atol=1e-6)
    loaded = rw.load(path).with_full_scale(sound.full_scale)
    assert loaded.scene == sound.with_full_scale(sound.full_scale).scene


def test_a_recording_is_rendered_at_another_scale_again(tmp_path: Path) -> None:
    contact = [[0, "contact", 1, 0.0, 0.0, None, 0.3], [200, "contact", 2, 0.025, 0.002, None, 0.3]]
    head = {"format": "ridgewave-recording", "version": 6, "scene": {"output": OUTPUT}, "full_scale": [50.0]}
    sound = rw.render({**head, "frames": 400, "faded": 0, "events": contact})
    again = rw.render(sound.with_full_scale("80 m/s^2").save(tmp_path / "x.wav"))
    assert again.full_scale == (80.0,)
    np.testing.assert_allclose(again.values, sound.values, rtol=0, atol=1e-6 * sound.peak[0])


@pytest.mark.parametrize("quantity", FULL_SCALE_RANGES)
def test_a_scale_is_in_the_range_of_its_field(quantity: Any) -> None:
    rule = FULL_SCALE_RANGES[quantity]
    sound = rw.Sound(np.full((9, 1), 0.5, np.float32), 8000, (1.0,), (quantity,), {})
    wrongs: list[Any] = [1e300, 1e-300, 0.0, -1.0, np.nan, np.inf, None, True, {}, "x", "1 kg", np.array(1e300)]
    for wrong in wrongs:
        with pytest.raises(rw.InvalidRequest) as caught:
            sound.with_full_scale(wrong)
        assert [(fault.pointer, fault.allowed) for fault in caught.value.faults] == [("/full_scale", rule.allowed)]
    ends: list[Any] = [rule.low, rule.high, rule.show(rule.low), np.array([rule.high])]
    for end in ends:
        frames = sound.with_full_scale(end).frames
        assert np.isfinite(frames).all() and frames.all()


def test_each_channel_has_its_own_unit() -> None:
    sound = rw.render(SCENES[2])
    assert sound.with_full_scale(["2 m/s", "3 mm"]).full_scale == (2.0, 0.003)
    assert sound.with_full_scale(np.array([2.0, 3.0])).full_scale == (2.0, 3.0)
    with pytest.raises(rw.InvalidRequest, match=r"full_scale\.1: got '3 m/s'"):
        sound.with_full_scale(["2 m/s", "3 m/s"])
    wrongs: list[Any] = [[], [1.0], [1.0] * 3, sound]
    for wrong in wrongs:
        with pytest.raises(rw.InvalidRequest, match="a list of 2, one per channel"):
            sound.with_full_scale(wrong)


def test_a_sound_of_a_surface_that_is_not_here_can_be_scaled() -> None:
    asked = {"texture": {"kind": "profile", "surface": "0" * 64}}
    sound = rw.Sound(np.zeros((9, 1), np.float32), 8000, (1.0,), ("velocity",), asked).with_full_scale(2)
    assert sound.asked == {**asked, "output": {"full_scale": 2.0}}


def test_a_series_is_a_list_of_sounds() -> None:
    sound = rw.render(SCENES[0])
    wrongs: list[Any] = [sound, [1], [sound, None], None, 5, "", np.zeros(3)]
    for wrong in wrongs:
        with pytest.raises(rw.InvalidRequest, match="a list of one Sound or more"):
            rw.common_full_scale(wrong)
    assert rw.common_full_scale(one for one in [sound]) == pytest.approx(sound.peak / 0.8)
