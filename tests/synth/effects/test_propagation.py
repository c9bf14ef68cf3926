"""Motion at a distance: gain and delay against the law, moving scans against Fourier, silence, refusals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from synth import Motion, open_voice, parse_scene
from synth.errors import SceneError
from synth.response_cache import ResponseCache
from synth.scene.scene import Scene
from synth.voice.hand_voice import HandVoice
from synth.voice.skin_wave import QUIET, SkinFilter, SkinWave
from tests.few import thorough
from tests.reference.skin_wave_oracle import Way, filtered
from tests.reference.spectral_checks import fit_harmonics
from tests.synth.effects.effect_cases import hand
from tests.synth.effects.whole_renders import SHORT
from tests.synth.engine_cases import Real, physical

RATE = 8000
CACHE = ResponseCache()
WAYS = {
    "nail": Way(15e-3, 5e-3, body=50.0),
    "skin": Way(8e-3, 5e-3),
    "wrist": Way(170e-3, 5e-3),
}
SMOOTH: dict[str, Any] = {
    "finger": {"ridge_amplitude": 0.0},
    "texture": {"amplitude": "1 um"},
    "scan": {"load": "1 N"},
}
"""The whole finger touches, so that the motion is one sinusoid."""


def scene(settings: dict[str, Any] | None = None, effects: dict[str, Any] | None = None, **sections: Any) -> Scene:
    """Return a scene whose acceleration is propagated."""
    output = {"quantity": "acceleration", "sample_rate": RATE, **sections.pop("output", {})}
    return parse_scene({**sections, "output": output, "effects": {**(effects or {}), "propagation": settings or {}}})


def at(speed: float, **sections: Any) -> dict[str, Any]:
    """Return SMOOTH at a speed, with other sections."""
    return {**SMOOTH, "scan": {**SMOOTH["scan"], "speed": speed}, **sections}


def filter_of(name: str) -> SkinFilter:
    """Return the engine's filter of a way at RATE, for the default band."""
    way = WAYS[name]
    return SkinFilter.of(SkinWave.of(way.distance, way.radius, way.speed, way.near, way.body), RATE, 1000.0)


def of_line(values: Real, rate: float, hertz: float) -> complex:
    """Return the amplitude and phase of a sinusoid of `hertz`."""
    return complex(2.0 * fit_harmonics(values, rate, hertz, 1.5 * hertz).coefficients[1])


@pytest.mark.parametrize("name", WAYS)
def test_the_law_is_the_power_of_the_distance_at_its_frequencies(name: str) -> None:
    way = WAYS[name]
    law = SkinWave.of(way.distance, way.radius, way.speed, way.near, way.body)
    hertz = np.array([0.0, 5.0, 50.0, 225.0, 400.0, 1e3, 1e5])
    assert np.allclose(law.gain(hertz), way.gain(hertz), rtol=1e-9, atol=0.0)
    ratio = way.distance / way.radius
    assert abs(law.gain(hertz[-1:])[0]) == pytest.approx(ratio**-1.3, rel=1e-3)
    if way.body:
        assert abs(law.gain(np.array([5.0]))[0]) == pytest.approx(1.0, abs=0.01)
    else:
        assert abs(law.gain(np.array([225.0]))[0]) == pytest.approx(ratio**-1.1, rel=1e-12)
        assert abs(law.gain(np.array([0.0]))[0]) == pytest.approx(ratio**-1.3, rel=1e-12)


