"""The two horizontal forces of a quasi-static contact, of slopes and of friction, as responses over phase and load.

Model   y = max(h - z, 0), with z from eq. 1 at the load w, so w = k N_1. S, T and N_g are the integrals of `pressure`;
        p is the distance that the texture has moved under the finger.

        Slope force: F_s = -(k / L) integral of y h_t'(x) dx = -k S = -w S / N_1 opposes the motion. It is the
        derivative of a potential. At fixed k, Pi(p) = min over z of [(k / 2L) integral of y^2 dx + w z]. The
        derivative of the bracket over z is w - k N_1, which eq. 1 makes zero. So dPi/dp is the derivative of the
        bracket at fixed z, (k / L) integral of y dh/dp dx, with dh/dp = -h_t'. Pi has the period of the texture. So
        at constant load the mean of F_s over a period is exactly zero, and so is the work done.

        Friction: Q = integral of mu p0 (P / p0)^g dA. P = (k / L^2) y is the pressure (a ridge is L long across the
        scan, eq. 4) and dA = L dx, so Q = mu p0 L^2 (k / (L^2 p0))^g N_g. Under a round finger the solved length is
        longer than L. For g = 1, Q is Coulomb's mu w at every phase; otherwise Q is modulated at u / lambda2. The sign
        of the friction is that of the speed; the reader of Q applies it.
Source  Fagiani & Barbieri (2016), eqs 1, 2, 4. Wandersman et al. (2011), PRL 107:164301, for a law q = beta p^g; the
        slope force is derived here.
Limits  Quasi-static, at constant load, on the polyline of the contact. The error is measured, as for z. At no load
        both forces vanish. F_s falls as w times a sawtooth, because z follows the crests and its slope jumps from one
        crest to the next; so light loads require many phases. Q falls as w^((1 + g) / 2) where eqs 4-5 hold.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np

from synth.arrays import Array
from synth.contact.fingertip_solver import FingertipGrid
from synth.contact.load_balance import Contact, FullContact, PhaseSolver
from synth.contact.pressure import power_integrals, slope_integrals
from synth.contact.profile_solver import SegmentGrid

SLOPE_WORK = 2.5  # cost of a cell of z and S, in cells of the solver; a smaller value lets rows exceed their time limit
FRICTION_WORK = 12  # the same for z and N_g
OTHER_LOADS = 2.5  # factor on the cost where the load changes the surfaces: central differences solve two more loads
SCALE_PHASES = 16  # phases at which the sensitivity to z is measured; it only scales the error floor, so few are enough
LOAD_STEP = 1e-4  # of the load: the error of central differences is its square; smaller steps lose digits to rounding
NO_DEPTH = 1e-300  # m: keeps a quotient finite where rounding leaves no contact


@dataclass(frozen=True, slots=True)
class ForceDiscretisation:
    """Base class of forces. Its members mean what they mean for a contact.

    contact: gives z and the pressure.
    """

    contact: Any

    @property
    def settles(self) -> float:
        """The value of its contact."""
        return float(self.contact.settles)

    @property
    def begins(self) -> float:
        """The value of its contact."""
        return float(self.contact.begins)

    @property
    def refines(self) -> bool:
        """The value of its contact."""
        return bool(self.contact.refines)

    def refined(self) -> Self | None:
        """Return the force on a finer discretisation; None where its contact has none."""
        return self._on(self.contact.refined())

    def halved(self) -> Self | None:
        """Return the force on one twice as fine; None where its contact has none."""
        return self._on(self.contact.halved())

    def doubled(self) -> Self | None:
        """Return the force on one half as fine; None where its contact has none."""
        return self._on(self.contact.doubled())

    def _on(self, contact: Any) -> Self | None:
        return None if contact is None else replace(self, contact=contact)


@dataclass(frozen=True, slots=True)
class ForceOfContact(ForceDiscretisation, ABC):
    """Base class of both forces, which differ in the value only.

    contact: the contact that gives the pressure; its texture is a profile.
    """

    work: ClassVar[float]
    contact: Contact

    @property
    @abstractmethod
    def key(self) -> Hashable:
        """Everything that the force depends on, for a cache."""

    @property
    def of_cosines(self) -> bool:
        """False: the texture is a profile here."""
        return False

    @abstractmethod
    def at(self, phases: Array, heights: Array, load: float) -> tuple[Array, Array]:
        """Return the force F (N) and -dF/dz (N/m) at each of `phases` and z (`heights`, m).

        load: N, decides the surfaces and the stiffness.
        """

    @abstractmethod
    def _growth(self, load: float) -> float:
        """Return d log F / dw (1/N) at `load` (N) and fixed z, for surfaces that do not change with the load."""

    @abstractmethod
    def _steepest(self, phases: Array, heights: Array, load: float) -> float:
        """Return the largest dF/dz (N/m) over `phases` and `heights` at `load` (N)."""

    def solver(self, load: float) -> PhaseSolver:
        """Return the solver of the contact at `load` (N)."""
        return self.contact.solver(load)

    def work_at(self, load: float) -> int:
        """Return the work per phase at `load` (N), in cells of the exact solver."""
        return round(self.work * (1.0 if self.contact.of_one_surface else OTHER_LOADS) * self.contact.work_at(load))

    def closed(self, load: float) -> FullContact | None:
        """Return None: in full contact the slope force has two harmonics only, for which a few phases are enough."""
        return None

    def scale_at(self, load: float) -> float:
        """Return the scale of rounding errors at `load` (N): a1 + a2 + w / k, times the largest dF/dz."""
        if load <= 0.0:
            return 0.0
        phases = np.arange(SCALE_PHASES) / SCALE_PHASES
        z, _rate = self.contact.approach(phases, load)
        scale = self.contact.geometry_at(load).height_scale + load / self.contact.stiffness_at(load)
        return self._steepest(phases, z, load) * scale

    def approach(self, phases: Array, load: float, guess: Array | None = None) -> tuple[Array, Array]:
        """Return F (N) and dF/dw at each of `phases` (turns) and `load` (N); `guess` is unused."""
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
        """Return the solved length (m) at `load` (N)."""
        return self.contact.geometry_at(load).contact_length


@dataclass(frozen=True, slots=True)
class SlopeForce(ForceOfContact):
    """F_s (N) of a contact: the force that moves the texture in the direction of rising phase."""

    work = SLOPE_WORK

    @property
    def key(self) -> Hashable:
        """See `ForceOfContact`."""
        return "slope force", self.contact.key

    def at(self, phases: Array, heights: Array, load: float) -> tuple[Array, Array]:
        """See `ForceOfContact`."""
        solver = self.solver(load)
        if isinstance(solver, FingertipGrid):
            found = solver.slope_integrals(self.contact.geometry.texture_period, phases, heights)
        else:
            found = slope_integrals(_polyline(solver), self._length(load), phases, heights)
        slope, rise, depth, touching = found
        depth = np.maximum(depth, NO_DEPTH)
        mean = slope / depth
        return -load * mean, load * (mean * touching - rise) / depth

    def _growth(self, load: float) -> float:
        return 1.0 / load

    def _steepest(self, phases: Array, heights: Array, load: float) -> float:
        """Return a bound from the touching length: the slopes at a few phases may cancel."""
        touching = float(np.max(self.contact.measure(phases, heights, load)[1]))
        return self.contact.stiffness_at(load) * touching * self.contact.geometry_at(load).steepest


@dataclass(frozen=True, slots=True)
class FrictionForce(ForceOfContact):
    """Q (N) of a contact, at least 0.

    friction_coefficient: mu, at least 0.
    pressure_exponent: g, above 0.
    reference_pressure: p0, Pa, the pressure at which the friction per area is mu times the pressure.
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
        power, below = power_integrals(_polyline(self.solver(load)), phases, heights, exponent)
        return unit * power, unit * exponent * below

    def _growth(self, load: float) -> float:
        return float(_over_load(lambda at: np.log(np.array([self._unit(at) / self._length(at)])), load)[0])

    def _steepest(self, phases: Array, heights: Array, load: float) -> float:
        return float(np.max(self.at(phases, heights, load)[1]))

    def _unit(self, load: float) -> float:
        """Return Q / N_g (N/m^g) at `load` (N)."""
        length, width = self._length(load), self.contact.width_at(load)
        pressed = self.contact.stiffness_at(load) / (length * width * self.reference_pressure)
        unit = self.friction_coefficient * self.reference_pressure * length * width
        return float(unit * pressed**self.pressure_exponent)


def _polyline(solver: PhaseSolver) -> SegmentGrid:
    assert isinstance(solver, SegmentGrid), "two cosines must be a profile here: use `Contact.as_profile`"
    return solver


def _over_load(value: Callable[[float], Array], load: float) -> Array:
    """Return the derivative of `value` with respect to the load (1/N) at `load` (N), by central differences."""
    step = LOAD_STEP * load
    return (value(load + step) - value(load - step)) / (2.0 * step)


Response = Contact | SlopeForce | FrictionForce
"""A response, periodic in the phase: z (m) or a force (N). `spectrum` makes its series, `table_making` its table."""
