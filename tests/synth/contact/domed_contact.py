"""A domed contact for tests: its length grows with the load about its middle, and z comes from Newton on `pressure`."""

from __future__ import annotations

import math
from collections.abc import Hashable
from dataclasses import dataclass
from typing import cast

import numpy as np

from synth.arrays import Array
from synth.contact.exact_solver import Grid
from synth.contact.full_contact import FullContact
from synth.contact.geometry import Geometry
from synth.contact.load_balance import Contact
from synth.contact.pressure import PressureField
from synth.contact.solvers import PhaseSolver

STEP = 1e-5  # of the load, for the difference that gives dz/dw


@dataclass(frozen=True)
class DomedContact:
    """What a force asks of a contact. surfaces: at 1 N. growth: the power of the load by which L grows."""

    surfaces: Geometry
    dome: float
    stiffness: float
    growth: float = 0.0

    of_one_shape = False

    @property
    def key(self) -> Hashable:
        return self

    def work_at(self, load: float) -> int:
        return PressureField.of_geometry(self.surfaces).cells

    def geometry_at(self, load: float) -> Geometry:
        one = self.surfaces
        length = one.contact_length * load**self.growth
        moved = math.pi * (length - one.contact_length)
        return Geometry(
            one.ridge_amplitude, one.ridge_period, one.texture_amplitude, one.texture_period,
            one.texture_phase - moved / one.texture_period, length, one.ridge_phase - moved / one.ridge_period,
        )  # fmt: skip

    def stiffness_at(self, load: float) -> float:
        return self.stiffness / math.sqrt(load)

    def scale_at(self, load: float) -> float:
        return self.surfaces.height_scale

    def closed(self, load: float) -> FullContact | None:
        return None

    def refined(self) -> None:
        """Return None: its solver is exact."""
        return None

    def solver(self, load: float) -> PhaseSolver:
        return Grid.of_geometry(self.geometry_at(load))

    def heights(self, phases: Array, load: float, begin: Array | None = None) -> Array:
        """Return z (m) at each phase (turns): Newton from below, which never passes it, or from `begin`."""
        geometry = self.geometry_at(load)
        field, depth = PressureField.of_geometry(geometry, self.dome), load / self.stiffness_at(load)
        tall = geometry.height_scale + abs(self.dome) * geometry.contact_length**2 / 8 + depth
        z = np.full(len(phases), -tall) if begin is None else begin
        for _ in range(100):
            sums = field.slopes(phases, z)
            step = (sums.depth - depth) / np.maximum(sums.touching, 1e-12)
            z = z + step
            if np.max(np.abs(step)) <= 1e-15 * tall:
                break
        return z

    def approach(self, phases: Array, load: float, guess: Array | None = None) -> tuple[Array, Array]:
        step, z = STEP * load, self.heights(phases, load)
        rate = (self.heights(phases, load + step, z) - self.heights(phases, load - step, z)) / (2 * step)
        return z, rate


def domed(surfaces: Geometry, dome: float, stiffness: float, growth: float = 0.0) -> Contact:
    """Return it as a contact: it has all that a force asks for."""
    return cast(Contact, DomedContact(surfaces, dome, stiffness, growth))
