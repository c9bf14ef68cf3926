"""Measures of experiments, taken from the model's output: lines, root mean square acceleration, power that is felt.

Every measure takes a finger (a section of a scene) and evaluates its steady response. Acceleration, and the
power that is felt, are those of the lines below 1 kHz, where skin feels.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np

from synth.contact.scene_contact import contact_of
from synth.perception.threshold import threshold_displacement
from synth.scene.scene import parse_scene

Real = np.ndarray[Any, np.dtype[np.float64]]
Section = Mapping[str, Any]

BAND = 1000.0  # Hz
PHASES = 128  # of a period of a sinusoid or a grating: the lines of a fingertip are resolved to 1e-3
ROUGH_PHASES = 2048
EVERYDAY_PHASES = 1024  # all lines below BAND at the lowest of EVERYDAY_SPEEDS
PERIODS = np.geomspace(0.1e-3, 5e-3, 40)  # m, of Delhaye et al. (2012) and beyond
FINE = np.geomspace(0.1e-3, 0.5e-3, 10)  # m: the range in which texture is felt by vibration alone
STEP = 1.05  # of a parameter, from one scene to the next
STEPPED = 0.1e-3 * STEP ** np.arange(81)  # m: periods from 0.1 to 5 mm
PLAIN = {"kind": "rough", "period": "20 mm", "hurst": 0.8, "longest": "2 mm"}
EVERYDAY: Mapping[str, Section] = {
    "paper": {**PLAIN, "rms_height": "3 um", "shortest": "0.1 mm"},
    "planed wood": {**PLAIN, "rms_height": "8 um", "shortest": "0.1 mm"},
    "leather": {**PLAIN, "rms_height": "20 um", "shortest": "0.2 mm"},
    "sandpaper": {**PLAIN, "hurst": 0.5, "rms_height": "30 um", "longest": "0.6 mm", "shortest": "0.2 mm"},
    "fine cloth": {"period": "0.4 mm", "amplitude": "15 um"},
    "linen": {"period": "0.8 mm", "amplitude": "40 um"},
    "coarse cloth": {"period": "1.5 mm", "amplitude": "75 um"},
    "corduroy": {"period": "2.5 mm", "amplitude": "150 um"},
    "ribs of a grip": {"kind": "grating", "period": "1 mm", "height": "100 um", "duty": 0.5, "ramp": "0.2 mm"},
}
"""Textures of everyday things. Their periods and heights are general knowledge; none is measured."""
EVERYDAY_LOADS = 0.25, 0.5, 1.0  # N: half and twice the 0.49 N that people use (Smith et al., 2002)
EVERYDAY_SPEEDS = 0.05, 0.09, 0.16  # m/s: half and twice the 86 mm/s that people use (Smith et al., 2002)


def sinusoid(period: float, amplitude: float | None = None) -> Section:
    """Return a sinusoid of `period` (m), by default 3 % of it high and at most 20 um."""
    return {"period": period, "amplitude": min(20e-6, 0.03 * period) if amplitude is None else amplitude}


def lines(finger: Section, texture: Section, load: float = 0.3, phases: int = PHASES) -> tuple[float, Real]:
    """Return the period of the texture (m) and the amplitude (m) of each harmonic of z, from 0 on."""
    return _lines(json.dumps({"finger": finger, "texture": texture, "scan": {"load": load}}), phases)


@cache  # several facts ask for the lines of one scene
def _lines(document: str, phases: int) -> tuple[float, Real]:
    scene = parse_scene(json.loads(document))
    load = scene.scan.load
    z = contact_of(scene).approach(np.arange(phases) / phases, load)[0]
    return scene.texture.period, 2.0 * np.abs(np.fft.rfft(z))[: phases // 2] / phases


def heard(finger: Section, texture: Section, load: float = 0.3, speed: float = 0.08) -> tuple[Real, Real]:
    """Return frequency (Hz) and amplitude (m) of each line below BAND at `load` (N) and `speed` (m/s)."""
    period, found = lines(finger, texture, load)
    if speed / period * len(found) < BAND:  # a long period needs more phases for its lines up to BAND
        period, found = lines(finger, texture, load, ROUGH_PHASES)
    return in_band(period, found, speed)


def in_band(period: float, found: Real, speed: float) -> tuple[Real, Real]:
    """Return frequency (Hz) and amplitude (m) of those lines of `lines` that are below BAND at `speed` (m/s)."""
    frequencies = speed / period * np.arange(len(found))
    kept = (frequencies > 0.0) & (frequencies < BAND)
    return np.asarray(frequencies[kept]), found[kept]


def rms_acceleration(frequencies: Real, found: Real) -> float:
    """Return the root mean square acceleration (m/s^2) of lines, the index of roughness of Cesini et al. (2018)."""
    return float(np.sqrt(0.5 * np.sum(((2.0 * np.pi * frequencies) ** 2 * found) ** 2)))


def pacinian_power(finger: Section, texture: Section) -> float:
    """Return the sum of (line / threshold)^2 in dB (Bensmaia & Hollins, 2003)."""
    frequencies, found = heard(finger, texture)
    return float(10.0 * np.log10(np.sum((found / threshold_displacement(frequencies, "fingertip")) ** 2)))


def strongest_felt(finger: Section, texture: Section, threshold: str = "fingertip") -> tuple[float, float, float]:
    """Return frequency (Hz), amplitude (m) and sensation level (dB over the threshold) of the line that is felt most.

    threshold: a name of `synth.perception.threshold`.
    """
    frequencies, found = heard(finger, texture)
    level = decibels(np.maximum(found, 1e-18) / threshold_displacement(frequencies, threshold))
    most = int(np.argmax(level))
    return float(frequencies[most]), float(found[most]), float(level[most])


def edge_level(finger: Section, height: float) -> float:
    """Return the power of an edge of `height` (m) over the threshold, in dB: up or down every 20 mm, 4 per second."""
    edges = {"kind": "grating", "period": "40 mm", "height": height, "duty": 0.5, "ramp": "0.05 mm"}
    return pacinian_power(finger, edges)


def weakest_fundamental(finger: Section) -> float:
    """Return the smallest ratio (dB) of the line at u / lambda2 to the strongest line, over PERIODS."""
    found = [lines(finger, sinusoid(float(period)))[1][1:] for period in PERIODS]
    return float(min(decibels(max(one[0], 1e-18) / one.max()) for one in found))


def largest_step(finger: Section, what: str, steps: int = 8) -> float:
    """Return the largest change (dB) of the rms acceleration in steps of STEP.

    what: "amplitude", "speed" or "load", of which there are `steps` steps, or "period": all steps of STEPPED.
    """
    if what == "period":
        found = period_accelerations(finger)
    else:
        found = np.array([_varied(finger, what, factor) for factor in STEP ** np.arange(steps + 1)])
    return float(np.max(np.abs(np.diff(decibels(found)))))


def _varied(finger: Section, what: str, factor: float) -> float:
    """Return the rms acceleration (m/s^2) with one value of the setting multiplied by `factor`."""
    texture = sinusoid(0.8e-3, 20e-6 * factor if what == "amplitude" else None)
    load, speed = 0.3 * (factor if what == "load" else 1.0), 0.08 * (factor if what == "speed" else 1.0)
    return rms_acceleration(*heard(finger, texture, load, speed))


def period_accelerations(finger: Section) -> Real:
    """Return the rms acceleration (m/s^2) at each period of STEPPED."""
    return np.array([rms_acceleration(*heard(finger, sinusoid(float(period)))) for period in STEPPED])


def everyday(finger: Section) -> Real:
    """Return the rms acceleration (m/s^2) of each of EVERYDAY, at each of its loads and speeds."""
    found = []
    for texture, load in itertools.product(EVERYDAY.values(), EVERYDAY_LOADS):
        steady = lines(finger, texture, load, EVERYDAY_PHASES)
        found += [rms_acceleration(*in_band(*steady, speed)) for speed in EVERYDAY_SPEEDS]
    return np.array(found)


def rank_correlation(values: Real) -> float:
    """Return the rank correlation of `values` with their order."""
    ranks = np.argsort(np.argsort(values))
    return float(np.corrcoef(ranks, np.arange(len(values)))[0, 1])


def ridge_line(finger: Section, ridge_period: float, seeds: int = 6) -> float:
    """Return by how much (dB) the power near u / lambda1 exceeds that beside it, on random textures."""
    near, beside = [], []
    for seed in range(seeds):
        rough = {"kind": "rough", "period": "40 mm", "hurst": 0.8, "rms_height": "5 um", "seed": seed}
        rough |= {"longest": "10 mm", "shortest": "0.1 mm"}
        period, found = lines(finger, rough, phases=ROUGH_PHASES)
        place = np.arange(len(found)) * ridge_period / period
        power = [
            np.mean(found[(place > low) & (place < high)] ** 2) for low, high in ((0.9, 1.1), (0.6, 0.85), (1.15, 1.5))
        ]
        near.append(power[0])
        beside.append(max(power[1:]))
    return float(10.0 * np.log10(np.mean(near) / np.mean(beside)))


def grating_harmonics(finger: Section) -> tuple[float, float]:
    """Return the strongest line of a grating over its fundamental (dB), and the exponent by which its lines fall."""
    grating = {"kind": "grating", "period": "2 mm", "height": "40 um", "duty": 0.5, "ramp": "0.2 mm"}
    found = lines(finger, grating, phases=512)[1][1:20]
    slope = float(np.polyfit(np.log(np.arange(1, 20)), np.log(np.maximum(found, 1e-18)), 1)[0])
    return float(decibels(found.max() / max(found[0], 1e-18))), slope


def decibels(ratio: Any) -> Any:
    """Return 20 log10 of `ratio`."""
    return 20.0 * np.log10(ratio)
