"""The receptors of the skin: how deep they lie, and the strain there that is felt at each frequency.

Model   A threshold is known as the displacement of a probe. The strain that this probe makes at the depth of a receptor
        (`half_space`) is the threshold of the receptor. So the modulus of the skin does not enter it.
        RA and PC respond to vibration, SA1 to the spatial pattern.
Source  Displacements of RA and PC: the two lines of the threshold `fingertip` (`threshold`), non-Pacinian and Pacinian.
        SA1: a step of 60 um, as quoted for primates (PMC2657072). Depths of RA and PC: TouchSim (Saal et al., 2017).
        Depth of SA1 (0.7 to 1 mm), radii of the probes: unverified defaults.
Limits  Thresholds of steady sinusoids, without masking.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.perception.half_space import strain_under_probe
from synth.perception.threshold import MICROMETRE, Levels, non_pacinian, pacinian

STEP = 60.0  # um, of SA1
CONTACTOR, PIN = 3e-3, 0.5e-3  # m, radius of the contactors of vibration and of the pin of a step


def _step(frequency: Any) -> Any:
    return np.full(np.shape(frequency), 20.0 * np.log10(STEP))


@dataclass(frozen=True, slots=True)
class Receptor:
    """One class of receptors.

    depth: m.
    probe: radius (m) of the probe with which its threshold was measured.
    level: function from frequency (Hz) to the threshold of the probe, dB re 1 um.
    """

    name: str
    depth: float
    probe: float
    level: Levels

    def threshold(self, frequency: Array) -> Array:
        """Return the smallest strain that is felt at each frequency (Hz)."""
        moved = MICROMETRE * 10.0 ** (self.level(np.maximum(frequency, 1e-9)) / 20.0)
        return np.asarray(strain_under_probe(self.depth, self.probe) * moved)


SA1 = Receptor("SA1", 0.7e-3, PIN, _step)
RA = Receptor("RA", 1.6e-3, CONTACTOR, non_pacinian)
PC = Receptor("PC", 2.0e-3, CONTACTOR, pacinian)
VIBRATION = (RA, PC)
