"""What a vibration that an actuator gives to the skin makes RA and PC feel: of any recorded or rendered sound.

Model   The power density of the displacement S(f) is that of the sound over (2 pi f)^(2 order). In a third of an octave
        around each of the preferred frequencies 1000 * 10^(n/10) Hz the power over threshold is the sum of 2 S df /
        T(f)^2, with T the peak displacement of a sinusoid that is just felt. Of a single sinusoid that is
        (amplitude / T)^2. The level of a receptor is that of its strongest band; its power is that of all bands. Its
        components are bands that are felt beside the others (`skin`).
Source  Thresholds: `receptors`. Welch (1967): the density. Weighting by 1 / T^2: Bensmaia & Hollins (2003).
Limits  From LOWEST to HIGHEST: below, a drifting sensor would count as motion. The actuator presses the skin as the
        contactors did with which the thresholds were measured. A steady sound: it is a mean over the whole length.
"""

from __future__ import annotations

import math

import numpy as np

from synth.arrays import Array
from synth.perception.half_space import strain_under_probe
from synth.perception.receptors import VIBRATION, Receptor
from synth.perception.skin import Felt, nothing_felt, unmasked
from synth.perception.threshold import MICROMETRE

LOWEST, HIGHEST = 10.0, 1000.0  # Hz
SEGMENT = 2.0  # s, of the density: a third of an octave at LOWEST has four of its steps
OF_RATE = 0.45  # of the sample rate: above, filters of recorders take away


def contactor_felt(values: Array, rate: float, order: int) -> list[Felt]:
    """Return what RA and PC feel.

    values: SI, of at least a tenth of a second. rate: Hz. order: 0 for displacement, 1 velocity, 2 acceleration.
    """
    from scipy.signal import welch

    length = min(len(values), round(SEGMENT * rate))
    hertz, density = welch(values - np.mean(values), rate, nperseg=length)
    kept = (hertz >= LOWEST * 10.0**-0.05) & (hertz <= min(HIGHEST * 10.0**0.05, OF_RATE * rate))
    moved = density[kept] / (2.0 * math.pi * hertz[kept]) ** (2 * order) * (hertz[1] - hertz[0])
    return [_felt(one, hertz[kept], moved) for one in VIBRATION]


def _felt(receptor: Receptor, hertz: Array, moved: Array) -> Felt:
    """Return what one class feels; moved: mean square displacement at each of `hertz`, m^2."""
    threshold = MICROMETRE * 10.0 ** (receptor.level(hertz) / 20.0)
    over = 2.0 * moved / threshold**2
    bands = np.rint(10.0 * np.log10(hertz / HIGHEST)).astype(np.intp)
    power = np.bincount(bands - bands[0], over) if len(bands) else np.zeros(1)
    if not np.any(power > 0.0):
        return nothing_felt(receptor)
    strain = strain_under_probe(receptor.depth, receptor.probe) * np.sqrt(2.0 * moved)
    strongest = int(np.argmax(power))
    inside = np.flatnonzero(bands - bands[0] == strongest)
    centres = HIGHEST * 10.0 ** ((np.arange(len(power)) + bands[0]) / 10.0)
    with np.errstate(divide="ignore"):
        levels = 10.0 * np.log10(power)
    reference = np.asarray(receptor.level(centres), np.float64)
    return Felt(
        receptor.name, receptor.depth, math.sqrt(0.5 * float(np.sum(strain**2))), receptor.drive(hertz, strain),
        float(np.sum(over)), float(levels[strongest]), float(hertz[inside[np.argmax(over[inside])]]),
        unmasked(centres, levels + reference, reference),
    )  # fmt: skip
