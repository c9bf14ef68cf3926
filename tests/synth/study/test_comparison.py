"""Measured vibrations beside the model: recordings whose truth is known, with what laboratories have to live with."""

from __future__ import annotations

import json
import math
import re
from typing import Any

import numpy as np
import pytest

import ridgewave as rw
from synth.study.comparison import Comparison, compared
from synth.study.steady_outcome import outcome_of
from tests.few import thorough

RATE, SECONDS = 10_000, 4.0
TIP = {"finger": {"kind": "fingertip"}, "texture": {"kind": "grating-1mm-31um"}}
COMB = {"texture": {"period": "1.3 mm"}, "scan": {"speed": 0.06, "load": 0.4}}
SCENES: dict[str, dict[str, Any]] = {"fingertip": TIP, "comb": COMB}
STORIES: dict[str, dict[str, float]] = {
    "noise": {"noise": 0.1},
    "another speed": {"noise": 0.1, "faster": 1.08},
    "hum": {"noise": 0.1, "hum": 0.7},
    "drift": {"noise": 0.1, "drift": 0.01},
    "wrong rate": {"noise": 0.1, "wrong_rate": 1.05},
}


def recording(
    scene: dict[str, Any], seed: int, *, noise: float = 0.0, faster: float = 1.0, hum: float = 0.0, drift: float = 0.0
) -> tuple[Any, Any]:
    """Return an acceleration (m/s^2) and its true lines: sines of the model's lines, drawn without the comparison.

    noise, hum: rms over that of the signal. drift: of the speed, to each side.
    """
    parsed = rw.parse_scene(scene)
    speed = parsed.scan.speed * faster
    moved = rw.parse_scene(parsed, scan={"speed": speed}, output={"bandwidth": "full"})
    lines, f = outcome_of(moved, 1024, 40)["line_amplitude"], speed / parsed.texture.period
    t = np.arange(round(RATE * SECONDS)) / RATE
    turned = 2.0 * math.pi * np.cumsum(f * (1.0 + drift * np.sin(2.0 * math.pi * 0.7 * t))) / RATE
    sizes = [line * (2.0 * math.pi * n * f) ** 2 if n * f < 1000.0 else 0.0 for n, line in enumerate(lines.tolist(), 1)]
    values = np.sum([size * np.cos(n * turned + 1.7 * n) for n, size in enumerate(sizes, 1)], axis=0)
    random, rms = np.random.default_rng([5, seed]), np.std(values)
    values = values + noise * rms * random.standard_normal(len(t))
    return values + math.sqrt(2.0) * hum * rms * np.sin(2.0 * math.pi * 50.0 * t + 0.4), np.array(sizes)


def beside(scene: dict[str, Any], values: Any, rate: float = RATE, *, scaled: bool = True) -> Comparison:
    return compared(rw.parse_scene(scene), values, rate, "acceleration", "recording", scaled=scaled)


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("story", STORIES)
@pytest.mark.parametrize("seed", [0, *(thorough(seed) for seed in range(1, 10))])
def test_speed_and_lines_are_those_of_the_truth(scene: str, story: str, seed: int) -> None:
    how = dict(STORIES[story])
    wrong = how.pop("wrong_rate", 1.0)
    values, sizes = recording(SCENES[scene], seed, **how)
    found = beside(SCENES[scene], values, RATE * wrong)
    truth = rw.parse_scene(SCENES[scene]).scan.speed * how.get("faster", 1.0)
    assert found.speed == pytest.approx(truth * wrong, rel=5e-3)
    assert any("another" in text for text in found.warnings) == (wrong != 1.0 or how.get("faster", 1.0) != 1.0)
    strong, noise = 0, 0.1 * math.sqrt(0.5 * float(np.sum(sizes**2)))
    for one in found.lines:
        size = float(sizes[one.measured.number - 1]) if one.measured.number <= len(sizes) else 0.0
        if size < 0.5 * noise or one.measured.mains:
            continue
        strong += 1
        assert one.measured.found
        assert abs(20.0 * math.log10(one.measured.amplitude / size)) < 0.5
        assert wrong != 1.0 or one.difference == pytest.approx(0.0, abs=0.5)
    assert strong >= 3
    assert not any("spread" in text for text in found.warnings)
    claimed = [one.measured.number for one in found.lines if one.measured.found]
    assert all(sizes[n - 1] > 0.0 for n in claimed if n <= len(sizes))


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("drift", [0.025, 0.04, 0.08])
def test_a_speed_that_varies_is_told_with_what_it_takes_from_a_level(scene: str, drift: float) -> None:
    values, sizes = recording(SCENES[scene], 0, noise=0.1, drift=drift)
    found = beside(SCENES[scene], values)
    (told,) = (text for text in found.warnings if "spread" in text)
    for number, lower in re.findall(r"line (\d+) is at least ([\d.]+) dB too low", told):
        (line,) = (one.measured for one in found.lines if one.measured.number == int(number))
        true = 20.0 * math.log10(sizes[int(number) - 1] / line.amplitude)
        assert 0.4 < float(lower) < true + 0.5
    assert found.speed == pytest.approx(rw.parse_scene(SCENES[scene]).scan.speed, rel=0.025)


