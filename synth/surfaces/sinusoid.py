"""The sinusoid: the only surface of the paper, for texture and finger alike.

Stage   SURFACES.
Model   h(x) = amplitude cos(2 pi x / period + phase)
Source  Fagiani & Barbieri (2016), eq. 2.
Limits  Exact.
"""

from __future__ import annotations

import math
from collections.abc import Hashable
from dataclasses import dataclass

import numpy as np

from synth.scene.section import Section
from synth.scene.texture_registry import Kind
from synth.surfaces.profile import Array, Bounds, Cosine, Profile


@dataclass(frozen=True, slots=True)
class Sinusoid(Profile):
    """A cosine: amplitude and period in m, phase in rad."""

    amplitude: float
    period: float
    phase: float = 0.0
    kind = "sinusoid"

    @property
    def key(self) -> Hashable:
        """Everything that decides the heights."""
        return self.kind, self.amplitude, self.period, self.phase

    def heights(self, places: Array) -> Array:
        """Return the heights (m) at `places` (m)."""
        turns = np.asarray(places, np.float64) / self.period % 1.0
        return np.asarray(self.amplitude * np.cos(2.0 * math.pi * turns + self.phase))

    @property
    def bounds(self) -> Bounds:
        """Exact bounds."""
        rate = 2.0 * math.pi / self.period
        return Bounds(-self.amplitude, self.amplitude, rate * self.amplitude, rate**2 * self.amplitude)

    @property
    def cosine(self) -> Cosine:
        """Itself."""
        return Cosine(self.amplitude, self.period, self.phase)

    @property
    def rms(self) -> tuple[float, float]:
        """Rq (m) and rms slope."""
        return self.amplitude / math.sqrt(2.0), self.slope_bound / math.sqrt(2.0)

    def equivalent(self) -> Cosine:
        """Return itself, without rounding."""
        return self.cosine


KIND = Kind(
    "sinusoid",
    Section,
    lambda values: Sinusoid(values["amplitude"], values["period"], values["phase"]),
    shared=("period", "amplitude", "roughness"),
    steep="",
    pairs=(("amplitude", "roughness"),),
)
