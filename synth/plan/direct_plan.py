"""Choose between the response table and direct solutions for a live voice, and plan the latter.

Stage   2 (PLAN). `sampling.direct_reader` reads what is planned here.
Model   The rule: a voice reads its table where the table holds every harmonic that is in the band at the scan's own
        speed. Otherwise eq. 1 is solved along the motion. A table holds 64 harmonics for a band of 1 kHz, which is
        enough for periods up to 5.1 mm at 80 mm/s. A contact whose solutions would take more than MOST_WORK keeps its
        table, unless its surface is too long for one. A finger that may leave its line over an area is always solved.
        Displacement is z less its mean over PLACES places of the surface, at each load.
        Error: the folded error of a swing (`swing`) at the lightest, the scan's and the heaviest usual load. The errors
        of the filter and of the solver's segments or cells are added. Over an area the usual rate is halved if the
        folded error stays within FOLDED.
        Over an area solutions of a turned finger may take MOST_TURNED. If they would take more, the cells are enlarged,
        up to the last factor of COARSER. Along a line the columns of a fingertip are, by COARSER_ON_LINE.
Source  design, sections 1 and 8. Predicted times are those of `frame_plan`.
Limits  The error is that of one swing, at one place for each load. If an effect reads a table of its own, over a
        period, the contact keeps its table too, so that all channels have one delay.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import partial
from time import thread_time
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.contact.load_balance import Contact
from synth.contact.scene_contact import contact_of
from synth.effects.effect import Kind
from synth.kept_files import FileForm, json_form
from synth.motion.scan_motion import ScanMotion
from synth.plan.effect_choice import asked as asked_effects
from synth.plan.effect_choice import outputs_of
from synth.plan.frame_plan import solution_nanoseconds
from synth.plan.request import HAND_LOADS, HAND_SPEEDS, Request, harmonics_in_band
from synth.plan.scene_table import band_of, bounds_for, entry_of
from synth.plan.swing import FOLD_POWER, Swing, changed_by, changes_to, folded_errors, turning_errors
from synth.response.mean_approach import Mean, SolvedMean, heights_of_mean, mean_of
from synth.response.reading_filter import SOLUTIONS, band_filter
from synth.response.table_error import QUANTITIES
from synth.response_cache import ResponseCache
from synth.scene.scene import Scene
from synth.surfaces import profile_of
from synth.surfaces.profile import Profile

FOLDED = 0.01  # of the peak-to-peak: largest folded error with fewer solutions
MOST_WORK = 0.22  # predicted s of processor time per second; more would leave no room for other hands
MEAN_TOLERANCE = 0.1  # tolerance of the mean of z over the load; its error is a thousandth of it, of the peak-to-peak
AREA_MEAN_TOLERANCE = 2.0  # for fingertips, areas and long surfaces: 0.2 %, below the error of a mean over PLACES
PLACES, MEANS = 128, 9  # places, and least number of loads, of the mean: a fingertip takes 30 us per place and load
PATH_SLOPE = 0.618033988749895  # slope of the path on which the rate of solutions is judged: along no row of points
TURNED = 0.03  # s, length of the swing on which the error of a finger that turns is measured
LEFT_OF_CHANGE = 0.7  # error of cells over the change by cells twice as large: up to 0.57 in 20 random scenes of dots
FEWER = 0.5  # factor on the usual number of solutions over an area, where z is smoother, if FOLDED permits it
COARSER = (1.0, 1.5, 2.0, 3.0)  # factors on the size of the cells of an area
MOST_TURNED = 0.16  # predicted s per second for a finger turned over an area, at 1.8 N; at 0.3 N it takes half of it
# Factors on the distances of a fingertip's columns, and the predicted s per second up to which each is taken. At 3 a
# smooth texture may have noise as loud as itself.
COARSER_ON_LINE = ((1.0, 0.1), (2.0, 0.22))
SPREAD_FORM = json_form(float, float)


@dataclass(frozen=True, slots=True)
class DirectPlan:
    """How a voice solves eq. 1 along its motion.

    contact: the contact over the whole surface, which is solved.
    mean: mean of z over places of the surface (m), over the cube root of the load (N^(1/3)).
    heaviest: largest load that is solved, N; a heavier one is read as this load.
    band: frequency up to which every component is kept, Hz.
    finer: factor on the usual number of solutions.
    rate: solutions per second.
    fastest: largest speed for which the errors are reported, m/s.
    loads: lightest, own and heaviest load for which the errors are reported, N.
    errors: of displacement, velocity and acceleration, relative to the peak-to-peak.
    solution_seconds: measured processor time of a solution at the load where it is longest, s.
    turning: what a finger that is turned from its own direction adds to each of `errors`; None for one on a line.
    radian_seconds: measured processor time that a finger takes to turn by a radian into new directions, s.
    """

    contact: Contact
    mean: Mean
    heaviest: float
    band: float
    finer: float
    rate: float
    fastest: float
    loads: tuple[float, ...]
    errors: tuple[float, ...]
    solution_seconds: float
    turning: tuple[float, ...] | None = None
    radian_seconds: float = 0.0

    @property
    def work(self) -> float:
        """Measured processor time of a second of sound, s."""
        return self.rate * self.solution_seconds


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


def beyond_table(asked: Request, contact: Contact) -> bool:
    """Return whether a moving voice of the request is solved directly on `contact`, by the rule of this module."""
    scene = asked.scene
    if asked.stretch is not None or asked.over_area:
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
    on_path, fastest = asked.over_area, max(own, HAND_SPEEDS[1])
    arguments = (scene.output.sample_rate, band_of(scene), fastest, own if on_path else None, judged, heaviest)
    decided = (contact.geometry.texture_period, *arguments, tolerance)
    return cache.get(
        ("direct plan", contact.key, whole.key, *arguments, tolerance),
        lambda: _planned(contact, whole, *arguments, tolerance=tolerance),
        lambda: entry_of(scene, whole, decided, _form_on(whole)),
    )


def _form_on(whole: Contact) -> FileForm[DirectPlan]:
    """Return the form of the file of a plan. The file leaves out `whole`, which the scene determines."""

    def document(plan: DirectPlan) -> dict[str, Any]:
        assert isinstance(plan.mean, SolvedMean)
        plain = {one.name: getattr(plan, one.name) for one in fields(plan) if one.name not in ("contact", "mean")}
        return plain | {"mean": [plan.mean.roots.tolist(), plan.mean.values.tolist()]}

    def plan_of(document: dict[str, Any]) -> DirectPlan:
        mean = SolvedMean(*(np.array(values, dtype=float) for values in document.pop("mean")))
        plain: Any = {name: tuple(value) if isinstance(value, list) else value for name, value in document.items()}
        return DirectPlan(whole, mean, **plain)

    return json_form(document, plan_of)


def _planned(
    contact: Contact, whole: Contact, rate: int, band: float, fastest: float, own: float | None,
    loads: tuple[float, ...], heaviest: float, *, tolerance: float | None,
) -> DirectPlan:  # fmt: skip
    """Return the plan; own: speed of the scan (m/s) of a finger that may leave its line over an area; None: it may not.

    The other arguments are the fields of DirectPlan, and those of `direct_plan`.
    """
    on_path, longer = own is not None, whole.geometry.texture_period > contact.geometry.texture_period
    allowed = AREA_MEAN_TOLERANCE if on_path or longer or not whole.of_one_line else MEAN_TOLERANCE
    heights = heights_of_mean(whole, across=on_path)
    mean = mean_of(heights, (0.0, heaviest), loads[1], allowed, PLACES, MEANS)
    least = least_solutions(whole)
    swing = Swing(least * SOLUTIONS * band, band, fastest, PATH_SLOPE if on_path else 0.0)
    folded, seconds = folded_errors(whole, swing, loads)
    if own is None:
        cells, turning, radian = _by_segments(contact, swing, loads[1]), None, 0.0
    else:
        cells, turning, radian = _by_cells(whole, swing, replace(swing, fastest=own or fastest), loads[1])
    finer, steps, errors = _filtered(rate, swing, folded, cells, tolerance, least)
    return DirectPlan(whole, mean, heaviest, band, finer, steps, fastest, loads, errors, seconds, turning, radian)


def _by_segments(contact: Contact, swing: Swing, load: float) -> Array:
    """Return the error of each quantity by the segments or columns of `contact`, on its line."""
    smaller, larger = contact.refined() or contact.halved(), contact.doubled()
    if smaller is None and larger is not None:
        return changed_by(larger, contact, swing, load)
    return changed_by(contact, smaller, swing, load) / (1.0 - contact.settles)


def _by_cells(whole: Any, swing: Swing, slower: Swing, load: float) -> tuple[Array, tuple[float, ...], float]:
    """Return the error of each quantity by the cells of `whole`, what a finger adds that is turned, and the time (s).

    The time is that of new directions, for a radian.

    slower: the swing at the scan's own speed, at which finer waves are in the band.
    """
    from synth.contact.area_path import TURN_STEP, coarsened

    fine = coarsened(whole, min(whole.coarser, 1.0))
    judged = (coarsened(fine, 2.0 * fine.coarser), *(() if fine is whole else (whole,)))
    larger, *enlarged = np.max([changes_to(fine, judged, one, load) for one in {swing, slower}], axis=0)
    cells = LEFT_OF_CHANGE * larger + sum(enlarged)
    turning = turning_errors(whole, fine, replace(slower, seconds=TURNED), load)
    started = thread_time()
    if not whole.of_any_direction:
        whole.grid_at(whole.line.direction - TURN_STEP)
    return cells, tuple(turning.tolist()), (thread_time() - started) / TURN_STEP


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


def predicted_work(scene: Scene, contact: Contact) -> float:
    """Return the predicted processor time (s) of a second of a voice that solves `contact` along its motion."""
    rate = min(least_solutions(contact) * SOLUTIONS * band_of(scene), scene.output.sample_rate)
    return 1e-9 * solution_nanoseconds(contact) * rate


def least_solutions(contact: Contact) -> float:
    """Return the least factor on the usual number of solutions."""
    return FEWER if contact.geometry.over_area else 1.0


def affordable(scene: Scene, cache: ResponseCache, profile: Profile | None = None) -> Contact:
    """Return the contact of `scene` at the least distances that can be solved in real time.

    Over an area solutions may take MOST_TURNED, and the work falls with the square of the distances. Along a line it
    falls with the distances.

    profile: as of `contact_of`.
    """
    fine = contact_of(scene, profile)
    over = fine.geometry.over_area
    limits = [(one, one * most) for one, most in COARSER_ON_LINE]
    if over:
        limits = [(one, MOST_TURNED * one**2) for one in COARSER]

    def chosen() -> float:
        """Return the least factor on the usual distances."""
        work = predicted_work(scene, fine)
        return next((one for one, most in limits if work <= most), limits[-1][0])

    key_parts = scene.output.sample_rate, band_of(scene)
    file = partial(entry_of, scene, fine, key_parts, SPREAD_FORM)
    coarser = cache.get(("spread", fine.key, key_parts), chosen, file) if over else chosen()
    return fine if coarser == 1.0 else contact_of(scene, profile, coarser)