@pytest.mark.parametrize("shape", ["burst", "short burst", "strokes", "ramp", "swell"])
def test_noise_whose_level_varies_claims_no_line(shape: str) -> None:
    """Over 40 seeds; a burst of noise has few degrees of freedom, however long the recording is."""
    t, alarms = np.arange(3 * 8000) / 8000.0, 0
    for seed in range(40):
        random = np.random.default_rng([9, seed])
        centre = random.uniform(0.5, 2.5)
        level = {
            "burst": np.exp(-0.5 * ((t - centre) / 0.1) ** 2),
            "short burst": np.exp(-0.5 * ((t - centre) / 0.02) ** 2),
            "strokes": np.sin(math.pi * t) ** 8,
            "ramp": t,
            "swell": 1.0 + 0.9 * np.sin(2.0 * math.pi * 1.3 * t),
        }[shape]
        found = beside(TIP, level * random.standard_normal(len(t)), 8000.0)
        alarms += any(one.measured.found for one in found.lines)
        if shape.endswith("burst"):
            assert any("level varies" in text for text in found.warnings)
    assert alarms <= 2, "the stated rate is 1 %"


def test_what_is_not_found_has_no_number_in_json() -> None:
    noise = np.random.default_rng(4).standard_normal(8000)
    json.dumps(beside(TIP, noise).document(), allow_nan=False)


def test_noise_alone_claims_no_line() -> None:
    """Over 200 seeds, with noise that is white or falls; the stated rate is 1 %, so more than 6 are a defect."""
    alarms = 0
    for seed in range(200):
        values = np.random.default_rng([6, seed]).standard_normal(16_000)
        if seed % 2:
            values = np.convolve(values, np.exp(-np.arange(40) / 8.0), "same")
        alarms += beside(TIP, values).speed is not None
    assert alarms <= 6


@pytest.mark.parametrize("hertz", [50.0, 60.0, 100.0, 150.0, 180.0])
@pytest.mark.parametrize("noise", [0.0, 0.1])
def test_lines_that_are_all_left_out_as_hum_are_told_with_a_speed_that_is_not(hertz: float, noise: float) -> None:
    speed = hertz * 0.8e-3
    scene = {"texture": {"period": "0.8 mm"}, "scan": {"speed": speed}, "finger": {"kind": "fingertip"}}
    found = beside(scene, recording(scene, 4, noise=noise)[0])
    assert found.speed is None and all(one.measured.mains for one in found.lines)
    (told,) = (text for text in found.warnings if "mains hum" in text)
    assert told.startswith(f"Every line of the stated speed, {hertz:g} Hz and its multiples, is within 2 Hz")
    other = float(told.rpartition("such as ")[2].removesuffix(" mm/s.")) / 1e3
    scene["scan"] = {"speed": other}
    again = beside(scene, recording(scene, 4, noise=noise)[0])
    assert again.speed == pytest.approx(other, rel=5e-3) and again.lines[0].measured.found


def test_noise_beside_hum_is_told_with_the_lines_that_are_left_out() -> None:
    noise = np.random.default_rng(4).standard_normal(40_000)
    (told,) = (text for text in beside(TIP, noise).warnings if "No line" in text)
    assert "beside multiples of 50 and 60 Hz, left out as mains hum (of the stated speed, number 3, 5, 6" in told