@pytest.mark.parametrize("name", WAYS)
@pytest.mark.parametrize("hertz", [20.0, 100.0, 225.0, 700.0])
@pytest.mark.parametrize("way", ["scan", "hand"])
def test_gain_and_delay_of_one_harmonic_are_those_of_the_law(name: str, hertz: float, way: str) -> None:
    speed = hertz * 0.8e-3
    voice = open_voice(scene({"place": name}, **at(speed)), cache=CACHE)
    count, motion = round(max(0.6, 12.0 / hertz) * RATE), None
    if way == "hand":
        motion = Motion.of(count, speed=speed, load=1.0)
    values = voice.render(count, motion).astype(float)[RATE // 4 :] * np.array(voice.full_scale)
    contact, place = (of_line(values[:, column], RATE, hertz) for column in (0, 1))
    wanted = contact * WAYS[name].gain(np.array([hertz]))[0]
    allowed = 1e-6 if way == "scan" else filter_of(name).error
    assert allowed <= 1.1e-3
    assert abs(place - wanted) <= allowed * abs(contact)
    assert abs(place - wanted) <= voice.plan.estimated_error["propagated_acceleration"] * 2.0 * abs(wanted)


@pytest.mark.parametrize("quantity", ["displacement", "velocity", thorough("acceleration")])
def test_every_harmonic_of_a_constant_scan_has_the_gain_of_its_frequency(quantity: str) -> None:
    scan, output = {"speed": "-80 mm/s"}, {"quantity": quantity, "sample_rate": RATE, "bandwidth": "full"}
    found = open_voice(scene(scan=scan, output=output), cache=CACHE)
    exact = open_voice(parse_scene({"scan": scan, "output": output, "accuracy": {"tolerance": 1e-6}}), cache=CACHE)
    contact, place = physical(exact, RATE)[:, 0], physical(found, RATE)[:, 1]
    fits = fit_harmonics(contact, RATE, 100.0, 0.4 * RATE)
    gains = WAYS["nail"].gain(100.0 * np.arange(len(fits.coefficients), dtype=np.float64))
    wanted = type(fits)(fits.coefficients * gains, 100.0, RATE).signal(np.arange(RATE))
    told = found.plan.estimated_error[f"propagated_{quantity}"]
    assert told <= 1.05e-3
    assert np.max(np.abs(place - wanted)) <= (told + 1e-5) * np.ptp(wanted)


@pytest.mark.parametrize("place", [*WAYS])
def test_a_stroke_is_that_of_fouriers_transform(place: str) -> None:
    stroke = {"speed": "80 mm/s", "length": "12 mm", "turn_time": "60 ms"}
    voice = open_voice(scene({"place": place}, scan={"stroke": stroke}, finger=SHORT), cache=CACHE)
    values = physical(voice, RATE)
    way = WAYS[place]
    wanted = Way(way.distance, 1.5e-3, body=way.body).travelled(values[:, 0], RATE)
    missed = np.abs(values[:, 1] - wanted)[:-400]
    extent = voice.plan.response["channels"][1]["peak_to_peak"]
    arrived = round((way.distance / way.speed + 0.01) * RATE)
    assert np.max(missed[arrived:]) <= voice.plan.estimated_error["propagated_acceleration"] * extent
    assert np.max(missed[:arrived]) <= 5e-3 * extent, "the step with which a stroke begins is above the band"


def test_a_stroke_whose_only_harmonic_cancels_tells_the_error_of_its_turns() -> None:
    stroke = {"speed": "100 mm/s", "length": "30 mm", "load": "0.3 N"}  # 25 ridges of 0.4 mm: no line at 250 Hz
    output = {"quantity": "displacement", "bandwidth": "300 Hz"}
    cancels = scene({"place": "wrist"}, scan={"stroke": stroke}, texture={"period": "0.4 mm"}, output=output)
    voice = open_voice(cancels, cache=CACHE)
    values, told = physical(voice, RATE), voice.plan.estimated_error["propagated_displacement"]
    wanted = Way(170e-3, 5e-3).travelled(values[:, 0], RATE)[:-400]
    arrived = round((170e-3 / 7.0 + 0.01) * RATE)  # a displacement does not begin at 0, as the transform's does
    missed = np.max(np.abs(values[:-400, 1] - wanted)[arrived:]) / np.ptp(wanted)
    assert missed <= told <= 2e-3


def test_a_hand_that_lands_is_that_of_fouriers_transform() -> None:
    voice = open_voice(scene(finger=SHORT, output={"quantity": "velocity"}), cache=CACHE, live=True)
    turns = np.pi * np.minimum(np.arange(RATE // 2) / 800, 1.0)
    motion = Motion.of(
        len(turns), speed=0.06 + 0.03 * np.sin(turns), speed_rate=0.03 * np.cos(turns) * np.pi * 10.0 * (turns < np.pi),
        load=0.15 * (1.0 - np.cos(turns)), load_rate=0.15 * np.sin(turns) * np.pi * 10.0,
    )  # fmt: skip
    values = voice.render(len(turns), motion).astype(float) * np.array(voice.full_scale)
    wanted = Way(15e-3, 1.5e-3, body=50.0).travelled(values[:, 0], RATE)[:-400]
    told = voice.plan.estimated_error["propagated_velocity"]
    assert np.max(np.abs(values[:-400, 1] - wanted)) <= told * voice.plan.response["channels"][1]["peak_to_peak"]


@pytest.mark.parametrize("effects", [{"inertia": {}}, thorough({"viscous_skin": {}})], ids=str)
def test_a_simulated_scan_has_the_gain_from_its_first_frame_on(effects: dict[str, Any]) -> None:
    voice = open_voice(scene(effects=effects, finger=SHORT), cache=CACHE)
    values = physical(voice, RATE // 2)
    fits = fit_harmonics(values[:, 0], RATE, 100.0, 0.4 * RATE)
    gains = Way(15e-3, 1.5e-3, body=50.0).gain(100.0 * np.arange(len(fits.coefficients), dtype=np.float64))
    wanted = type(fits)(fits.coefficients * gains, 100.0, RATE).signal(np.arange(len(values)))
    told = voice.plan.estimated_error["propagated_acceleration"]
    assert np.max(np.abs(values[:, 1] - wanted)) <= told * np.ptp(wanted)


MOTIONS: dict[str, dict[str, Any]] = {
    "constant": {},
    "stroke": {"scan": {"stroke": {}}},
    "simulated": {"effects": {"inertia": {}}},
}


@pytest.mark.parametrize("name", [*MOTIONS, "hand"])
def test_random_blocks_are_one_big_block_to_the_sample(name: str) -> None:
    asked = scene({"place": "wrist"}, finger=SHORT, **MOTIONS.get(name, {}))

    def rendered(*sizes: int) -> Real:
        voice, begin, parts = open_voice(asked, cache=CACHE), 0, []
        for size in sizes:
            parts.append(voice.render(size, hand(size, RATE, begin) if name == "hand" else None))
            begin += size
        return np.concatenate(parts)

    sizes = np.random.default_rng(3).multinomial(900, np.ones(13) / 13)
    whole = rendered(900)
    assert np.array_equal(rendered(1, 0, *map(int, sizes[:-1]), int(sizes[-1]) - 1), whole)
    assert np.any(whole[:, 1])


@pytest.mark.parametrize("settings", [{"distance": 0}, {"place": "skin", "contact_radius": "8 mm"}], ids=str)
@pytest.mark.parametrize("name", [*MOTIONS, "hand"])
def test_within_the_contact_it_is_the_channel_itself(name: str, settings: dict[str, Any]) -> None:
    voice = open_voice(scene(settings, finger=SHORT, **MOTIONS.get(name, {})), cache=CACHE)
    block = voice.render(500, hand(500, RATE) if name == "hand" else None)
    assert voice.full_scale[1] == pytest.approx(voice.full_scale[0], rel=1e-12)
    assert np.allclose(block[:, 1], block[:, 0], rtol=2e-7, atol=0.0) and np.any(block)


def test_a_hand_that_lifts_is_exact_silence_a_moment_later() -> None:
    voice = open_voice(scene({"place": "wrist"}, finger=SHORT), cache=CACHE)
    load = np.concatenate([np.full(400, 0.3), 0.15 * (1 + np.cos(np.pi * np.arange(80) / 80)), np.zeros(2400)])
    block = voice.render(len(load), Motion.of(len(load), speed=0.08, load=load))
    assert np.any(block[480:680, 1]), "the wave is on its way"
    assert not np.any(block[-400:])


@pytest.mark.parametrize("name", ["nail", "wrist"])
def test_a_finger_at_rest_stands_where_it_stood(name: str) -> None:
    still = Motion.of(2000, speed=0.0, load=0.3)
    voice = open_voice(scene({"place": name}, output={"quantity": "displacement"}), cache=CACHE)
    block = voice.render(2000, still).astype(float) * np.array(voice.full_scale)
    assert block[-1, 0] != 0.0
    share = WAYS[name].gain(np.zeros(1))[0].real
    assert np.ptp(block[50:, 1]) <= 1e-6 * abs(block[-1, 0])
    assert block[-1, 1] == pytest.approx(share * block[-1, 0], rel=1e-4)


def test_a_live_hand_is_as_loud_as_its_contact() -> None:
    """The automatic full scale leaves the place the room that it leaves the contact, for a usual hand."""
    asked = scene(finger=SHORT)
    contact, place = open_voice(asked, cache=CACHE, live=True).full_scale
    quiet, late = open_voice(asked, cache=CACHE).full_scale
    assert contact / quiet == pytest.approx(place / late, rel=0.05)
    voice = HandVoice(asked, cache=CACHE)
    assert voice.full_scale == (contact, place)
    assert np.any(voice.render(800)[:, 1])


def test_the_steady_peak_is_four_fifths_of_full_scale_or_of_what_is_asked() -> None:
    voice = open_voice(scene(output={"sample_rate": 48000}), cache=CACHE)
    assert np.max(np.abs(voice.render(RATE)[:, 1])) == pytest.approx(0.8, rel=1e-2)
    assert open_voice(scene({"full_scale": 7.0}), cache=CACHE).full_scale[1] == 7.0


@pytest.mark.parametrize("place", ["nail", "wrist"])
@pytest.mark.parametrize("phase", [0.0, 1.5])
def test_a_constant_scan_shorter_than_a_period_is_as_loud_as_its_own_frames(place: str, phase: float) -> None:
    document = {
        "texture": {"kind": "grating", "period": "20 mm", "height": "200 um", "ramp": "0.3 mm", "phase": phase},
        "effects": {"propagation": {"place": place}},
        "output": {"sample_rate": 8000, "duration": 0.06},
    }
    voice = open_voice(parse_scene(document))
    assert np.max(np.abs(voice.render(480)), axis=0) == pytest.approx([0.8, 0.8], rel=1e-5)


def test_the_quantity_is_chosen_among_the_channels() -> None:
    channels = {"channels": ["approach", "velocity", "acceleration"], "quantity": None}
    first = open_voice(scene(output=channels), cache=CACHE)
    assert first.quantities[-1] == "propagated_velocity"
    other = open_voice(scene({"quantity": "acceleration"}, output=channels), cache=CACHE)
    assert other.quantities[-1] == "propagated_acceleration"
    assert other.plan.response["channels"][-1]["unit"] == "m/s^2"


@pytest.mark.parametrize(
    ("settings", "pointer", "words"),
    [
        ({"distance": "0.6 m"}, "distance", ("0 m", "500 mm")),
        ({"distance": -0.01}, "distance", ("0 m", "500 mm")),
        ({"place": "elbow"}, "place", ("nail", "skin", "wrist")),
        ({"contact_radius": 0}, "contact_radius", ("1 um",)),
        ({"quantity": "approach"}, "quantity", ("displacement",)),
        ({"full_scale": "5 m/s"}, "full_scale", ("plain JSON number",)),
        ({"full_scale": 0}, "full_scale", ("1e-24",)),
        ("auto", "", ("adds a channel",)),
    ],
    ids=str,
)
def test_bad_settings_are_refused_with_what_to_write(settings: Any, pointer: str, words: tuple[str, ...]) -> None:
    with pytest.raises(SceneError) as refused:
        parse_scene({"effects": {"propagation": settings}})
    (fault,) = refused.value.faults
    assert fault.pointer == "/effects/propagation" + (f"/{pointer}" if pointer else "")
    assert all(word in f"{fault.allowed} {fault.hint}" for word in words), fault


@pytest.mark.parametrize("output", [{"quantity": "approach"}, {"quantity": "velocity"}], ids=str)
def test_a_channel_that_the_scene_lacks_is_refused(output: dict[str, Any]) -> None:
    with pytest.raises(SceneError) as refused:
        open_voice(scene({"quantity": "acceleration"}, output=output))
    (fault,) = refused.value.faults
    assert fault.pointer == "/effects/propagation/quantity"
    assert "Add acceleration to output.channels" in fault.hint


@pytest.mark.parametrize("place", [*WAYS])
def test_the_compiled_filter_is_its_slow_twin_and_ends_in_exact_zero(place: str) -> None:
    made = filter_of(place)
    values = np.concatenate([np.random.default_rng(1).standard_normal(1000), np.zeros(3000)])
    found = made.run(*made.start(0.0), values)
    twin = filtered(values, made.first, made.taps, made.wave, made.body)
    assert np.max(np.abs(found - twin)) <= 10.0 * QUIET
    assert not np.any(found[-400:]) and np.all(twin[1000:1400] != 0.0)
    assert not np.any(made.run(*made.start(0.0), np.zeros(500)))
