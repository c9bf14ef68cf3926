"""What the skin feels: of pressures whose answer is known, and of scenes along the duplex theory."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.signal import butter, sosfilt

import ridgewave as rw
from synth.perception.half_space import strain_gain, strain_under_probe
from synth.perception.receptors import PC, RA, SA1
from synth.perception.skin import (
    Felt,
    felt_of_lines,
    harmonics_over_phase,
    intensity,
    nothing_felt,
    pattern_felt,
    spatial_variation,
    vibration_felt,
)

PERIOD, LENGTH, PLACES, PHASES = 5e-3, 400e-3, 8000, 64
X = np.linspace(0.0, LENGTH, PLACES, endpoint=False)
THETA = np.arange(PHASES)[:, np.newaxis] / PHASES
ENDS = np.sin(math.pi * X / LENGTH) ** 2  # a pressure that rises slowly: at a sudden end the skin bends
OVER_PLACES = math.sqrt(3.0 / 8.0)  # rms of ENDS


def felt(pressure: Any, fundamental: float = 80.0) -> tuple[Felt, Felt, Felt]:
    """Return what SA1, RA and PC feel of a pressure [phases, places]."""
    series = harmonics_over_phase(pressure, 8)
    ra, pc = vibration_felt(series, LENGTH / PLACES, fundamental)
    return pattern_felt(series, X, PERIOD, fundamental * PERIOD), ra, pc


def test_a_wave_that_passes_vibrates_and_is_a_pattern() -> None:
    p = 1e3
    sa1, ra, pc = felt(p * ENDS * (1.0 + np.cos(2.0 * math.pi * (X / PERIOD - THETA))))
    q = np.array([2.0 * math.pi / PERIOD])
    assert sa1.strain == pytest.approx(0.5 * p * float(strain_gain(q, SA1.depth)[0]), rel=1e-3), "the mean of ENDS"
    assert sa1.frequency == PERIOD
    for one, receptor in ((ra, RA), (pc, PC)):
        amplitude = p * float(strain_gain(q, receptor.depth)[0])
        assert one.frequency == pytest.approx(80.0)
        assert one.strain == pytest.approx(OVER_PLACES * amplitude / math.sqrt(2.0), rel=0.02)
        level = 20.0 * math.log10(math.sqrt(one.power))
        assert one.level == pytest.approx(level, abs=1e-9)


def test_a_pressure_that_swings_as_a_whole_vibrates_without_a_pattern() -> None:
    p = 1e3
    sa1, ra, _pc = felt(p * (1.0 + np.cos(2.0 * math.pi * THETA)) * ENDS)
    uniform = p * float(strain_gain(np.zeros(1), RA.depth)[0])
    assert ra.strain == pytest.approx(OVER_PLACES * uniform / math.sqrt(2.0), rel=0.1)
    assert sa1.strain < 1e-3 * p * float(strain_gain(np.array([2.0 * math.pi / PERIOD]), SA1.depth)[0])


def test_a_pattern_that_stays_is_neither_vibration_nor_a_pattern_of_the_texture() -> None:
    sa1, ra, pc = felt(1e3 * (1.0 + np.cos(2.0 * math.pi * X / PERIOD)) * np.ones((PHASES, 1)))
    assert (ra.level, pc.level, sa1.level) == (None, None, None) or sa1.strain < 1e-12
    assert ra.strain < 1e-15 and pc.strain < 1e-15


def test_thresholds_are_those_of_the_probe_that_measured_them() -> None:
    """The line `fingertip` at 250 Hz and at 3 Hz, and a step of 60 um; see `threshold` and `receptors`."""
    at = np.array([250.0])
    assert PC.threshold(at)[0] / strain_under_probe(PC.depth, 3e-3) == pytest.approx(0.1259e-6, rel=1e-3)
    assert RA.threshold(np.array([3.0]))[0] / strain_under_probe(RA.depth, 3e-3) == pytest.approx(25.12e-6, rel=1e-3)
    assert SA1.threshold(at)[0] / strain_under_probe(SA1.depth, 0.5e-3) == pytest.approx(60e-6)


def test_intensity_is_the_larger_channel_and_half_of_the_smaller() -> None:
    channels = [replace(nothing_felt(one), power=power) for one, power in ((RA, 16.0), (PC, 100.0))]
    assert intensity(channels) == pytest.approx(10.0 + 2.0)


def test_the_spatial_variation_is_the_deviation_of_the_strain_over_places() -> None:
    """Of a pattern with two waves, read from the pressure itself: its strain at the depth of SA1, place by place."""
    waves = ((1, 1e3), (3, 400.0))
    turns = X / PERIOD - THETA
    pressure = 5e3 + sum(p * np.cos(2.0 * math.pi * m * turns) for m, p in waves)
    sa1, *_ = felt(pressure)
    strain = sum(
        p * float(strain_gain(np.array([2.0 * math.pi * m / PERIOD]), SA1.depth)[0])
        * np.cos(2.0 * math.pi * m * X / PERIOD)
        for m, p in waves
    )  # fmt: skip
    assert spatial_variation(sa1) == pytest.approx(float(np.std(strain)) / SA1.threshold(np.zeros(1))[0], rel=1e-6)


@pytest.mark.parametrize("receptor", [SA1, RA, PC], ids=lambda one: one.name)
def test_the_drive_is_the_rate_of_the_strain_behind_a_filter(receptor: Any) -> None:
    """Against the same lines as a waveform, through a Butterworth filter of SciPy far above its rate."""
    rate, lines = 100_000.0, {40.0: 3e-4, 130.0: 1e-4, 520.0: 2e-5}
    t = np.arange(round(rate)) / rate
    wave = sum(size * np.cos(2.0 * math.pi * f * t + f) for f, size in lines.items())
    moved = np.gradient(wave, 1.0 / rate)
    passed = sosfilt(butter(3, receptor.cutoff, fs=rate, output="sos"), moved)[len(t) // 2 :]
    expected = float(np.sqrt(np.mean(passed**2)))
    found = felt_of_lines(receptor, np.array(list(lines)), np.array(list(lines.values())))
    assert found.drive == pytest.approx(expected, rel=2e-3)


def scene(finger: str, period: float, **scan: float) -> dict[str, Any]:
    texture = {"period": period, "amplitude": min(period / 20.0, 20e-6)}
    return {"finger": {"kind": finger}, "texture": texture, "scan": {"speed": 0.08, "load": 0.5, **scan}}


def level(found: dict[str, Any], receptor: str) -> float:
    one = next(one for one in found["receptors"] if one["receptor"] == receptor)
    return -math.inf if one["level"] is None else float(one["level"])


@pytest.mark.parametrize("finger", ["comb", "fingertip"])
def test_fine_textures_are_felt_by_vibration_alone_and_coarse_ones_by_their_pattern_too(finger: str) -> None:
    fine, coarse = (rw.analyze(scene(finger, period)) for period in (0.2e-3, 4e-3))
    assert fine["felt_by"] == "vibration" and level(fine, "SA1") < -60.0
    assert coarse["felt_by"] == "vibration and spatial pattern"
    levels = [level(rw.analyze(scene(finger, period)), "SA1") for period in (0.3e-3, 0.6e-3, 1.2e-3, 2.4e-3)]
    assert levels == sorted(levels)


def test_the_pattern_does_not_depend_on_speed_and_at_rest_only_it_is_felt() -> None:
    slow, fast, still = (rw.analyze(scene("comb", 4e-3, speed=speed)) for speed in (0.02, 0.1, 0.0))
    assert level(slow, "SA1") == pytest.approx(level(fast, "SA1"), abs=1e-4)
    assert level(still, "SA1") == pytest.approx(level(slow, "SA1"), abs=1e-4)
    assert still["felt_by"] == "spatial pattern" and still["whole_finger_level"] is None


def test_both_directions_feel_alike() -> None:
    there, back = (rw.analyze(scene("fingertip", 1.1e-3, speed=speed)) for speed in (0.08, -0.08))
    for receptor in ("SA1", "RA", "PC"):
        assert level(there, receptor) == pytest.approx(level(back, receptor), abs=1e-9)


@pytest.mark.parametrize(
    "change",
    [{"texture": {"kind": "dots"}}, {"effects": {"inertia": {}}}, {"scan": {"stroke": {}}}],
    ids=["area", "simulated", "stroke"],
)
def test_what_cannot_be_analysed_is_refused_in_words(change: dict[str, Any]) -> None:
    with pytest.raises(rw.SceneError, match=r"Write|Choose|Leave"):
        rw.analyze(change)


def test_a_finger_off_the_texture_feels_nothing() -> None:
    assert rw.analyze(scene("comb", 1e-3, load=0.0))["felt_by"] == "nothing"


def test_a_study_records_what_the_skin_feels() -> None:
    found = rw.sweep(scene("comb", 1e-3), {"texture.period": [0.4e-3, 4e-3]}, phases=64, lines=2, skin=True)
    for number, period in enumerate((0.4e-3, 4e-3)):
        document = scene("comb", 1e-3)
        document["texture"]["period"] = period
        known = rw.analyze(document)
        assert found.sa1_level.values[number] == pytest.approx(level(known, "SA1"))
        assert found.intensity.values[number] == pytest.approx(known["intensity"])
    plain = rw.sweep(scene("comb", 1e-3), {"texture.period": [0.4e-3]}, phases=64, lines=2)
    assert np.isnan(plain.sa1_level.values).all()
