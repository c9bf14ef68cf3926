"""The horizontal force of a quasi-static contact, as responses over phase and load: of the slopes, and of friction.

Model   y = max(h - z, 0) with z of eq. 1 at the load w, so w = k N_1; S, T, N_g of `pressure`; p: how far the texture
        has moved under the finger.
        Slope force: the surface is driven against F_s = -(k / L) integral of y h_t'(x) dx = -k S = -w S / N_1. It is
        the change of a potential. At fixed k, Pi(p) = min over z of [(k / 2L) integral of y^2 dx + w z]: the derivative
        of the bracket over z is w - k N_1, which eq. 1 makes zero, so dPi/dp is that of the bracket at fixed z,
        (k / L) integral of y dh/dp dx, and dh/dp = -h_t'. Pi has the period of the texture, so the mean of F_s over a
        period at constant load is exactly zero, and so is the work done.
        Friction: Q = integral of mu p0 (P / p0)^g dA, with P = (k / L^2) y the pressure (a ridge is L long across the
        scan, eq. 4) and dA = L dx, so Q = mu p0 L^2 (k / (L^2 p0))^g N_g. Under a round finger the length that is
        solved is longer than L. With g = 1 it is Coulomb's mu w at every phase;
        otherwise it is modulated at u / lambda2. Its sign is that of the speed, and is given where it is read.
Source  Fagiani & Barbieri (2016), eqs 1, 2, 4. Wandersman et al. (2011), PRL 107:164301, for a law q = beta p^g; the
        slope force is derived here.
Limits  quasi-static, and at constant load. On the polyline of the contact: the error is measured, as that of z is.
        At no load both vanish: F_s like w times a sawtooth (z then follows the crests, whose slope jumps from one to
        the next), so light loads take many phases; Q like w^((1 + g) / 2) where eqs 4-5 hold.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from synth.arrays import Array
from synth.contact.full_contact import FullContact
from synth.contact.load_balance import Contact
from synth.contact.pressure import PressureField
from synth.contact.profile_solver import SegmentGrid
from synth.contact.solvers import PhaseSolver

SLOPE_WORK = 2.5  # cells of the solver that a cell of z and of S costs; fewer would let rows take longer than they may
FRICTION_WORK = 12  # the same of z and N_g
OTHER_LOADS = 2.5  # times as much where the surfaces change with the load: central differences solve two more
SCALE_PHASES = 16  # at which the sensitivity to z is taken: it scales the floor of errors, and needs no digits
LOAD_STEP = 1e-4  # of the load: central differences leave its square; smaller ones would lose digits to rounding
NO_DEPTH = 1e-300  # m: keeps a quotient finite where rounding leaves no contact at all
FEWEST_MEAN, MOST_MEAN = 512, 1 << 16  # phases of a mean over a period; fewer may all miss a narrow dip


@dataclass(frozen=True, slots=True)
class ForceOfContact:
    """What both forces share: all but the value. contact: whose pressure it is, its texture a profile."""

    contact: Contact

    def refined(self) -> Self | None:
        """Return the force on a finer discretisation of its contact; None where there is none."""
        contact = self.contact.refined()
        return None if contact is None else replace(self, contact=contact)

    def solver(self, load: float) -> PhaseSolver:
        """Return what solves the contact at `load` (N)."""
        return self.contact.solver(load)

    def _work_at(self, load: float, cells: float) -> int:
        """Return the work of a phase at `load` (N), in cells of the exact solver; cells: that one of it costs."""
        return round(cells * (1.0 if self.contact.of_one_surface else OTHER_LOADS) * self.contact.work_at(load))

    def _height_scale(self, load: float) -> float:
        """Return a1 + a2 + w / k (m) at `load` (N), to which the rounding of h - z is relative."""
        return self.contact.geometry_at(load).height_scale + load / self.contact.stiffness_at(load)

    def _field(self, load: float) -> PressureField:
        solver = self.contact.solver(load)
        assert isinstance(solver, SegmentGrid), "two cosines are taken as a profile: `Contact.as_profile`"
        return PressureField(solver, self.contact.geometry_at(load).contact_length)


@dataclass(frozen=True, slots=True)
class SlopeForce(ForceOfContact):
    """F_s (N) of a contact: what it takes to drive the texture in the direction in which its phase rises."""

    @property
    def key(self) -> Hashable:
        """What it depends on, for a cache."""
        return "slope force", self.contact.key

    def work_at(self, load: float) -> int:
        """Return the work of a phase at `load` (N), in cells of the exact solver."""
        return self._work_at(load, SLOPE_WORK)

    def closed(self, load: float) -> FullContact | None:
        """Return None: a full contact makes two harmonics, which few phases hold."""
        return None

    def scale_at(self, load: float) -> float:
        """Return a1 + a2 + w / k times the largest dF_s/dz (N) that the touching length allows at `load` (N)."""
        if load <= 0.0:
            return 0.0
        phases, geometry = np.arange(SCALE_PHASES) / SCALE_PHASES, self.contact.geometry_at(load)
        z, _rate = self.contact.approach(phases, load)
        touching = float(np.max(self._field(load).slopes(phases, z).touching))
        return self.contact.stiffness_at(load) * touching * geometry.steepest * self._height_scale(load)

    def approach(self, phases: Array, load: float, guess: Array | None = None) -> tuple[Array, Array]:
        """Return F_s (N) and dF_s/dw at each of `phases` (turns) and `load` (N); `guess` is not needed."""
        if load <= 0.0:
            return np.zeros(len(phases)), np.zeros(len(phases))
        z, rate = self.contact.approach(phases, load)
        sums = self._field(load).slopes(phases, z)
        depth = np.maximum(sums.depth, NO_DEPTH)
        mean = sums.slope / depth
        change = rate * (mean * sums.touching - sums.rise) / depth
        if not self.contact.of_one_surface:
            change = change + _over_load(lambda at: self._mean_slope(phases, z, at), load)
        return -load * mean, -mean - load * change

    def _mean_slope(self, phases: Array, heights: Array, load: float) -> Array:
        """Return S / N_1 with the surfaces at `load` (N), z (m) being given."""
        sums = self._field(load).slopes(phases, heights)
        return sums.slope / np.maximum(sums.depth, NO_DEPTH)


@dataclass(frozen=True, slots=True)
class FrictionForce(ForceOfContact):
    """Q (N) of a contact, at least 0.

    friction_coefficient: mu, at least 0. pressure_exponent: g, above 0. reference_pressure: p0 (Pa), at which the
    friction on an area is mu times the pressure on it.
    """

    friction_coefficient: float
    pressure_exponent: float
    reference_pressure: float

    @property
    def key(self) -> Hashable:
        """What it depends on, for a cache."""
        law = self.friction_coefficient, self.pressure_exponent, self.reference_pressure
        return "friction", self.contact.key, law

    def work_at(self, load: float) -> int:
        """Return the work of a phase at `load` (N), in cells of the exact solver."""
        return self._work_at(load, FRICTION_WORK)

    def closed(self, load: float) -> FullContact | None:
        """Return mu w for g = 1, else None."""
        if self.pressure_exponent != 1.0:
            return None
        return FullContact(self.friction_coefficient * load, 0j, self.friction_coefficient)

    def scale_at(self, load: float) -> float:
        """Return a1 + a2 + w / k times the largest dQ/dz (N) at `load` (N)."""
        if load <= 0.0:
            return 0.0
        phases = np.arange(SCALE_PHASES) / SCALE_PHASES
        z, _rate = self.contact.approach(phases, load)
        steepest = float(np.max(self._at(phases, z, load)[1]))
        return steepest * self._height_scale(load)

    def approach(self, phases: Array, load: float, guess: Array | None = None) -> tuple[Array, Array]:
        """Return Q (N) and dQ/dw at each of `phases` (turns) and `load` (N); `guess` is not needed."""
        if load <= 0.0:
            return np.zeros(len(phases)), np.zeros(len(phases))
        z, rate = self.contact.approach(phases, load)
        force, fall = self._at(phases, z, load)
        if self.contact.of_one_surface:
            rise = _over_load(lambda at: np.log(np.array([self._unit(at) / self._length(at)])), load)
            pressed = float(rise[0]) * force
        else:
            pressed = _over_load(lambda at: self._at(phases, z, at)[0], load)
        return force, pressed - fall * rate

    def mean(self, load: float, tolerance: float = 1e-6) -> float:
        """Return the mean of Q over a period (N) at `load` (N), to `tolerance` of itself.

        Phases are doubled until the mean has moved by less twice, MOST_MEAN of them at most.
        """
        closed = self.closed(load)
        if closed is not None:
            return closed.mean
        count, moved = FEWEST_MEAN, math.inf
        mean = float(np.mean(self.approach(np.arange(count) / count, load)[0]))
        while count < MOST_MEAN:
            between = float(np.mean(self.approach((np.arange(count) + 0.5) / count, load)[0]))
            before, moved, mean = moved, 0.5 * abs(between - mean), 0.5 * (between + mean)
            count *= 2
            if max(moved, before) <= tolerance * mean:
                break
        return mean

    def _at(self, phases: Array, heights: Array, load: float) -> tuple[Array, Array]:
        """Return Q (N) and -dQ/dz (N/m) with surfaces and stiffness at `load` (N), z (m) being given."""
        exponent = self.pressure_exponent
        sums, unit = self._field(load).powers(phases, heights, exponent), self._unit(load)
        return unit * sums.power, unit * exponent * sums.below

    def _length(self, load: float) -> float:
        """Return the length (m) that is solved at `load` (N)."""
        return self.contact.geometry_at(load).contact_length

    def _unit(self, load: float) -> float:
        """Return Q over N_g (N/m^g) at `load` (N)."""
        length, width = self._length(load), self.contact.width_at(load)
        pressed = self.contact.stiffness_at(load) / (length * width * self.reference_pressure)
        unit = self.friction_coefficient * self.reference_pressure * length * width
        return float(unit * pressed**self.pressure_exponent)


def _over_load(value: Callable[[float], Array], load: float) -> Array:
    """Return the derivative of `value` over the load (1/N) at `load` (N), by central differences."""
    step = LOAD_STEP * load
    return (value(load + step) - value(load - step)) / (2.0 * step)


Response = Contact | SlopeForce | FrictionForce
"""What `spectrum` takes a series of, and `table_making` a table: z (m) or a force (N), periodic in the phase."""
