"""`render` returns a Sound with values in physical units, a spectrum and a file, for every way to give a scene."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import synth
from synth import Sound, explain, open_voice, parse_scene, render
from synth.errors import InvalidRequest, SceneError
from tests.file_metadata import read_metadata

DOCUMENT: dict[str, Any] = {
    "texture": {"kind": "grating-1mm-31um"},
    "output": {"channels": ["displacement", "acceleration"], "sample_rate": 8000, "duration": 0.25},
}


@pytest.fixture(scope="module")
def sound() -> Sound:
    return render(DOCUMENT)


def test_every_way_to_give_a_scene_gives_the_same(sound: Sound, tmp_path: Path) -> None:
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(DOCUMENT))
    for source in (parse_scene(DOCUMENT), path, str(path)):
        assert np.array_equal(render(source).frames, sound.frames)
        assert np.array_equal(open_voice(source).render(100), sound.frames[:100])
    assert explain(path).scene == explain(DOCUMENT).scene


def test_a_name_of_the_catalogue_is_a_scene() -> None:
    assert open_voice("grating-1mm-31um").scene == parse_scene("grating-1mm-31um")


@pytest.mark.parametrize(
    "source", ["grating-1mm", "none.json", {"texture": {"perod": 1}}, 7, None, ["grating-1mm-31um"]]
)
def test_what_is_no_scene_is_refused_in_words(source: Any) -> None:
    for call in (render, open_voice, explain):
        with pytest.raises(SceneError):
            call(source)


def test_values_are_in_the_units_that_it_names(sound: Sound) -> None:
    assert sound.units == ("m", "m/s^2") and sound.seconds == 0.25
    assert np.allclose(sound.values, sound.frames * np.array(sound.full_scale), rtol=1e-7)
    assert sound.plan is not None
    extent = sound.plan.response["channels"][0]["peak_to_peak"]
    assert np.ptp(sound.values[:, 0]) == pytest.approx(extent, rel=0.02)


def test_it_says_what_it_is(sound: Sound) -> None:
    peaks = np.abs(sound.values).max(axis=0)
    assert repr(sound) == (
        f"<Sound of 0.25 s at 8000 Hz: displacement peak {peaks[0]:.3g} m (full scale {sound.full_scale[0]:.3g}), "
        f"acceleration peak {peaks[1]:.3g} m/s^2 (full scale {sound.full_scale[1]:.3g}); 1 warning>"
    )
    assert "8000 Hz: displacement (full scale" in repr(open_voice(DOCUMENT))


def test_the_spectrum_reads_the_amplitude_of_a_sinusoid() -> None:
    times = np.arange(8000) / 8000
    wave = (3.0 + 0.5 * np.sin(2 * np.pi * 440.0 * times)).astype(np.float32)[:, np.newaxis]
    frequencies, amplitudes = Sound(wave, 8000, (4.0,), ("acceleration",), {}).spectrum()
    assert frequencies[np.argmax(amplitudes[:, 0])] == 440.0
    assert amplitudes.max() == pytest.approx(2.0, rel=1e-3)
    assert len(Sound(wave[:0], 8000, (4.0,), ("acceleration",), {}).spectrum()[0]) >= 1


def test_it_is_saved_with_its_scale_and_its_scene(sound: Sound, tmp_path: Path) -> None:
    target = sound.save(tmp_path / "out.wav")
    kept = read_metadata(target)
    assert kept is not None and kept.full_scale == sound.full_scale
    assert parse_scene(kept.scene) == sound.scene
    with pytest.raises(InvalidRequest, match=r"\.wav"):
        sound.save(tmp_path / "out.mp3")


def test_a_plot_has_a_wave_and_a_spectrum_of_each_channel(sound: Sound) -> None:
    axes = sound.plot().axes
    assert [one.get_ylabel() for one in axes[::2]] == ["displacement (m)", "acceleration (m/s^2)"]


def test_the_package_lists_what_it_has() -> None:
    assert set(synth.__all__) <= set(dir(synth))
    assert all(getattr(synth, name) for name in synth.__all__)
