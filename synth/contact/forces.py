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

from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from synth.arrays import Array
from synth.contact.full_contact import FullContact
from synth.contact.load_balance import Contact
from synth.contact.pressure import power_integrals, slope_integrals
from synth.contact.profile_solver import SegmentGrid

SLOPE_WORK = 2.5  # cells of the solver that a cell of z and of S costs; fewer would let rows take longer than they may
FRICTION_WORK = 12  # the same of z and N_g
OTHER_LOADS = 2.5  # times as much where the surfaces change with the load: central differences solve two more
SCALE_PHASES = 16  # at which the sensitivity to z is taken: it scales the floor of errors, and needs no digits
LOAD_STEP = 1e-4  # of the load: central differences leave its square; smaller ones would lose digits to rounding
NO_DEPTH = 1e-300  # m: keeps a quotient finite where rounding leaves no contact at all


@dataclass(frozen=True, slots=True)
class ForceOfContact(ABC):
    """What both forces share: all but the value. contact: whose pressure it is, its texture a profile."""

    work: ClassVar[float]
    contact: Contact

    @property
    @abstractmethod
    def key(self) -> Hashable:
        """What it depends on, for a cache."""

    @abstractmethod
    def at(self, phases: Array, heights: Array, load: float) -> tuple[Array, Array]:
        """Return the force F (N) and -dF/dz (N/m), surfaces and stiffness those of `load` (N), z (m) being given."""

    @abstractmethod
    def _growth(self, load: float) -> float:
        """Return d log F / dw (1/N) at `load` (N) and a given z, where no surface changes with the load."""

    @abstractmethod
    def _steepest(self, phases: Array, heights: Array, load: float) -> float:
        """Return the largest dF/dz (N/m) at places like these, at `load` (N)."""

    def refined(self) -> Self | None:
        """Return the force on a finer discretisation of its contact; None where there is none."""
        contact = self.contact.refined()
        return None if contact is None else replace(self, contact=contact)

    def solver(self, load: float) -> SegmentGrid:
        """Return what solves the contact at `load` (N)."""
        solver = self.contact.solver(load)
        assert isinstance(solver, SegmentGrid), "two cosines are taken as a profile: `Contact.as_profile`"
        return solver

    def work_at(self, load: float) -> int:
        """Return the work of a phase at `load` (N), in cells of the exact solver."""
        return round(self.work * (1.0 if self.contact.of_one_surface else OTHER_LOADS) * self.contact.work_at(load))

    def closed(self, load: float) -> FullContact | None:
        """Return None: a full contact makes two harmonics of the slope force, which few phases hold."""
        return None

    def scale_at(self, load: float) -> float:
        """Return a1 + a2 + w / k, to which the rounding of h - z is relative, times the largest dF/dz at `load` (N)."""
        if load <= 0.0:
            return 0.0
        phases = np.arange(SCALE_PHASES) / SCALE_PHASES
        z, _rate = self.contact.approach(phases, load)
        scale = self.contact.geometry_at(load).height_scale + load / self.contact.stiffness_at(load)
        return self._steepest(phases, z, load) * scale

    def approach(self, phases: Array, load: float, guess: Array | None = None) -> tuple[Array, Array]:
        """Return F (N) and dF/dw at each of `phases` (turns) and `load` (N); `guess` is not needed."""
        if load <= 0.0:
            return np.zeros(len(phases)), np.zeros(len(phases))
        z, rate = self.contact.approach(phases, load)
        force, fall = self.at(phases, z, load)
        if self.contact.of_one_surface:
            pressed = self._growth(load) * force
        else:
            pressed = _over_load(lambda at: self.at(phases, z, at)[0], load)
        return force, pressed - fall * rate

    def _length(self, load: float) -> float:
        """Return the length (m) that is solved at `load` (N)."""
        return self.contact.geometry_at(load).contact_length


@dataclass(frozen=True, slots=True)
class SlopeForce(ForceOfContact):
    """F_s (N) of a contact: what it takes to drive the texture in the direction in which its phase rises."""

    work = SLOPE_WORK

    @property
    def key(self) -> Hashable:
        """See `ForceOfContact`."""
        return "slope force", self.contact.key

    def at(self, phases: Array, heights: Array, load: float) -> tuple[Array, Array]:
        """See `ForceOfContact`."""
        slope, rise, depth, touching = slope_integrals(self.solver(load), self._length(load), phases, heights)
        depth = np.maximum(depth, NO_DEPTH)
        mean = slope / depth
        return -load * mean, load * (mean * touching - rise) / depth

    def _growth(self, load: float) -> float:
        return 1.0 / load

    def _steepest(self, phases: Array, heights: Array, load: float) -> float:
        """Return the most that the touching length allows: the slopes of a few places may cancel."""
        touching = float(np.max(self.contact.measure(phases, heights, load)[1]))
        return self.contact.stiffness_at(load) * touching * self.contact.geometry_at(load).steepest


@dataclass(frozen=True, slots=True)
class FrictionForce(ForceOfContact):
    """Q (N) of a contact, at least 0.

    friction_coefficient: mu, at least 0. pressure_exponent: g, above 0. reference_pressure: p0 (Pa), at which the
    friction on an area is mu times the pressure on it.
    """

    work = FRICTION_WORK
    friction_coefficient: float
    pressure_exponent: float
    reference_pressure: float

    @property
    def key(self) -> Hashable:
        """See `ForceOfContact`."""
        law = self.friction_coefficient, self.pressure_exponent, self.reference_pressure
        return "friction", self.contact.key, law

    def closed(self, load: float) -> FullContact | None:
        """Return mu w for g = 1, else None."""
        if self.pressure_exponent != 1.0:
            return None
        return FullContact(self.friction_coefficient * load, 0j, self.friction_coefficient)

    def at(self, phases: Array, heights: Array, load: float) -> tuple[Array, Array]:
        """See `ForceOfContact`."""
        exponent, unit = self.pressure_exponent, self._unit(load)
        power, below = power_integrals(self.solver(load), phases, heights, exponent)
        return unit * power, unit * exponent * below

    def _growth(self, load: float) -> float:
        return float(_over_load(lambda at: np.log(np.array([self._unit(at) / self._length(at)])), load)[0])

    def _steepest(self, phases: Array, heights: Array, load: float) -> float:
        return float(np.max(self.at(phases, heights, load)[1]))

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