def test_a_clipped_sensor_is_told() -> None:
    values, _sizes = recording(TIP, 0, noise=0.05)
    most = 0.5 * float(np.max(values))
    told = beside(TIP, np.clip(values, -most, most)).warnings
    assert any("clips" in text for text in told)
    assert not any("clips" in text for text in beside(TIP, values).warnings)


def test_an_unknown_scale_is_one_gain() -> None:
    values, _sizes = recording(TIP, 1, noise=0.05)
    found = beside(TIP, 0.01 * values, scaled=False)
    assert found.gain == pytest.approx(40.0, abs=0.3)
    known = [one.difference for one in found.lines if one.difference is not None]
    assert np.median(known) == pytest.approx(0.0, abs=1e-9)


def test_a_line_that_the_model_has_not_is_told_and_decides_no_gain() -> None:
    """The equal ridges of a comb cancel the odd lines of a grating of 1 mm; a real finger has them."""
    scene: dict[str, Any] = {"texture": {"kind": "grating-1mm-31um"}}
    values, sizes = recording(scene, 3, noise=0.01)
    t = np.arange(len(values)) / RATE
    values += 0.3 * np.sin(2.0 * math.pi * 80.0 * t) + 0.2 * np.sin(2.0 * math.pi * 560.0 * t)
    assert sizes[0] < 1e-9 * np.max(sizes)
    found = beside(scene, 0.05 * values, scaled=False)
    assert found.gain == pytest.approx(26.02, abs=0.1)
    assert any("Lines 1 and 7 are not in the model" in text for text in found.warnings)
    for one in found.lines:
        assert one.difference is None or abs(one.difference) < 0.5


@pytest.mark.parametrize("idle", [1.0, 2.0, 4.0, 8.0])
def test_a_pause_is_told_with_what_it_takes_from_the_levels(idle: float) -> None:
    values, _sizes = recording(TIP, 2, noise=0.05)
    rest = 0.03 * np.std(values) * np.random.default_rng(3).standard_normal(round(idle * RATE))
    found = beside(TIP, np.concatenate([rest[: len(rest) // 2], values, rest[len(rest) // 2 :]]))
    (told,) = (float(text.split("some ")[1].split(" dB")[0]) for text in found.warnings if "dB lower" in text)
    strong = [one.measured for one in beside(TIP, values).lines if one.measured.amplitude > 0.5 * np.std(values)]
    paused = [found.lines[one.number - 1].measured.amplitude for one in strong]
    lower = [20.0 * math.log10(one.amplitude / other) for one, other in zip(strong, paused, strict=True)]
    assert lower and told == pytest.approx(np.mean(lower), abs=0.25)
    assert not beside(TIP, values).warnings
    knock = 10.0 * np.std(values) * np.random.default_rng(4).standard_normal(round(0.1 * RATE))
    assert not any("lower" in text for text in beside(TIP, np.concatenate([knock, values])).warnings)


def test_a_render_is_its_own_model(tmp_path: Any) -> None:
    sound = rw.render(TIP, output={"duration": "2 s", "sample_rate": 8000})
    found = rw.compare(TIP, sound, sound.save(tmp_path / "scan.wav"))
    for one in found:
        assert one.speed == pytest.approx(0.08, rel=1e-3) and one.gain is None
        strongest = max(line.model for line in one.lines if line.measured.found)
        for line in one.lines:
            if line.measured.found and line.model > 0.05 * strongest:
                assert line.difference == pytest.approx(0.0, abs=0.3)
    assert found[0].document()["lines"][0]["number"] == 1


@pytest.mark.parametrize(
    ("change", "word"),
    [({"quantity": "force"}, "displacement"), ({"values": np.zeros(10)}, "256"), ({"rate": 0.0}, "10,000,000")],
)
def test_what_cannot_be_compared_is_refused(change: dict[str, Any], word: str) -> None:
    how: dict[str, Any] = {"values": np.zeros(1000), "rate": 8000.0, "quantity": "velocity"} | change
    with pytest.raises(rw.InvalidRequest, match=word):
        compared(rw.parse_scene(TIP), how["values"], how["rate"], how["quantity"], "x", scaled=True)
