"""A profile as a height field that is constant across: the texture under a finger that is turned.

Stage   SURFACES.
Model   h(x, y) = h(x) of the profile.
Limits  Those of the profile.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass

import numpy as np

from synth.surfaces.height_field import HeightField
from synth.surfaces.profile import Array, Bounds, Cosine, Profile

ACROSS = 1e-6  # m: any period across is true; with a short one, one row of heights is stored


@dataclass(frozen=True, eq=False)
class Grooves(HeightField):
    """The heights of `profile`, the same at every y."""

    profile: Profile
    across = ACROSS

    @property
    def key(self) -> Hashable:
        """Everything that decides the heights."""
        return "grooves", self.profile.key

    @property
    def kind(self) -> str:  # type: ignore[override]
        """The kind of the profile."""
        return self.profile.kind

    @property
    def period(self) -> float:  # type: ignore[override]
        """Period along x (m)."""
        return self.profile.period

    def area(self, x: Array, y: Array) -> Array:
        """Return the heights (m) at every pair of `x` and `y` (m)."""
        return np.broadcast_to(self.profile.heights(x), (len(y), len(x)))

    @property
    def slope_across(self) -> float:
        """0: the heights do not vary across."""
        return 0.0

    @property
    def bounds(self) -> Bounds:
        """The bounds of the profile."""
        return self.profile.bounds

    @property
    def rms(self) -> tuple[float, float]:
        """Rq (m) and rms slope of the profile."""
        return self.profile.rms

    def equivalent(self) -> Cosine:
        """Return that of the profile."""
        return self.profile.equivalent()
