"""The forces of a prepared scene, as series and as what reads a motion: those of `tangential`.

Stage   3 (VOICE), used by `tangential_force`.
Model   In a steady scan the slope force and friction are one series. Elsewhere they are read: along a line from
        response tables, over an area as `area_force_reading` has it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from synth.contact.forces import FrictionForce, SlopeForce
from synth.errors import Fault, SceneError
from synth.plan.channels import extent_and_peak, spendable
from synth.plan.preparation import Preparation
from synth.plan.scene_series import SERIES_SHARE
from synth.plan.scene_table import bounds_for, kept_table, read_error
from synth.response.demand import Complex, Demand, curves, points_for
from synth.response.series_curve import SeriesCurve
from synth.response.spectrum import Spectrum, solve_spectrum
from synth.response.table import ResponseTable
from synth.response_cache import ResponseCache
from synth.scene.finger_section import KINDS
from synth.voice.area_force_reading import MovingForce, of_cells

READ_AS = "displacement", "approach"  # how the tables are read: the slope force has no mean, friction has one
LIVE_WORK, FILE_WORK = 2.0, 8.0  # times the work of a contact's table: a phase of friction takes ten times as long
MOST_ERROR = 1.0  # of the peak-to-peak: a larger error is refused, if the table lacks harmonics in the band


@dataclass(frozen=True, slots=True)
class Force:
    """One force over place and load.

    series: harmonics at the scan's load, without the mean, N; of a moving finger over an area those of a swing.
    mean: over a period at that load, N.
    error: relative to the peak-to-peak of the force.
    table: for reading a motion along a line.
    moving: for reading a motion over an area.
    """

    series: Complex
    mean: float
    error: float
    table: ResponseTable | None = None
    moving: MovingForce | None = None

    @classmethod
    def of(cls, solved: Preparation, force: Any, cache: ResponseCache) -> Force:
        """Return `force` of a prepared scene, along a line or in a steady scan."""
        highest, load = max(solved.highest, 1), solved.scene.scan.load
        demand = Demand(highest, (0,), SERIES_SHARE * spendable(solved.tolerance))
        key = ("force", force.key, load, demand)
        spectrum: Spectrum = cache.get(key, lambda: solve_spectrum(force, load, demand))
        series, error = spectrum.harmonics[: highest + 1].copy(), spectrum.errors[0]
        mean, series[0] = float(series[0].real), 0.0
        if not solved.moving:
            return cls(series, mean, error)
        work, rate = LIVE_WORK if solved.by_hand or solved.paced else FILE_WORK, solved.scene.output.sample_rate
        table = kept_table(force, solved.scene, cache, work=work)
        return cls(series, mean, read_error(table, READ_AS[0], rate, solved.reported_loads, highest), table)

    @classmethod
    def over_area(cls, solved: Preparation, force: Any, cache: ResponseCache) -> Force:
        """Return `force` of a finger over an area."""
        if solved.moving:
            found = MovingForce.of(solved, force)
            return cls(found.series, found.mean, found.error, moving=found)
        steady = cls.of(solved, force, cache)
        if force.refines:
            return steady
        return replace(steady, error=steady.error + of_cells(force, solved.scene.scan.load, len(steady.series) - 1))

    @property
    def left_over(self) -> float:
        """The largest error (N) over a period."""
        return self.error * extent_and_peak(self.series)[0]


@dataclass(frozen=True, slots=True)
class Steady:
    """One component in a steady scan.

    series: harmonics, without the mean, N.
    level: the mean, N.
    left_over: largest error, N.
    """

    series: Complex
    level: float
    left_over: float

    @property
    def extent(self) -> float:
        """The peak-to-peak, N."""
        return extent_and_peak(self.series)[0]

    @property
    def peak(self) -> float:
        """The largest magnitude, N."""
        return float(np.max(np.abs(curves(self.series, 0, 2 * points_for(len(self.series) - 1)) + self.level)))

    def reader(self, lifted: float) -> tuple[SeriesCurve | None, float]:
        """Return what reads it (None: nothing varies) and its mean (N), under the lift gate `lifted`."""
        return SeriesCurve(lifted * self.series) if self.series.any() else None, lifted * self.level


def forces_of(solved: Preparation, law: Any, cache: ResponseCache) -> tuple[tuple[Force, ...], Force | None]:
    """Return the slope force of each component that has one, and friction unless it is Coulomb's."""
    whole: Any = solved.contact
    powered = law.pressure_exponent != 1.0 and law.friction_coefficient > 0.0
    friction = law.friction_coefficient, law.pressure_exponent, law.reference_pressure
    if whole.geometry.over_area:
        from synth.contact.area_forces import AreaFriction, AreaSlopeForce, RecentSums

        contact: Any = solved.contact if solved.direct is None else solved.direct.contact
        recent, power = RecentSums(), law.pressure_exponent if powered else 0.0
        forces = [AreaSlopeForce(contact, axis, power, recent=recent) for axis in range(law.count)]
        slopes = tuple(Force.over_area(solved, force, cache) for force in forces)
        rubbed = AreaFriction(contact, *friction, recent=recent)
        return slopes, Force.over_area(solved, rubbed, cache) if powered else None
    if powered and not whole.of_one_line:
        allowed = "1 under a fingertip, for which the pressure of each place is not computed"
        others = " or ".join(f'"{name}"' for name, kind in KINDS.items() if not kind.of_area)
        hint = f"Write a pressure_exponent of 1, or finger.kind {others}."
        value = f"{law.pressure_exponent:g}"
        raise SceneError([Fault("/effects/tangential/pressure_exponent", value, allowed, hint)])
    contact = whole.as_profile()
    slope = Force.of(solved, SlopeForce(contact), cache)
    return (slope,), Force.of(solved, FrictionForce(contact, *friction), cache) if powered else None


def sum_of_series(one: Complex, other: Complex) -> Complex:
    """Return the sum of two series."""
    total = np.zeros(max(len(one), len(other)), complex)
    total[: len(one)] = one
    total[: len(other)] += other
    return total


def require_detail(solved: Preparation, forces: tuple[Force, ...], components: list[Steady]) -> None:
    """Raise SceneError where a table is read that lacks much of the band, of a force or of the motion beside it."""
    if not any(one.table is not None for one in forces) or solved.highest <= bounds_for(solved.scene).harmonics:
        return
    of_force = components[0].left_over / components[0].extent if components[0].extent > 0.0 else 0.0
    worst = max(of_force, *(one.error for one in solved.channels))
    if worst <= MOST_ERROR:
        return
    allowed = f"an error of {MOST_ERROR:g} or less wherever speed or load change, where a table is read"
    hint = (
        "The texture has more detail than a table holds. Write a shorter texture, render a file at constant "
        "speed and load, or leave tangential out."
    )
    raise SceneError([Fault("/effects/tangential", f"an error of {worst:.2g} of the peak-to-peak", allowed, hint)])
