"""Preparation: number of harmonics, tolerance, full scale (also of a varying scan), and what is cached."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from synth.encode.sound import render
from synth.perception.threshold import THRESHOLDS, imperceptible_tolerance, threshold_displacement
from synth.plan import motion_peak
from synth.plan.motion_peak import peaks_along
from synth.plan.prepare import EXACT, prepare
from synth.plan.request import N_MAX, harmonics_below
from synth.response_cache import ResponseCache
from synth.scene.catalogue import catalogue
from synth.scene.output_section import THRESHOLD_NAME
from synth.scene.scene import Scene, parse_scene
from synth.voice.voice import blocks, open_voice
from tests.few import thorough
from tests.reference.synthesis_oracle import highest_harmonic, synthesise
from tests.synth.engine_cases import QUANTITIES, Real, physical, scene_of, touch_of
from tests.synth.voice.recorded_cases import Points, random_recording

SHORT = {"contact_length": "3 mm"}


@given(st.floats(1e-6, 1e5), st.floats(1.0, 1e5))
def test_harmonics_are_those_below_the_limit(frequency: float, limit: float) -> None:
    count = harmonics_below(frequency, limit)
    assert count <= N_MAX
    assert count == 0 or count * frequency < limit * (1 + 1e-9)
    assert count == N_MAX or (count + 1) * frequency >= limit * (1 - 1e-9)


def test_a_harmonic_on_the_limit_is_not_below_it() -> None:
    assert harmonics_below(100.0, 19200.0) == 191 == highest_harmonic(0.08, 0.8e-3, 19200.0)
    assert harmonics_below(0.0, 1.0) == N_MAX
    assert harmonics_below(100.0, 100.0) == 0


@pytest.mark.parametrize(
    ("sections", "harmonics"),
    [
        ({}, 191),
        ({"scan": {"speed": -0.08}}, 191),
        ({"output": {"sample_rate": 8000}}, 31),
        ({"output": {"bandwidth": 1000}}, 9),
        ({"scan": {"speed": 1e-4}}, N_MAX),
        ({"scan": {"speed": 0}}, N_MAX),
    ],
)
def test_harmonics_of_a_scene(sections: dict[str, Any], harmonics: int) -> None:
    assert prepare(scene_of(finger=SHORT, **sections)).highest == harmonics


def test_full_scales_are_08_of_the_peak_of_the_oracle() -> None:
    scene = scene_of(finger=SHORT, output={"channels": list(QUANTITIES), "sample_rate": 96000, "bandwidth": 3200})
    wanted = synthesise(touch_of(scene), 0.08, 3200.0, relative_error=1e-5)
    for channel in prepare(scene).channels:
        assert channel.full_scale == pytest.approx(wanted.peak(channel.quantity) / 0.8, rel=0.01)
        assert channel.extent == pytest.approx(wanted.peak_to_peak(channel.quantity), rel=0.01)


@pytest.mark.parametrize("name", [thorough("moulded-plastic"), thorough("oak-along"), "denim-72x56"])
def test_the_peak_of_a_file_is_08_between_the_points_of_the_series_too(name: str) -> None:
    (everyday,) = (entry.everyday for entry in catalogue() if entry.name == name)
    scene = parse_scene({**everyday, "output": {"duration": 1.0, "sample_rate": 192000}})
    (channel,), values = prepare(scene).channels, render(scene).values
    assert channel.full_scale == pytest.approx(np.max(np.abs(values)) / 0.8, rel=2e-3)
    assert channel.extent == pytest.approx(np.ptp(values), rel=1e-3)


def test_the_tolerance_is_a_number() -> None:
    assert prepare(scene_of(accuracy={"tolerance": 0.02})).tolerance == 0.02
    assert prepare(scene_of(accuracy={"tolerance": "exact"}, output={"sample_rate": 8000})).tolerance == EXACT == 1e-6


@pytest.mark.parametrize("quantity", QUANTITIES)
@pytest.mark.parametrize("threshold", THRESHOLDS)
def test_imperceptible_errors_stay_6_db_below_the_threshold_at_every_frequency(quantity: str, threshold: str) -> None:
    output = {"quantity": quantity, "sample_rate": 8000}
    scene = scene_of(accuracy={"tolerance": "imperceptible", "threshold": threshold}, output=output)
    solved = prepare(scene)
    assert 1e-7 < solved.tolerance <= 3e-2
    fine = physical(open_voice(scene_of(accuracy={"tolerance": "exact"}, output=output)), 8000)[:, 0]
    error = physical(open_voice(scene), 8000)[:, 0] - fine
    lines = np.abs(np.fft.rfft(error))[1:] * 2 / 8000
    frequencies = np.arange(1.0, lines.size + 1)
    felt = threshold_displacement(frequencies, threshold) * (2 * np.pi * frequencies) ** QUANTITIES.index(quantity)
    assert np.max(lines / felt) <= 10 ** (-6 / 20)


def test_another_threshold_is_another_tolerance() -> None:
    tolerances = [
        prepare(scene_of(accuracy={"tolerance": "imperceptible", "threshold": name})).tolerance for name in THRESHOLDS
    ]
    assert len(set(tolerances)) == len(THRESHOLDS)


def test_a_threshold_beyond_the_tightest_tolerance_is_warned_of() -> None:
    scene = scene_of(
        accuracy={"tolerance": "imperceptible", "threshold": "pen"},
        texture={"amplitude": "1 mm"},
        scan={"speed": 0.01, "load": 0.05},
        output={"sample_rate": 1000, "bandwidth": 20},
    )
    solved = prepare(scene)
    assert (solved.tolerance > 1e-7) == (not solved.warnings)


ANCHORS = {
    "fingertip": [(300.0, 0.126), (3.0, 25.1), (100.0, 0.782), (1000.0, 0.93)],
    "probe": [(20.0, 25.1), (100.0, 2.28), (300.0, 0.255), (1000.0, 1.89)],
    "pen": [(10.0, 26.0), (40.0, 1.3), (100.0, 0.184), (320.0, 0.06)],
}


@pytest.mark.parametrize("name", THRESHOLDS)
def test_a_threshold_goes_through_its_published_points(name: str) -> None:
    for frequency, micrometres in ANCHORS[name]:
        assert threshold_displacement(np.array([frequency]), name)[0] == pytest.approx(micrometres * 1e-6, rel=0.03)


def test_the_scene_knows_every_threshold() -> None:
    assert set(THRESHOLD_NAME.names) == set(THRESHOLDS) == set(ANCHORS)


def test_a_tolerance_that_is_not_felt_follows_the_lowest_threshold() -> None:
    frequencies = np.geomspace(1, 1000, 4000)
    assert imperceptible_tolerance(frequencies, 0, 0.0) == np.inf
    assert imperceptible_tolerance(frequencies, 0, 1e-6) == pytest.approx(0.5 * np.pi / 4 * 0.126, rel=0.01)


def test_what_was_prepared_comes_from_the_cache() -> None:
    cache = ResponseCache()
    first = prepare(scene_of(), cache)
    misses = cache.misses
    again = prepare(scene_of(), cache)
    assert cache.misses == misses
    assert again.spectrum is first.spectrum
    longer = prepare(scene_of(output={"duration": 7.0, "fade": 1.0}), cache)
    assert longer.spectrum is first.spectrum and longer.scene.output.duration == 7.0
    scaled = prepare(scene_of(output={"full_scale": 3.0}), cache)
    assert scaled.spectrum is first.spectrum is not None and scaled.channels[0].full_scale == 3.0
    misses = cache.misses
    prepare(scene_of(scan={"load": 0.31}), cache)
    assert cache.misses > misses


def test_a_tolerance_that_was_not_reached_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("synth.response.spectrum.MOST_PHASES", 1 << 10)
    solved = prepare(scene_of(accuracy={"tolerance": 1e-5}, output={"quantity": "acceleration"}))
    assert solved.channels[0].error > 1e-5
    assert any("error of the acceleration is" in warning for warning in solved.warnings)
    assert not prepare(scene_of(accuracy={"tolerance": 3e-2}, output={"quantity": "displacement"})).warnings


GETS_LOUDER = [[0, 0, 0.1], [0.1, 0.008, 0.3], [0.2, 0.016, 1.0], [0.3, 0.02, 0.2]]


def recording(points: Points, **output: object) -> Scene:
    lasting = {"duration": points[-1][0] + 0.03, "channels": list(QUANTITIES), **output}
    return scene_of(finger=SHORT, scan={"trajectory": points}, output=lasting)


def peaks(scene: Scene) -> Real:
    return np.asarray(np.max(np.abs(np.concatenate(list(blocks(open_voice(scene))))), axis=0), dtype=float)


def test_a_recording_is_scaled_by_its_loudest_place_and_not_by_its_largest_load() -> None:
    """Such a scene once peaked at 76 in a float file: at 1 N the texture hardly moves the finger."""
    scene = scene_of(finger=SHORT, scan={"trajectory": GETS_LOUDER}, output={"duration": 0.33, "sample_rate": 8000})
    assert peaks(scene) == pytest.approx([0.8], rel=0.02)


@pytest.mark.parametrize(
    "seeds", [range(2), pytest.param(range(2, 40), marks=pytest.mark.thorough)], ids=["some", "all"]
)
def test_recordings_peak_at_four_fifths(seeds: range) -> None:
    for seed in seeds:
        points = random_recording(seed)
        found = peaks(recording(points, sample_rate=8000))
        touches = any(load > 0.0 for _time, _place, load in points)
        assert np.all(found <= 0.9), seed
        assert np.all(found >= 0.7) if touches else not found.any(), seed


def test_a_long_recording_is_solved_where_it_is_loud(monkeypatch: pytest.MonkeyPatch) -> None:
    """0.1 s of 3 s are ten times as fast. They are found although only a fifth of the recording is solved.

    For 1 s the finger is lifted and moves twice as fast as that, which nobody feels.
    """
    number = np.arange(150)
    lifted = (number >= 20) & (number <= 70)
    speeds = np.where((number > 100) & (number < 105), 0.1, np.where(lifted, 0.2, 0.01))
    loads = np.where(lifted, 0.0, 0.3)
    points = np.column_stack([0.02 * number, np.cumsum(0.02 * speeds), loads]).tolist()
    solved = prepare(recording(points, sample_rate=8000))
    assert solved.contact is not None and solved.mean is not None
    whole, told = peaks_along(solved.contact, solved, solved.mean, (0, 1, 2))
    assert not told
    monkeypatch.setattr(motion_peak, "PATIENCE", 0.02)
    part, told = peaks_along(solved.contact, solved, solved.mean, (0, 1, 2))
    assert "may have been missed" in told
    assert part == pytest.approx(whole, rel=0.1)


@pytest.mark.parametrize("length", ["0.2 mm", "1 mm", "30 mm"])
def test_strokes_peak_at_four_fifths(length: str) -> None:
    stroke = {"length": length, "speed": "80 mm/s"}
    scene = scene_of(scan={"stroke": stroke}, output={"channels": list(QUANTITIES), "duration": 0.8})
    found = peaks(scene)
    assert np.all(found <= 0.82) and np.all(found >= 0.78)


def test_a_stroke_that_is_still_between_its_turns_is_heard_in_them() -> None:
    # the ridges cancel every harmonic but each fourth, and at full speed the fourth is above the band
    scan = {"stroke": {"length": "50 mm", "speed": "0.6 m/s"}}
    output = {"sample_rate": 8000, "duration": 0.2, "bandwidth": 1000}
    scene = scene_of(texture={"period": "2 mm"}, scan=scan, output=output)
    heard = np.concatenate(list(blocks(open_voice(scene))))
    assert np.max(np.abs(heard[:400])) == pytest.approx(0.8, rel=0.05), "the first half of a turn"
    assert np.max(np.abs(heard[430:550])) < 0.05, "at full speed"


@pytest.mark.thorough
def test_the_error_of_a_simulated_quantity_is_told_once() -> None:
    """That of the contact without effects is no error of the render."""
    finger = {"kind": "fingertip", "contact_length": "1.5 mm"}
    sections: dict[str, Any] = {"finger": finger, "texture": {"kind": "grating"}, "accuracy": {"tolerance": 1e-7}}
    plain = prepare(scene_of(**sections))
    simulated = prepare(scene_of(**sections, effects={"inertia": {}}))
    assert any("error of the acceleration" in text and "by step" not in text for text in plain.warnings)
    told = [text for text in simulated.warnings if "error of the acceleration" in text]
    assert len(told) == 1 and "step by step" in told[0]
