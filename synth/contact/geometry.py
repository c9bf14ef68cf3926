"""The two surfaces in contact, in the units of the solver.

Model   h(x) = a2 cos(2 pi (x - p) / lambda2 + phi) - a1 cos(2 pi x / lambda1 + psi), 0 <= x <= L. p is the distance
        that the texture has moved under the finger, and theta = p / lambda2 its phase in turns. psi is 0 in eq. 2; it
        is the phase of the ridges where a contact does not begin at the end of the finger's nominal length.
        For a texture that is not a sinusoid, its profile h2(x - p) replaces the first cosine.
Source  Fagiani & Barbieri (2016), eq. 2. a1, lambda1: finger ridges; a2, lambda2, phi: texture; L: contact length.
        An amplitude that is given as a roughness follows from eq. 3, in `scene_surfaces`.
Limits  The finger is a single cosine along the scanning direction.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from synth.scene.finger_section import Finger
from synth.scene.scene import Scene
from synth.surfaces import profile_of
from synth.surfaces.profile import Profile
from synth.surfaces.sinusoid import Sinusoid


@dataclass(frozen=True, slots=True)
class Geometry:
    """Finger and texture as numbers: lengths in metres, phases in radians.

    profile: heights of the texture; None: the texture is one cosine. With a profile, texture_amplitude is half its
        extent. texture_phase then only shifts it, and is 0 where the contact begins at the end of the finger's nominal
        length.
    segments: per period of the polyline that replaces the profile (`profile_solver`); None: the solver's first choice.
    """

    ridge_amplitude: float
    ridge_period: float
    texture_amplitude: float
    texture_period: float
    texture_phase: float
    contact_length: float
    ridge_phase: float = 0.0
    profile: Profile | None = None
    segments: int | None = None

    @classmethod
    def of_scene(cls, scene: Scene) -> Geometry:
        """Return the geometry of `scene`."""
        return cls.of_surfaces(scene.finger, profile_of(scene))

    @classmethod
    def of_surfaces(cls, finger: Finger, profile: Profile) -> Geometry:
        """Return the geometry of `finger` on a texture of `profile`."""
        cosine = profile.cosine
        return cls(
            ridge_amplitude=finger.ridge_amplitude,
            ridge_period=finger.ridge_period,
            texture_amplitude=0.5 * (profile.extent[1] - profile.extent[0]) if cosine is None else cosine.amplitude,
            texture_period=profile.period,
            texture_phase=0.0 if cosine is None else cosine.phase,
            contact_length=finger.contact_length,
            profile=profile if cosine is None else None,
        )

    def as_profile(self) -> Geometry:
        """Return the same surfaces with the texture as a profile, which `profile_solver` requires."""
        if self.profile is not None:
            return self
        cosine = Sinusoid(self.texture_amplitude, self.texture_period, self.texture_phase)
        return replace(self, profile=cosine, texture_phase=0.0)

    @property
    def over_area(self) -> bool:
        """Whether the texture is a height field."""
        return self.profile is not None and self.profile.of_area

    @property
    def height_scale(self) -> float:
        """a1 + a2 in metres: the scale to which every error of the contact is relative."""
        return self.ridge_amplitude + self.texture_amplitude

    @property
    def extent(self) -> tuple[float, float]:
        """Lowest and highest possible h (m)."""
        if self.profile is None:
            return -self.height_scale, self.height_scale
        lowest, highest = self.profile.extent
        return lowest - self.ridge_amplitude, highest + self.ridge_amplitude

    @property
    def equivalent(self) -> tuple[float, float]:
        """Amplitude and period (m) of the sinusoid with the texture's Rq and rms slope; eqs 4-7 use them."""
        if self.profile is None:
            return self.texture_amplitude, self.texture_period
        equal = self.profile.equivalent()
        return equal.amplitude, equal.period

    @property
    def steepest(self) -> float:
        """A bound of the texture's slope; a step counts as a slope over a thousandth of the period."""
        if self.profile is None:
            return 2.0 * math.pi * self.texture_amplitude / self.texture_period
        return min(self.profile.slope_bound, 2e3 * self.texture_amplitude / self.texture_period)

    @property
    def ridges(self) -> float:
        """L / lambda1 (tau): number of finger ridges in the contact."""
        return self.contact_length / self.ridge_period

    @property
    def texture_periods(self) -> float:
        """L / lambda2: number of texture periods in the contact."""
        return self.contact_length / self.texture_period

    def part(self, begin: float, length: float) -> Geometry:
        """Return the same surfaces over `length` (m), from x = `begin` (m, may be negative).

        Whole periods before `begin` are subtracted without rounding.
        """
        ridge_turns = math.remainder(begin, self.ridge_period) / self.ridge_period
        texture_turns = math.remainder(begin, self.texture_period) / self.texture_period
        return replace(
            self,
            contact_length=length,
            ridge_phase=self.ridge_phase + 2.0 * math.pi * ridge_turns,
            texture_phase=self.texture_phase + 2.0 * math.pi * texture_turns,
        )

    def texture(self, places: Any) -> Any:
        """Return the heights (m) of the texture at `places` (m, any shape) along it."""
        turns = places / self.texture_period % 1.0
        if self.profile is not None:
            return self.profile.heights((turns + self.texture_phase / (2.0 * math.pi)) * self.texture_period)
        return self.texture_amplitude * np.cos(2.0 * math.pi * turns + self.texture_phase)

    def finger(self, places: Any) -> Any:
        """Return the contribution of the ridges to h (m) at x = `places` (m, any shape)."""
        ridges = 2.0 * math.pi * (places / self.ridge_period % 1.0) + self.ridge_phase
        return -self.ridge_amplitude * np.cos(ridges)

    def heights(self, places: Any, phases: Any) -> Any:
        """Return h (m) at x = `places` (m) and `phases` (turns of the texture period)."""
        return self.texture(places - phases * self.texture_period) + self.finger(places)
