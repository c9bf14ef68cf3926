"""What is felt of recorded vibrations, against thresholds in closed form."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import soundfile

import ridgewave as rw
from synth.perception.threshold import non_pacinian, pacinian, threshold_displacement
from tests.conftest import RunsRidgewave

RATE = 12000.0


def tone(frequency: float, amplitude: float, seconds: float = 3.0, order: int = 0) -> Any:
    """Return samples of a displacement `amplitude` (m), or of its derivative of `order`."""
    t = np.arange(round(seconds * RATE)) / RATE
    size = amplitude * (2.0 * np.pi * frequency) ** order
    return size * np.cos(2.0 * np.pi * frequency * t + 0.3 + 0.5 * order * np.pi)


@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize("frequency", [10.0, 23.7, 160.0, 250.0, 611.0, 1000.0])
def test_a_tone_has_its_level_over_the_threshold(frequency: float, order: int) -> None:
    quantity = ("displacement", "velocity", "acceleration")[order]
    found = rw.analyze(tone(frequency, 3e-6, order=order), quantity=quantity, rate=RATE)
    expected = 20.0 * math.log10(3e-6 / float(threshold_displacement(np.array([frequency]))[0]))
    assert found["whole_finger_level"] == pytest.approx(expected, abs=0.5)
    lines = {"RA": non_pacinian, "PC": pacinian}
    for one in found["receptors"]:
        level = 20.0 * math.log10(3.0) - float(lines[one["receptor"]](np.array([frequency]))[0])
        assert one["level"] == pytest.approx(level, abs=0.5)
        assert one["frequency"] == pytest.approx(frequency, abs=0.6)
    sizes = sorted(math.sqrt(one["power"]) for one in found["receptors"])
    assert found["intensity"] == pytest.approx(sizes[1] + 0.5 * sizes[0])
    assert found["felt_by"] == ("vibration" if found["whole_finger_level"] > 0 else "nothing")


def test_noise_has_the_power_of_its_density_over_the_threshold() -> None:
    noise = np.random.default_rng(3).normal(size=round(60 * RATE)) * 2.0  # m/s^2, 0 to 6 kHz
    found = rw.analyze(noise, quantity="acceleration", rate=RATE)
    f = np.arange(9.0, 1122.0, 0.05)
    over = 2.0 * (4.0 / (RATE / 2)) / ((2 * np.pi * f) ** 2 * 1e-6 * 10 ** (pacinian(f) / 20.0)) ** 2
    assert found["pacinian_power"] == pytest.approx(float(np.sum(over) * 0.05), rel=0.03)


def test_two_tones_add_their_powers_and_a_silent_sound_is_not_felt() -> None:
    one, other = (rw.analyze(tone(f, 1e-6), quantity="displacement", rate=RATE) for f in (100.0, 250.0))
    both = rw.analyze(tone(100.0, 1e-6) + tone(250.0, 1e-6), quantity="displacement", rate=RATE)
    assert both["pacinian_power"] == pytest.approx(one["pacinian_power"] + other["pacinian_power"], rel=1e-2)
    silent = rw.analyze(np.full(20_000, 0.3), quantity="acceleration", rate=RATE)
    assert (silent["whole_finger_level"], silent["felt_by"], silent["intensity"]) == (None, "nothing", 0.0)


def test_a_pause_is_told() -> None:
    tone = np.sin(2.0 * np.pi * 200.0 * np.arange(8000) / 4000.0)
    whole, paused = (
        rw.analyze(values, quantity="acceleration", rate=4000.0) for values in (tone, np.append(tone, np.zeros(2000)))
    )
    assert whole["warnings"] == [] and "20 % of the recording is quieter" in paused["warnings"][0]


@pytest.mark.parametrize("frequency", [12.0, 20.0, 200.0])
@pytest.mark.parametrize("step", [0.0, 2.0**-15, 1e-3])
def test_a_sensor_that_clips_is_told_and_a_round_top_of_a_slow_wave_is_not(frequency: float, step: float) -> None:
    """step: of the converter; 0: none."""
    wave = 0.8 * np.sin(2.0 * np.pi * frequency * np.arange(96_000) / 48_000.0)
    for limit, told in ((1.0, 0), (0.7, 2), (0.4, 2)):
        values = np.clip(wave, -limit, limit)
        values = np.round(values / step) * step if step else values
        found = rw.analyze(values, quantity="acceleration", rate=48_000.0)
        assert len([text for text in found["warnings"] if "clips" in text]) == told, limit
    one_sided = rw.analyze(np.minimum(wave, 0.5), quantity="acceleration", rate=48_000.0)
    assert any("clips at 0.5, " in text for text in one_sided["warnings"])


def test_a_recording_that_is_strongest_at_the_mains_is_doubted() -> None:
    t = np.arange(3 * 8000) / 8000.0
    felt = np.sin(2.0 * np.pi * 170.0 * t)
    for hum, told in ((0.0, 0), (20.0, 1)):
        found = rw.analyze(felt + hum * np.sin(2.0 * np.pi * 50.0 * t), quantity="acceleration", rate=8000.0)
        assert len([text for text in found["warnings"] if "hum of the mains" in text]) == told


def test_a_rendered_scene_feels_as_its_whole_finger() -> None:
    scene: dict[str, Any] = {"texture": {"period": "0.5 mm"}, "scan": {"load": 0.4}}
    expected = rw.analyze(scene)["whole_finger_level"]
    for quantity in ("displacement", "acceleration"):
        sound = rw.render(scene, output={"duration": "4 s", "quantity": quantity})
        assert rw.analyze(sound)["whole_finger_level"] == pytest.approx(expected, abs=0.5)


def test_the_command_reads_files_of_every_kind(ridgewave: RunsRidgewave, tmp_path: Path) -> None:
    values = tone(200.0, 2e-6, order=2)
    soundfile.write(tmp_path / "scan.wav", values / 98.1, round(RATE), subtype="FLOAT")
    times = np.arange(len(values)) / RATE
    np.savetxt(tmp_path / "scan.csv", np.column_stack([times, values]), "%.17g", ",", header="t,az", comments="")
    rw.render({}, output={"duration": "1 s"}).save(tmp_path / "own.wav")
    told = ("--quantity", "acceleration", "--json", "--scale")
    wav, csv = (
        json.loads(ridgewave("analyze", str(tmp_path / name), *told, scale).stdout)
        for name, scale in (("scan.wav", "98.1"), ("scan.csv", "1"))
    )
    assert wav["whole_finger_level"] == pytest.approx(csv["whole_finger_level"], abs=1e-3)
    expected = 20 * math.log10(2.0) - float(pacinian(np.array([200.0]))[0])
    assert wav["whole_finger_level"] == pytest.approx(expected, abs=0.5)
    assert b"thresholds" in ridgewave("analyze", str(tmp_path / "own.wav")).stdout


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--quantity", "acceleration"), b"scale"),
        (("--scale", "1"), b"quantity"),
        (("--scale", "1", "--quantity", "force"), b"force"),
        (("--scale", "1", "--quantity", "velocity", "--channel", "2"), b"channel"),
        (("--scale", "1", "--quantity", "velocity", "--set", "scan.speed=1"), b"--set"),
    ],
)
def test_what_is_not_known_is_asked_for(
    words: tuple[str, ...], message: bytes, ridgewave: RunsRidgewave, tmp_path: Path
) -> None:
    soundfile.write(tmp_path / "scan.wav", tone(200.0, 0.1), round(RATE))
    done = ridgewave("analyze", str(tmp_path / "scan.wav"), *words)
    assert done.returncode == 2 and message in done.stderr and b"Traceback" not in done.stderr


def test_short_slow_and_broken_arrays_are_refused() -> None:
    broken = [
        (np.zeros(100), RATE), (np.full(9999, np.nan), RATE), (np.zeros((9999, 2)), RATE), (np.zeros(9999), 5.0),
    ]  # fmt: skip
    for values, rate in broken:
        with pytest.raises(rw.InvalidRequest):
            rw.analyze(values, quantity="velocity", rate=rate)
    with pytest.raises(rw.InvalidRequest, match="rate"):
        rw.analyze(np.zeros(9999), quantity="velocity")
