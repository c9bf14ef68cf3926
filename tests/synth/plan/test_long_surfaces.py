"""Surfaces whose period is too long for a series: what is planned on a stretch, and what is rendered of the whole."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import pytest

import ridgewave as rw
from synth.contact.scene_contact import contact_of
from synth.contact.stiffness import Stiffness
from synth.errors import SceneError
from synth.motion.motion import Motion
from synth.plan.prepare import prepare
from synth.plan.request import N_MAX, harmonics_in_band
from synth.plan.scene_table import table_of_scene
from synth.plan.stretch import on_whole, stretch_of
from synth.response_cache import ResponseCache
from synth.scene.scene import Scene, parse_scene
from synth.surfaces import profile_of
from synth.surfaces.surface_data import SurfaceData, remember
from synth.voice.live_voice import LiveVoice
from synth.voice.voice import open_voice
from tests.reference.kinds_oracle import approach
from tests.synth.engine_cases import Real

CACHE = ResponseCache()
SHORT = {"contact_length": "3 mm"}  # few ridges: quick to solve
STEP = 10e-6
OF_ORACLE = 2e-4  # of the peak-to-peak


def random_heights(count: int, loud: slice = slice(0, 0), seed: int = 3) -> Real:
    """Return heights with waves of 0.1 to 5 mm, 5 um rms; at `loud` twice as high."""
    hertz = np.fft.rfftfreq(count, STEP)
    sizes = np.where((hertz > 200.0) & (hertz < 1e4), np.maximum(hertz, 1.0) ** -1.0, 0.0)
    phases = np.exp(2j * math.pi * np.random.default_rng(seed).random(len(sizes)))
    heights = np.fft.irfft(sizes * phases, count)
    heights *= 5e-6 / np.std(heights)
    heights[loud] *= 2.0
    return np.asarray(heights)


@cache
def track(length: float = 0.3, loud: tuple[float, float] = (0.0, 0.0)) -> str:
    """Return the address of a track of `length` (m), twice as high between two places (m)."""
    part = slice(*(round(place / STEP) for place in loud))
    return remember(SurfaceData(random_heights(round(length / STEP), part).astype(np.float32), (STEP,)))


def scene_of_track(surface: str = "", **sections: Any) -> Scene:
    """Return a scene on a track, mirrored at its ends."""
    texture = {"kind": "profile", "surface": surface or track(), "ends": "mirror", "phase": 0}
    return parse_scene({"texture": texture, **sections})


def test_only_a_long_and_rough_surface_has_a_stretch() -> None:
    texts: list[dict[str, Any]] = [
        {},
        {"texture": {"kind": "rough", "period": "20 mm"}},
        {"texture": {"kind": "grating-20mm-400um"}, "scan": {"speed": "1 mm/s"}},
        {"texture": {"period": 1.0, "amplitude": "1 mm"}},
    ]
    for text in texts:
        assert prepare(parse_scene(text | {"finger": SHORT}), CACHE).stretch is None
    assert prepare(scene_of_track(), CACHE).stretch is not None
    assert harmonics_in_band(scene_of_track(), N_MAX + 1) > N_MAX


def test_the_stretch_is_the_roughest_and_repeats_without_a_step() -> None:
    scene = scene_of_track(track(loud=(0.1, 0.15)))
    stretch = stretch_of(scene, N_MAX + 1, N_MAX)
    assert stretch is not None
    assert min(abs(stretch.begin - 0.1), abs(stretch.begin - 0.45)) < 1e-4  # or its mirror image
    whole, places = profile_of(scene), np.arange(0.0, 0.03, STEP)
    same = stretch.profile.heights(places) - whole.heights(stretch.begin + places)
    assert np.ptp(same - np.polyval(np.polyfit(places, same, 1), places)) < 1e-12  # but for a straight line
    assert stretch.profile.slope_bound < 1.5 * whole.slope_bound
    assert stretch.profile.rms[1] == pytest.approx(2.0 * 2**0.5 * 0.5 * whole.rms[1], rel=0.4)


@pytest.mark.parametrize("finger", ["comb", "probe", "fingertip"])
def test_the_contact_on_the_whole_surface_is_that_of_the_scene(finger: str) -> None:
    scene = scene_of_track(finger={"kind": finger})
    stretch = stretch_of(scene, N_MAX + 1, N_MAX)
    assert stretch is not None
    whole = on_whole(contact_of(scene, stretch.profile), scene)
    places, loads = np.linspace(0.2, 0.21, 40), np.full(40, 0.3)
    difference = np.abs(whole.heights(places, loads) - contact_of(scene).heights(places, loads))
    assert np.max(difference) <= (1e-3 if finger == "fingertip" else 2e-5) * whole.geometry.height_scale


def test_a_file_of_a_scan_along_a_track_is_the_quadrature_on_its_heights() -> None:
    """In the band, but for a constant, against z by quadrature at 4 kHz along the true heights."""
    rate, band, speed, load = 8000, 250.0, 0.02, 0.3
    output = {"quantity": "displacement", "sample_rate": rate, "bandwidth": band, "duration": 0.2}
    scene = scene_of_track(finger=SHORT, scan={"speed": speed, "load": load}, output=output)
    sound = rw.render(scene)
    assert sound.plan is not None
    assert sound.plan.response["method"] == "solved frames"
    assert sound.plan.response["harmonics"] == sound.plan.response["n_max"] > N_MAX
    frames, every = len(sound.values), 2
    places = speed * np.arange(0, frames, every) / rate
    profile, k = profile_of(scene), Stiffness.of_scene(scene).stiffness(load)
    z = approach(scene.finger, profile, places / profile.period, load / k)
    ours, wanted = (one - np.mean(one) for one in (sound.values[::every, 0], z))
    series = np.fft.rfft((ours - wanted) * np.hanning(len(z)))  # z does not repeat
    series[np.fft.rfftfreq(len(z), every / rate) > 0.95 * band] = 0.0
    told = sound.plan.estimated_error["displacement"]
    assert told <= 1e-3
    assert np.max(np.abs(np.fft.irfft(series, len(z)))) <= (told + OF_ORACLE) * np.ptp(ours)


def test_a_file_does_not_depend_on_where_it_is_cut_into_blocks() -> None:
    scene = scene_of_track(output={"sample_rate": 8000})
    voice = open_voice(scene, cache=CACHE)
    whole = voice.render(3000)
    voice.seek(1000)
    assert np.array_equal(voice.render(700), whole[1000:1700])
    assert 0.05 < np.max(np.abs(whole)) <= 1.2


def test_a_streamed_scan_along_a_track_is_its_file() -> None:
    scene = scene_of_track(output={"quantity": "velocity", "full_scale": 1e-3})
    file = open_voice(scene, cache=CACHE)
    stream = LiveVoice(scene, cache=CACHE)._voice
    assert stream.plan.response["method"] == "direct solutions"
    one, other = (voice.render(24000).astype(float)[:, 0] for voice in (file, stream))
    told = stream.plan.estimated_error["velocity"] + file.plan.estimated_error["velocity"]
    window, hertz = np.hanning(24000), np.fft.rfftfreq(24000, 1.0 / 48000)
    ours, wanted = (np.fft.rfft(values * window)[hertz < 950.0] for values in (other, one))
    assert np.linalg.norm(ours - wanted) <= 4.0 * told * np.linalg.norm(wanted)


def test_the_plan_says_that_levels_are_those_of_a_stretch_and_what_a_solution_costs() -> None:
    voice = open_voice(scene_of_track(), cache=CACHE, live=True)
    assert voice._for_hand is not None
    plan = LiveVoice(scene_of_track(), cache=CACHE).plan
    told = plan.response
    assert told["stretch"]["length"] == pytest.approx(0.05)
    assert told["direct"]["solutions_a_second"] == 8000.0
    assert 0.0 < told["direct"]["processor_seconds_a_second"] < 5.0
    assert told["fundamental_hz"] == pytest.approx(0.08 / (2.0 * (0.3 - STEP)))
    assert "a stretch of 0.05 m" in plan.simulated[0].reason
    assert [one.name for one in plan.simulated] == ["contact response", "direct solutions"]
    assert "period" not in " ".join(plan.warnings)


def test_the_roughest_part_is_not_limited() -> None:
    """An automatic full scale allows for the loud part, though the scan of the scene begins elsewhere."""
    scene = scene_of_track(track(loud=(0.1, 0.15)))
    voice = open_voice(scene, cache=CACHE, live=True)
    frames = 48000
    place = 0.08 + 0.08 * np.arange(frames) / 48000
    peak = np.max(np.abs(voice.render(frames, Motion.of(frames, position=place, load=0.3))))
    assert 0.05 < peak < 1.0


def test_a_long_surface_has_no_table() -> None:
    with pytest.raises(SceneError, match=r"texture: got a period of 0\.6 m.*64 harmonics.*without a table"):
        table_of_scene(scene_of_track())


@pytest.mark.parametrize("effects", [{"inertia": {"mass": "1 g"}}, {"tangential": {}}])
def test_effects_that_need_a_whole_period_are_refused_beyond_a_metre(effects: dict[str, Any]) -> None:
    with pytest.raises(SceneError, match=r"texture: got a period of 1\.2 m.*over a whole period"):
        prepare(scene_of_track(track(0.6), effects=effects), CACHE)


def test_effects_on_the_shape_and_on_the_output_work_on_a_track() -> None:
    several: list[dict[str, Any]] = [{"curvature": {}}, {"contact_growth": {}}, {"propagation": {"distance": "30 mm"}}]
    for effects in several:
        voice = open_voice(scene_of_track(finger=SHORT, effects=effects), cache=CACHE, live=True)
        block = voice.render(2000)
        assert np.isfinite(block).all()
        assert np.any(block)


def test_a_contact_of_many_points_keeps_its_table_and_a_few_ridges_do_not() -> None:
    texture = {"kind": "rough", "period": "20 mm"}
    wide = {"bandwidth": "4 kHz", "quantity": "displacement", "full_scale": "50 um"}
    methods = [
        LiveVoice(
            parse_scene({"texture": texture, "finger": {"kind": kind}, "output": wide, "scan": {"stroke": {}}}),
            cache=CACHE,
        ).plan.response["method"]
        for kind in ("comb", "fingertip")
    ]
    assert methods == ["direct solutions", "response table"]
