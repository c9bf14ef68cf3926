"""What the skin feels of a pressure that a moving texture makes: a vibration at each place, and a spatial pattern.

Model   p(x, theta) is the pressure along the finger, x fixed to the skin, at each phase of a texture period. Its
        harmonics over theta are P_n(x). Over x each is a sum of waves, which reach the depth of a receptor with the
        gain of `half_space`. At a place of the skin harmonic n vibrates at n times the fundamental; its size is the rms
        over the places that are pressed.
        The pattern that moves with the texture is the mean of p over time in the frame of the texture:
            M_m = (1 / L) integral of conj(P_m(x)) e^(-2 pi i m x / period) dx,
        of the wavelength period / m. Speed does not change it.
        Power: the sum over n of (amplitude / threshold)^2. Intensity: the larger of the roots of both powers of
        vibration, and half of the smaller. Spatial variation: the standard deviation of the pattern over places.
        Masking: a component of the level H (dB) at f0 (Hz) raises the threshold at f to
            H - 5 + 5 / 1400 f0 - 30 ((f - f0) / f0)^2.
        The powers of the threshold and of the masks of all other components add up. A component is felt if it is above
        the sum. Components more than RANGE below the strongest one mask nothing.
Source  Duplex theory: Hollins & Risner (2000). Weighting by 1 / threshold^2: Bensmaia & Hollins (2003). Intensity of
        two channels: Hollins & Roy (1996). Variation between SA1 as the roughness of coarse textures: Connor & Johnson
        (1992). The pattern as a wave of the texture is this project's. Masking and RANGE: the psychohaptic model of the
        MPEG haptics reference software (ISO/IEC 23090-31).
Limits  Linear in the pressure, quasi-static, along one line. The level of SA1 is that of the pattern's strongest wave.
        Levels of the model of masking are those of a digital signal; here they are displacements, as of the thresholds.
        A component does not mask itself. One channel does not mask another.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.perception.half_space import strain_gain
from synth.perception.receptors import SA1, VIBRATION, Receptor
from synth.perception.threshold import FAINTEST_DB

RANGE = 45.0  # dB
BELOW, RISE, FALL = 5.0, 5.0 / 1400.0, 30.0  # dB; dB/Hz; dB for a distance of f0
MOST = 4096  # strongest components that are looked at, which bounds the time
WINDOW = 4  # times the length of the finger over which waves are taken, so that its ends do not meet
FAINTEST = 10.0 ** (FAINTEST_DB / 20.0)  # of the threshold
PRESSED = 1e-3  # of the largest mean pressure: places that are pressed less do not count


def mask_of(level: Array, masker: Array, frequency: Array) -> Array:
    """Return the raised threshold (dB) at each frequency [frequencies, maskers] by each masker.

    level: of the maskers, dB. masker: their frequencies, Hz. frequency: Hz.
    """
    away = (np.asarray(frequency)[:, np.newaxis] - masker) / masker
    return np.asarray(level - BELOW + RISE * masker - FALL * away**2)


def unmasked(frequency: Array, level: Array, threshold: Array) -> int:
    """Return how many components are felt.

    frequency: Hz, above 0. level, threshold: dB of the same reference.
    """
    strong = np.flatnonzero(level > threshold)
    if not len(strong):
        return 0
    strong = strong[np.argsort(level[strong])[::-1][:MOST]]
    f, h = frequency[strong], level[strong]
    maskers = np.flatnonzero(h >= h[0] - RANGE)
    masks = mask_of(h[maskers], f[maskers], f)
    masks[maskers, np.arange(len(maskers))] = -np.inf  # not of itself
    raised = 10.0 ** (threshold[strong] / 10.0) + np.sum(10.0 ** (masks / 10.0), axis=1)
    return int(np.count_nonzero(h > 10.0 * np.log10(raised)))


@dataclass(frozen=True, slots=True)
class Felt:
    """What one class of receptors feels.

    receptor: its name.
    depth: m.
    strain: rms of the strain there, or the amplitude of the strongest wave of the pattern.
    drive: rms of the rate of the strain behind the low-pass of the class, 1/s.
    power: sum of (amplitude / threshold)^2.
    level: of the strongest line over its threshold, dB; None where nothing moves.
    frequency: of this line, Hz; of SA1 its wavelength, m.
    components: number of lines that are felt beside the others; of SA1 waves over the threshold.
    """

    receptor: str
    depth: float
    strain: float
    drive: float
    power: float
    level: float | None
    frequency: float
    components: int


def nothing_felt(receptor: Receptor, frequency: float = 0.0) -> Felt:
    """Return what a class feels where nothing moves."""
    return Felt(receptor.name, receptor.depth, 0.0, 0.0, 0.0, None, frequency, 0)


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
        return nothing_felt(receptor)
    gain, sizes = strain_gain(waves, receptor.depth), np.zeros(len(hertz))
    for n, one in enumerate(series):  # not all at once: the waves of one take 4 MB
        strain = np.fft.ifft(np.fft.fft(one, len(waves)) * gain)[: len(pressed)][pressed]
        sizes[n] = 2.0 * math.sqrt(float(np.mean(np.abs(strain) ** 2)))
    return felt_of_lines(receptor, hertz, sizes)


def felt_of_lines(receptor: Receptor, hertz: Array, sizes: Array) -> Felt:
    """Return what one class feels of lines at `hertz` with the amplitudes `sizes` of the strain."""
    over = sizes / receptor.threshold(hertz)
    strongest = int(np.argmax(over))
    if over[strongest] < FAINTEST:
        return nothing_felt(receptor)
    with np.errstate(divide="ignore"):
        level = 20.0 * np.log10(over)
    rms = math.sqrt(0.5 * float(np.sum(sizes**2)))
    threshold = np.asarray(receptor.level(hertz), np.float64)
    return Felt(
        receptor.name, receptor.depth, rms, receptor.drive(hertz, sizes), float(np.sum(over**2)),
        float(level[strongest]), float(hertz[strongest]), unmasked(hertz, level + threshold, threshold),
    )  # fmt: skip


def pattern_felt(series: Any, places: Array, period: float, speed: float) -> Felt:
    """Return what SA1 feels of the pattern that moves with the texture.

    series: of `harmonics_over_phase`. places: x, m, at equal distances. period: of the texture, m. speed: m/s.
    """
    m = np.arange(1, len(series))
    if not len(m):
        return nothing_felt(SA1, period)
    turned = np.exp(-2j * math.pi * m[:, np.newaxis] * places / period)
    sizes = 2.0 * np.abs(np.mean(np.conj(series[1:]) * turned, axis=1))
    strain = sizes * strain_gain(np.asarray(2.0 * math.pi * m / period, np.float64), SA1.depth)
    over = strain / float(SA1.threshold(np.zeros(1))[0])
    strongest = int(np.argmax(over))
    if over[strongest] < FAINTEST:
        return nothing_felt(SA1, period)
    level = 20.0 * math.log10(float(over[strongest]))
    drive = SA1.drive(np.asarray(m * (speed / period), np.float64), strain)
    return Felt(
        SA1.name, SA1.depth, float(strain[strongest]), drive, float(np.sum(over**2)), level,
        period / float(m[strongest]), int(np.count_nonzero(over > 1.0)),
    )  # fmt: skip


def spatial_variation(pattern: Felt) -> float:
    """Return the standard deviation over places of the pattern that SA1 feels, in thresholds."""
    return math.sqrt(0.5 * pattern.power)


def intensity(felt: list[Felt]) -> float:
    """Return the intensity of vibration, in thresholds: max + min / 2 of the channels (Hollins & Roy, 1996)."""
    sizes = sorted(math.sqrt(one.power) for one in felt)
    return sizes[-1] + 0.5 * sizes[-2]
