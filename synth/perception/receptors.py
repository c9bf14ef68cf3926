"""The receptors of the skin: how deep they lie, and the strain there that is felt at each frequency.

Model   A threshold is known as the displacement of a probe. The strain that this probe makes at the depth of a receptor
        (`half_space`) is the threshold of the receptor. So the modulus of the skin does not enter it.
        RA and PC respond to vibration, SA1 to the spatial pattern. What drives a class is the rate of the strain,
        behind a Butterworth low-pass of ORDER at its cutoff.
Source  Displacements of RA and PC: the two lines of the threshold `fingertip` (`threshold`), non-Pacinian and Pacinian.
        SA1: a step of 60 um, as quoted for primates (PMC2657072). Depths of RA and PC, ORDER: TouchSim (Saal et al.,
        2017). Cutoffs: the middle of those that TouchSim fits to single afferents, 88 to 102 Hz (SA1), 74 to 180 Hz
        (RA) and 275 to 370 Hz (PC).
        Depth of SA1 (0.7 to 1 mm), radii of the probes: unverified defaults.
Limits  Thresholds of steady sinusoids. The weights of strain, rate and its change, and spikes, are left out.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.perception.half_space import strain_under_probe
from synth.perception.threshold import MICROMETRE, Levels, non_pacinian, pacinian

STEP = 60.0  # um, of SA1
ORDER = 3  # of the low-pass
CONTACTOR, PIN = 3e-3, 0.5e-3  # m, radius of the contactors of vibration and of the pin of a step


def _step(frequency: Any) -> Any:
    return np.full(np.shape(frequency), 20.0 * np.log10(STEP))


@dataclass(frozen=True, slots=True)
class Receptor:
    """One class of receptors.

    depth: m.
    probe: radius (m) of the probe with which its threshold was measured.
    level: function from frequency (Hz) to the threshold of the probe, dB re 1 um.
    cutoff: of its low-pass, Hz.
    """

    name: str
    depth: float
    probe: float
    level: Levels
    cutoff: float

    def threshold(self, frequency: Array) -> Array:
        """Return the smallest strain that is felt at each frequency (Hz)."""
        moved = MICROMETRE * 10.0 ** (self.level(np.maximum(frequency, 1e-9)) / 20.0)
        return np.asarray(strain_under_probe(self.depth, self.probe) * moved)

    def drive(self, frequency: Array, strain: Array) -> float:
        """Return the rms of the rate of the strain behind the low-pass, 1/s.

        frequency: of its lines, Hz. strain: their amplitudes.
        """
        passed = strain / np.sqrt(1.0 + (frequency / self.cutoff) ** (2 * ORDER))
        return float(np.sqrt(0.5 * np.sum((2.0 * np.pi * frequency * passed) ** 2)))


SA1 = Receptor("SA1", 0.7e-3, PIN, _step, 95.0)
RA = Receptor("RA", 1.6e-3, CONTACTOR, non_pacinian, 130.0)
PC = Receptor("PC", 2.0e-3, CONTACTOR, pacinian, 320.0)
VIBRATION = (RA, PC)
