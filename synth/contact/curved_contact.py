"""The contact of a round fingertip: it has no edges, and the pressure falls to zero where the finger lifts off.

Model   The finger is a parabola d below its ridges, about the middle xc of the nominal contact. z solves

            F(z) = integral of max(h - d - z, 0) dx = w / kappa,   d = (x - xc)^2 / (2 R)

        kappa(w) = k(w, L) / L is the foundation modulus (Pa/m). k follows from eqs 4-5 at the length L = 2 b that a
        smooth round finger touches on the same foundation: w = (2/3) kappa b^3 / R. Since kappa = C L^2 w^-1/2,
        b^5 = 3 R w^(3/2) / (8 C). So L grows as w^0.3, kappa as w^0.1 and w / kappa as w^0.9. Over the length |C| that
        touches, dz/dw = -0.9 (w / kappa) / (w |C|).
        Where the scene gives the stiffness, kappa = k / L0 at every load, b^3 = 3 R w / (2 kappa), and 1 replaces 0.9.
        The solver spans a length D about xc, with no pressure at its ends at any phase. D / 2 is
        sqrt(2 R (a1 + a2 - z0)), where z never falls below z0 (`lowest_approach`). The reaction is kappa D times the
        solver's mean over D. That integral is the same over any longer D, so the D of a heavy load serves all lighter
        ones (`over_loads`), and only kappa depends on the load. Attraction pulls z below z0 and reaches across gaps;
        D / 2 is then sqrt(2 R (a1 + a2 - z0 + both)).
Source  Johnson, Contact Mechanics (1985), sec. 4.3 (Winkler foundation, parabola); Fagiani & Barbieri (2016), eqs 1, 2,
        4, 5; the rest is derived here.
Limits  As for `profile_solver`. Where z is below z0 (a finger thrown onto the surface harder than its load), `measure`
        leaves out the pressure beyond D. At no load, kappa and the stiffness are 0.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.contact.geometry import Geometry
from synth.contact.load_balance import Contact, PhaseSolver, solver_of
from synth.contact.profile_solver import SegmentGrid
from synth.contact.stiffness import Stiffness
from synth.errors import Fault, SceneError
from synth.response_cache import kept

USUAL_LOAD = 8.0  # N: loads up to it share one polyline, so z does not depend on the other loads of the same call
LONGEST_SPAN = 0.2  # m: longer than any hand; the work per phase is proportional to it
WINDOWS = 24  # numbers of crests, and of widths about each, that `lowest_approach` tries; fewer give a longer span
SLACK = 1e-9  # of a1 + a2, subtracted from z0: more than the rounding error of the bound


def lowest_approach(geometry: Geometry, radius: float, area: float) -> float:
    """Return a height (m) below which z does not fall at any phase.

    radius: of the finger, m.
    area: F, m^2, the integral that z has to give.

    F(z) is at least the integral of h - d - z over any set A of windows, so z >= (mean of h - d over A) - F / |A|. A is
    either one window about the middle, or one window about each of n neighbouring crests of the ridges or of the
    texture. The middle crest lies within half a period of xc. In windows on crests the mean height of that surface is
    its amplitude times the sinc of the width. The other surface takes off at most sin(n pi r) / (n sin(pi r)) of its
    amplitude, where r is the ratio of the periods. For a texture that is not a sinusoid, the windows lie on the
    crests of the ridges only, and the texture is taken at its lowest height.
    """
    ridge = geometry.ridge_amplitude, geometry.ridge_period
    texture = geometry.texture_amplitude, geometry.texture_period
    sinusoid = geometry.profile is None or geometry.profile.cosine is not None
    # largest amount by which the surfaces reduce an integral: the negative half of a cosine, or a bound for any profile
    swing = ridge[0] * ridge[1] / math.pi + texture[0] * texture[1] * (1.0 / math.pi if sinusoid else 0.5)
    half = float((1.5 * radius * (area + swing)) ** (1.0 / 3.0))
    one = -(half**2) / (6.0 * radius) - 0.5 * (area + swing) / half
    lowest = geometry.extent[0]
    smooth = lowest - float((1.5 * radius * area) ** (2.0 / 3.0)) / (2.0 * radius)  # a smooth finger on the lowest h
    if sinusoid:
        crests = [_on_crests(*ridge, *texture, radius, area, half), _on_crests(*texture, *ridge, radius, area, half)]
    else:
        crests = [_on_crests(*ridge, 0.0, ridge[1], radius, area, half) + lowest + ridge[0]]
    return max(one, smooth, *crests) - SLACK * geometry.height_scale


def _on_crests(
    amplitude: float, period: float, other: float, other_period: float, radius: float, area: float, half: float
) -> float:
    """Return the bound of `lowest_approach` from windows about the crests of one surface.

    half: m, a likely half-length of the contact.
    """
    number = np.unique(np.round(np.geomspace(1.0, max(4.0 * half / period, 2.0), WINDOWS)))[:, np.newaxis]
    width = period * np.arange(1, WINDOWS + 1) / WINDOWS
    ratio = math.remainder(period, other_period) / other_period
    together = np.ones_like(number) if ratio == 0.0 else np.sin(math.pi * ratio * number) / math.sin(math.pi * ratio)
    cancelled = np.abs(together / number if ratio != 0.0 else together) * np.abs(np.sinc(width / other_period))
    drop = (period**2 * (3.0 + number**2 - 1.0) + width**2) / (24.0 * radius)
    bound = amplitude * np.sinc(width / period) - other * cancelled - drop - area / (number * width)
    return float(np.max(bound))


@dataclass(frozen=True, slots=True)
class RoundFinger:
    """The round finger without its ridges, on its foundation.

    radius: R, m.
    reference_load: w0, N.
    length: L(w0), m.
    foundation: kappa(w0), Pa/m.
    length_exponent: power of the load by which the length grows.
    foundation_exponent: power of the load by which the foundation modulus grows.
    """

    radius: float
    reference_load: float
    length: float
    foundation: float
    length_exponent: float
    foundation_exponent: float

    @classmethod
    def of(cls, stiffness: Stiffness, radius: float | None, reference_load: float) -> RoundFinger:
        """Return the finger of `radius` (m); None: the radius that gives the length of `stiffness` at w0 (N)."""
        assert reference_load > 0.0 and (radius is None or radius > 0.0)
        length = stiffness.contact_length
        foundation = stiffness.stiffness(reference_load) / length
        fitting = foundation * length**3 / (12.0 * reference_load)
        # kappa is proportional to L^(n - 1) w^(1 - m), so b^(n + 2) is proportional to R w^m: see `Stiffness`
        m, n = stiffness.load_exponent, stiffness.length_exponent
        powers = m / (n + 2.0), m * (n - 1.0) / (n + 2.0) + 1.0 - m
        ratio = 1.0 if radius is None else (radius / fitting) ** (1.0 / (n + 2.0))
        return cls(radius or fitting, reference_load, length * ratio, foundation * ratio ** (n - 1.0), *powers)

    def length_at(self, load: float) -> float:
        """Return L (m), the length that a smooth finger touches at `load` (N)."""
        return float(self.length * (load / self.reference_load) ** self.length_exponent)

    def foundation_at(self, load: Any) -> Any:
        """Return kappa (Pa/m) at `load` (N, any shape)."""
        return self.foundation * (load / self.reference_load) ** self.foundation_exponent

    def area(self, load: float) -> float:
        """Return w / kappa (m^2) at `load` (N): the integral of max(h - d - z, 0)."""
        return float(load / self.foundation_at(load)) if load > 0.0 else 0.0


@dataclass(frozen=True)
class RoundContact(Contact):
    """A contact under a round finger.

    geometry, stiffness: of the nominal contact length.
    finger: the finger without its ridges.
    least_span: load (N) whose length D is also used for lighter loads; 0: each load has its own.
    deeper: distance (m) below z0 down to which heights lie within D.
    """

    of_one_shape = False
    finger: RoundFinger
    least_span: float = 0.0
    deeper: float = 0.0

    @classmethod
    def of(
        cls, geometry: Geometry, stiffness: Stiffness, radius: float | None = None, reference_load: float = 1.0
    ) -> RoundContact:
        """Return the contact of a round finger; SceneError where the finger is too flat to be solved at any load.

        geometry, stiffness: over the nominal length; both surfaces need a period, and one of them a height.
        radius: m; None: the radius at which a smooth finger touches the nominal length at `reference_load`.
        reference_load: N.
        """
        finger, geometry = RoundFinger.of(stiffness, radius, reference_load), geometry.as_profile()
        _spanned(geometry, finger, 0.0)  # raises where it is too flat
        return cls(geometry, stiffness, finger)

    def under(self, law: Stiffness) -> RoundContact:
        """See `Contact`: the finger keeps its radius."""
        finger = RoundFinger.of(law, self.finger.radius, self.finger.reference_load)
        return replace(self, stiffness=law, finger=finger)

    @cached_property
    def grid(self) -> PhaseSolver:
        """The solver at no load."""
        return solver_of(_spanned(self.geometry, self.finger, 0.0), self.dome)

    @property
    def dome(self) -> float:
        """1 / R (1/m) of the parabola that is subtracted from h, about the middle of the length."""
        return 1.0 / self.finger.radius

    def geometry_at(self, load: float) -> Geometry:
        """Return the surfaces over the solved length D at `load` (N); SceneError where D is too long."""
        return _spanned(self.geometry, self.finger, max(load, self.least_span), self.deeper)

    def over_loads(self, heaviest: float, deeper: float = 0.0) -> RoundContact:
        """See `Contact`: beyond the length D of the heaviest load no lighter load touches."""
        return replace(self, least_span=heaviest, deeper=deeper)

    @property
    def stiffness_exponent(self) -> float:
        """See `Contact`: kappa D grows as kappa."""
        return self.finger.foundation_exponent

    def solver(self, load: float) -> PhaseSolver:
        """Return the solver of this contact at `load` (N); see `geometry_at`."""
        return solver_of(self.geometry_at(load), self.dome)

    def width_at(self, load: float) -> float:
        """Return L (m) of a smooth finger at `load` (N), not the solved length D; 0 at no load."""
        return self.finger.length_at(load)

    def indentation(self, load: float) -> float:
        """Return w / (kappa D) (m) at `load` (N): the mean of max(h - d - z, 0) over the solved length D."""
        return self.finger.area(load) / self.geometry_at(load).contact_length

    def stiffness_at(self, load: float) -> float:
        """Return kappa D (N/m) at `load` (N): the force per metre of that mean."""
        return float(self.finger.foundation_at(load) * self.geometry_at(load).contact_length)

    def heights(self, phases: Array, loads: Array) -> Array:
        """Return z (m) at each of `phases` (turns) and `loads` (N, above 0), one load per phase.

        All loads share one polyline, over the span of USUAL_LOAD or of the heaviest of these loads. Each load is solved
        over the span of the next power of two (N).
        """
        classes = np.exp2(np.ceil(np.log2(loads)))
        spans = {one: _spanned(self.geometry, self.finger, one).contact_length for one in np.unique(classes).tolist()}
        geometry = self._longest(float(np.max(classes)))
        grid, lengths = solver_of(geometry, self.dome), np.array([spans[one] for one in classes.tolist()])
        assert isinstance(grid, SegmentGrid)
        indentations = loads / self.finger.foundation_at(loads) / lengths
        return grid.solve(phases, indentations, numbers=grid.numbers_of(geometry, lengths)).height

    def _longest(self, load: float) -> Geometry:
        """Return the surfaces over the span of USUAL_LOAD; of `load` (N) if it is heavier or that span is too long."""
        try:
            return _spanned(self.geometry, self.finger, max(load, USUAL_LOAD))
        except SceneError:
            return _spanned(self.geometry, self.finger, load)


@kept
def _spanned(geometry: Geometry, finger: RoundFinger, load: float, deeper: float = 0.0) -> Geometry:
    """Return `geometry` over the length D about its middle, beyond which nothing touches at `load` (N) at any phase.

    deeper: distance (m) by which z may be lower than at that load.
    """
    room = geometry.extent[1] + deeper - lowest_approach(geometry, finger.radius, finger.area(load))
    span = span_of(finger, room, load)
    return geometry.part(0.5 * (geometry.contact_length - span), span)


def span_of(finger: RoundFinger, room: float, load: float) -> float:
    """Return the length (m) over which `finger` rises by `room` (m); SceneError where it is too long.

    load: N, at which nothing touches beyond it.
    """
    span = 2.0 * math.sqrt(2.0 * finger.radius * room)
    if not span <= LONGEST_SPAN:
        value = f"a radius of {finger.radius:.4g} m, which touches within {span:.3g} m at a load of {load:.3g} N"
        hint = "Write a smaller radius, a lighter load, a shorter contact or lower ridges, or leave curvature out."
        raise SceneError([Fault("/finger", value, f"a contact within {LONGEST_SPAN:g} m", hint)])
    return span
