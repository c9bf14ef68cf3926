"""Choose between the response table and direct solutions for a live voice, and plan the latter.

Stage   2 (PLAN). `response.direct_reader` reads what is planned here.
Model   The rule: a voice reads its table where the table holds every harmonic that is in the band at the scan's own
        speed. Otherwise eq. 1 is solved along the motion. A table holds 64 harmonics for a band of 1 kHz, which is
        enough for periods up to 5.1 mm at 80 mm/s. A contact whose solutions would take more than MOST_WORK keeps its
        table, unless its surface is too long for one.
        A finger that may leave its line over an area reads a layered table while it keeps the direction of that line
        (`area_source`). In any other direction z is solved along its path (`live_work`).
        Displacement is z less its mean over PLACES places of the surface, at each load.
        Error: the folded error of a swing (`swing`) at the lightest, the scan's and the heaviest usual load. The errors
        of the filter and of the solver's segments, or of a layered table, are added. Over an area LEFT_OF_CHANGE of
        the change by cells twice as large as the usual ones is added too, and the usual rate is halved if the folded
        error stays within FOLDED. The error of larger cells is measured against usual ones, at the scan's own speed.
Source  design, sections 1 and 8.
Limits  The error is that of one swing, at one place for each load. If an effect reads a table of its own, over a
        period, the contact keeps its table too, so that all channels have one delay.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from synth.arrays import Array
from synth.contact.load_balance import Contact
from synth.effects.effect import Kind
from synth.kept_files import FileEntry, FileForm, json_form
from synth.motion.scan_motion import ScanMotion
from synth.plan.effect_choice import asked as asked_effects
from synth.plan.effect_choice import outputs_of
from synth.plan.live_work import FEWER, least_solutions, predicted_work
from synth.plan.request import HAND_LOADS, HAND_SPEEDS, Request, harmonics_in_band
from synth.plan.scene_table import band_of, bounds_for, entry_of
from synth.plan.swing import FOLD_POWER, Swing, changed_by, folded_errors, turning_errors
from synth.response.mean_approach import Mean, MeanSpline, mean_curve, mean_over_area
from synth.response.table_error import QUANTITIES
from synth.response_cache import ResponseCache
from synth.sampling.band_filter import SOLUTIONS, band_filter
from synth.scene.scene import Scene
from synth.surfaces import profile_of

if TYPE_CHECKING:
    from synth.response.area_source import AreaSource
    from synth.response.layered_table import LayeredTable

FOLDED = 0.01  # of the peak-to-peak: largest folded error with fewer solutions
MOST_WORK = 0.22  # predicted s of processor time per second; more would leave no room for other hands
LEFT_OF_CHANGE = 0.7  # error of cells over the change by cells twice as large: up to 0.57 in 20 random scenes of dots
MOST_MAKING, WORKERS = 3.0, 2  # predicted s of processor time to make a layered table, and number of threads
MEAN_TOLERANCE = 0.1  # tolerance of the mean of z over the load; its error is a thousandth of it, of the peak-to-peak
AREA_MEAN_TOLERANCE = 2.0  # for fingertips, areas and long surfaces: 0.2 %, below the error of a mean over PLACES
PLACES, MEANS = 128, 9  # places, and least number of loads, of the mean: a fingertip takes 30 us per place and load
PATH_SLOPE = 0.618033988749895  # slope of the path on which the rate of solutions is judged: along no row of points
TURNED = 0.03  # s, length of the swing on which the error of a finger that turns is measured

PLAIN = ("heaviest", "band", "finer", "rate", "fastest", "loads", "errors", "solution_seconds")
"""Fields of a DirectPlan that are numbers."""


@dataclass(frozen=True, slots=True)
class Turning:
    """Error and cost of a finger that is turned from its own direction over an area.

    errors: then added to the errors of displacement, velocity and acceleration, relative to the peak-to-peak.
    work: measured processor time of a second of sound between two directions, s.
    """

    errors: tuple[float, ...]
    work: float


@dataclass(frozen=True, slots=True)
class DirectPlan:
    """How a voice solves eq. 1 along its motion.

    contact: source of z: the contact over the whole surface, or `area_source.AreaSource`.
    mean: mean of z over places of the surface (m), over the cube root of the load (N^(1/3)).
    heaviest: largest load that is solved, N; a heavier one is read as this load.
    band: frequency up to which every component is kept, Hz.
    finer: factor on the usual number of solutions.
    rate: solutions per second.
    fastest: largest speed for which the errors are reported, m/s.
    loads: lightest, own and heaviest load for which the errors are reported, N.
    errors: of displacement, velocity and acceleration, relative to the peak-to-peak.
    solution_seconds: measured processor time of a solution at the load where it is longest, s.
    turning: of a finger that may leave its line over an area and turn; None for one on a line.
    """

    contact: Contact | AreaSource
    mean: Mean
    heaviest: float
    band: float
    finer: float
    rate: float
    fastest: float
    loads: tuple[float, ...]
    errors: tuple[float, ...]
    solution_seconds: float
    turning: Turning | None = None

    @property
    def work(self) -> float:
        """Measured processor time of a second of sound, s."""
        return self.rate * self.solution_seconds

    @property
    def table(self) -> LayeredTable | None:
        """The layered table that is read, or None."""
        return getattr(self.contact, "table", None)


def follows_path(scene: Scene) -> bool:
    """Return whether a hand can lead the finger of `scene` over an area and turn it.

    The texture must vary across. No effect may replace the response by a simulation, which covers one line only.
    """
    return profile_of(scene).of_area and not any(asked_effects(scene, Kind.BALANCE))


def may_turn(scene: Scene) -> bool:
    """Return whether `scan.direction` can turn the finger of `scene` on a texture along a line, for a hand to follow.

    A probe is round, and no effect may simulate the line.
    """
    line = not profile_of(scene).of_area and not scene.finger.traits.round
    return line and not any(asked_effects(scene, Kind.BALANCE))


def over_area(asked: Request) -> bool:
    """Return whether the finger may leave the line of the scan: on a path over an area, or led by a hand."""
    return asked.area or not asked.scene.scan.along_x


def reads_series(asked: Request) -> bool:
    """Return whether a moving file reads z from the series of one load, instead of solving it along its motion."""
    return not (asked.load_varies or asked.stretch is not None or over_area(asked))


def beyond_table(asked: Request, contact: Contact) -> bool:
    """Return whether a moving voice of the request is solved directly on `contact`, by the rule of this module."""
    scene = asked.scene
    if asked.stretch is not None or over_area(asked):
        return True
    most = bounds_for(scene).harmonics
    if harmonics_in_band(scene, most + 1) <= most or any(effect.has_table for effect, _settings in outputs_of(scene)):
        return False
    return predicted_work(scene, contact) <= MOST_WORK


def direct_plan(
    asked: Request, contact: Contact, whole: Contact, cache: ResponseCache, tolerance: float | None = None
) -> DirectPlan:
    """Return how a voice of the request solves its scene directly.

    contact: contact of one period, on which the solver's segments are judged.
    whole: contact of the whole surface, which is solved.
    tolerance: largest error; solutions are added until it is met. None: the usual number of solutions.
    """
    scene, heaviest, (low, high) = asked.scene, bounds_for(asked.scene).heaviest, asked.reported_loads
    loads = min(low, HAND_LOADS[0]), scene.scan.load, max(high, HAND_LOADS[1])
    judged = tuple(max(load, scene.scan.lift_load) for load in loads)
    own = ScanMotion(scene, whole=asked.live).fastest()
    fastest = max(own, HAND_SPEEDS[1])
    arguments = (scene.output.sample_rate, band_of(scene), fastest, judged, heaviest, tolerance)
    key: Hashable = ("direct plan", contact.key, whole.key, over_area(asked), own, *arguments)
    if not over_area(asked):
        return cache.get(
            key,
            lambda: _along_line(contact, whole, *arguments),
            lambda: entry_of(scene, whole, (contact.geometry.texture_period, *arguments), _form_along(whole)),
        )

    def source() -> AreaSource:
        return _area_source(scene, whole, cache, heaviest)

    def file() -> FileEntry[DirectPlan] | None:
        return entry_of(scene, whole, (own, *arguments), _form_over(source)) if tolerance is None else None

    return cache.get(key, lambda: _over_area(whole, source, own, *arguments), file)


def _form_along(whole: Contact) -> FileForm[DirectPlan]:
    """Return the form of the file of a plan along a line. The file leaves out `whole`, which the scene determines."""

    def document(plan: DirectPlan) -> dict[str, Any]:
        assert isinstance(plan.mean, MeanSpline), "loads from 0 N"
        return _numbers(plan) | {"mean": [plan.mean.roots.tolist(), plan.mean.values.tolist()]}

    def plan_of(fields: dict[str, Any]) -> DirectPlan:
        mean = MeanSpline(*(np.array(values, dtype=float) for values in fields["mean"]))
        return DirectPlan(whole, mean, **_plain(fields))

    return json_form(document, plan_of)


def _form_over(source: Callable[[], AreaSource]) -> FileForm[DirectPlan]:
    """Return the form of the file of a plan over an area, whose layered table has a file of its own."""

    def document(plan: DirectPlan) -> dict[str, Any]:
        assert plan.turning is not None
        return _numbers(plan) | {"turned": plan.turning.errors, "work": plan.turning.work}

    def plan_of(fields: dict[str, Any]) -> DirectPlan:
        turning, found = Turning(tuple(fields["turned"]), fields["work"]), source()
        return DirectPlan(found, found.mean, **_plain(fields), turning=turning)

    return json_form(document, plan_of)


def _numbers(plan: DirectPlan) -> dict[str, Any]:
    return {name: getattr(plan, name) for name in PLAIN}


def _plain(fields: dict[str, Any]) -> dict[str, Any]:
    """Return the PLAIN fields of a document."""
    return {name: tuple(fields[name]) if isinstance(fields[name], list) else fields[name] for name in PLAIN}


def _along_line(
    contact: Contact,
    whole: Contact,
    rate: int,
    band: float,
    fastest: float,
    loads: tuple[float, ...],
    heaviest: float,
    tolerance: float | None,
) -> DirectPlan:
    long = whole.geometry.texture_period > contact.geometry.texture_period
    allowed = AREA_MEAN_TOLERANCE if long or not whole.of_one_line else MEAN_TOLERANCE
    mean = mean_curve(whole, (0.0, heaviest), loads[1], allowed, PLACES, MEANS)
    least = least_solutions(whole)
    swing = Swing(least * SOLUTIONS * band, band, fastest)
    folded, seconds = folded_errors(whole, swing, loads)
    smaller, larger = contact.refined() or contact.halved(), contact.doubled()
    if smaller is None and larger is not None:
        coarse = changed_by(larger, contact, swing, loads[1])
    else:
        coarse = changed_by(contact, smaller, swing, loads[1]) / (1.0 - contact.settles)
    finer, steps, errors = _filtered(rate, swing, folded, coarse, tolerance, least)
    return DirectPlan(whole, mean, heaviest, band, finer, steps, fastest, loads, errors, seconds)


def _area_source(scene: Scene, coarse: Any, cache: ResponseCache, heaviest: float) -> AreaSource:
    """Return the layered table of `scene`, and the contact on which a turned finger is solved."""
    from synth.contact.area_path import coarsened
    from synth.response.area_source import AreaSource
    from synth.response.layered_cost import LayeredBounds
    from synth.response.layered_file import LAYERED_FORM
    from synth.response.layered_making import make_layered_table

    fine, bounds = coarsened(coarse, 1.0), LayeredBounds(heaviest=heaviest, seconds=MOST_MAKING)
    table = cache.get(
        ("layered", fine.key, bounds),
        lambda: make_layered_table(fine, bounds, workers=WORKERS),
        lambda: entry_of(scene, fine, bounds, LAYERED_FORM),
    )
    return AreaSource(table, coarse)


def _over_area(
    coarse: Any,
    table_source: Callable[[], AreaSource],
    own: float,
    rate: int,
    band: float,
    fastest: float,
    loads: tuple[float, ...],
    heaviest: float,
    tolerance: float | None,
) -> DirectPlan:
    from synth.contact.area_path import coarsened

    swing = Swing(FEWER * SOLUTIONS * band, band, fastest, PATH_SLOPE)
    slower = replace(swing, fastest=own or fastest)  # at this speed finer waves are in the band
    fine = coarsened(coarse, 1.0)

    def most_changed(contact: Any, better: Any) -> Array:
        """Return the larger change over both swings."""
        return np.maximum(*(changed_by(contact, better, one, loads[1]) for one in (swing, slower)))

    source: Contact | AreaSource = coarse
    if tolerance is None and coarse.of_one_surface:  # a table is of one surface
        source = table_source()
        mean: Mean = source.mean
        cells = LEFT_OF_CHANGE * most_changed(coarsened(coarse, 2.0), fine)
    else:
        cells = np.zeros(len(QUANTITIES))
        if tolerance is None:
            cells = LEFT_OF_CHANGE * most_changed(coarsened(coarse, 2.0), fine)
        else:
            source = coarse = fine  # `cells_along_path` has chosen them
        mean = mean_over_area(coarse, (0.0, heaviest), loads[1], AREA_MEAN_TOLERANCE, PLACES, MEANS)
    folded, seconds = folded_errors(source, swing, loads)
    missed = most_changed(source, fine) + cells
    short = replace(slower, seconds=TURNED)
    turned_folded, turned_seconds = folded_errors(coarse, short, loads)
    turning = turned_folded + turning_errors(coarse, fine, short, loads[1])
    finer, steps, errors = _filtered(rate, swing, folded, missed, tolerance, FEWER)
    turns = Turning(tuple(turning.tolist()), steps * turned_seconds)
    return DirectPlan(source, mean, heaviest, band, finer, steps, fastest, loads, errors, seconds, turns)


def _filtered(
    rate: int, swing: Swing, folded: Array, others: Array, tolerance: float | None, finer: float
) -> tuple[float, float, tuple[float, ...]]:
    """Return the factor on the usual number of solutions, the solutions per second, and the errors.

    folded: folded error in the band at the rate of `swing`.
    others: further errors.
    finer: the least factor.
    """
    while True:
        filters = [band_filter(quantity, rate, swing.band, finer) for quantity in QUANTITIES]
        steps = rate / filters[0].stride
        fold = (swing.rate / steps) ** FOLD_POWER * folded
        errors = tuple(float(one.error) for one in filters) + fold + others
        enough = finer >= 1.0 or np.max(fold) <= FOLDED if tolerance is None else np.max(errors) <= tolerance
        if enough or filters[0].stride == 1:
            return finer, steps, tuple(errors.tolist())
        finer *= 2.0
