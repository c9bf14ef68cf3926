"""What the skin feels of a pressure that a moving texture makes: a vibration at each place, and a spatial pattern.

Model   p(x, theta) is the pressure along the finger, x fixed to the skin, at each phase of a texture period. Its
        harmonics over theta are P_n(x). Over x each is a sum of waves, which reach the depth of a receptor with the
        gain of `half_space`. At a place of the skin harmonic n vibrates at n times the fundamental; its size is the rms
        over the places that are pressed.
        The pattern that moves with the texture is the mean of p over time in the frame of the texture:
            M_m = (1 / L) integral of conj(P_m(x)) e^(-2 pi i m x / period) dx,
        of the wavelength period / m. Speed does not change it.
        Power: the sum over n of (amplitude / threshold)^2. Intensity: the larger of the roots of both powers of
        vibration, and half of the smaller.
Source  Duplex theory: Hollins & Risner (2000). Weighting by 1 / threshold^2: Bensmaia & Hollins (2003). Intensity of
        two channels: Hollins & Roy (1996). The pattern as a wave of the texture is this project's.
Limits  Linear in the pressure, quasi-static, along one line. The level of SA1 is that of the pattern's strongest wave.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.perception.half_space import strain_gain
from synth.perception.receptors import SA1, VIBRATION, Receptor

WINDOW = 4  # times the length of the finger over which waves are taken, so that its ends do not meet
PRESSED = 1e-3  # of the largest mean pressure: places that are pressed less do not count


@dataclass(frozen=True, slots=True)
class Felt:
    """What one class of receptors feels.

    receptor: its name.
    depth: m.
    strain: rms of the strain there, or the amplitude of the strongest wave of the pattern.
    power: sum of (amplitude / threshold)^2.
    level: of the strongest line over its threshold, dB; None where nothing moves.
    frequency: of this line, Hz; of SA1 its wavelength, m.
    """

    receptor: str
    depth: float
    strain: float
    power: float
    level: float | None
    frequency: float


def harmonics_over_phase(pressure: Array, highest: int) -> Any:
    """Return P_0 to P_highest, complex [highest + 1, places]; pressure: Pa [phases, places]."""
    return np.fft.rfft(pressure, axis=0)[: highest + 1] / len(pressure)


def vibration_felt(series: Any, spacing: float, fundamental: float) -> list[Felt]:
    """Return what RA and PC feel.

    series: of `harmonics_over_phase`. spacing: of places, m. fundamental: Hz.
    """
    places = series.shape[1]
    count = 1 << (WINDOW * places - 1).bit_length()
    waves = np.asarray(2.0 * math.pi * np.fft.fftfreq(count, spacing), np.float64)
    pressed = np.abs(series[0]) > PRESSED * np.max(np.abs(series[0]), initial=0.0)
    hertz = np.asarray(fundamental * np.arange(1, len(series)), np.float64)
    return [_vibration(one, series[1:], waves, pressed, hertz) for one in VIBRATION]


def _vibration(receptor: Receptor, series: Any, waves: Array, pressed: Array, hertz: Array) -> Felt:
    if not len(hertz) or not pressed.any() or hertz[0] == 0.0:
        return Felt(receptor.name, receptor.depth, 0.0, 0.0, None, 0.0)
    gain, sizes = strain_gain(waves, receptor.depth), np.zeros(len(hertz))
    for n, one in enumerate(series):  # not all at once: the waves of one take 4 MB
        strain = np.fft.ifft(np.fft.fft(one, len(waves)) * gain)[: len(pressed)][pressed]
        sizes[n] = 2.0 * math.sqrt(float(np.mean(np.abs(strain) ** 2)))
    over = sizes / receptor.threshold(hertz)
    strongest = int(np.argmax(over))
    level = 20.0 * math.log10(float(over[strongest])) if over[strongest] > 0.0 else None
    rms = math.sqrt(0.5 * float(np.sum(sizes**2)))
    return Felt(receptor.name, receptor.depth, rms, float(np.sum(over**2)), level, float(hertz[strongest]))


def pattern_felt(series: Any, places: Array, period: float) -> Felt:
    """Return what SA1 feels of the pattern that moves with the texture.

    series: of `harmonics_over_phase`. places: x, m, at equal distances. period: of the texture, m.
    """
    m = np.arange(1, len(series))
    if not len(m):
        return Felt(SA1.name, SA1.depth, 0.0, 0.0, None, period)
    turned = np.exp(-2j * math.pi * m[:, np.newaxis] * places / period)
    sizes = 2.0 * np.abs(np.mean(np.conj(series[1:]) * turned, axis=1))
    strain = sizes * strain_gain(np.asarray(2.0 * math.pi * m / period, np.float64), SA1.depth)
    over = strain / float(SA1.threshold(np.zeros(1))[0])
    strongest = int(np.argmax(over))
    level = 20.0 * math.log10(float(over[strongest])) if over[strongest] > 0.0 else None
    power = float(np.sum(over**2))
    return Felt(SA1.name, SA1.depth, float(strain[strongest]), power, level, period / float(m[strongest]))


def intensity(felt: list[Felt]) -> float:
    """Return the intensity of vibration, in thresholds: max + min / 2 of the channels (Hollins & Roy, 1996)."""
    sizes = sorted(math.sqrt(one.power) for one in felt)
    return sizes[-1] + 0.5 * sizes[-2]
