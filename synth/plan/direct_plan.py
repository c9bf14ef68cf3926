"""Choose between the response table and direct solutions for a live voice, and measure the error of the latter.

Stage   2 (PLAN). `response.direct_reader` reads what is planned here.
Model   The rule: a voice reads its table where the table holds every harmonic that is in the band at the scan's own
        speed. Otherwise eq. 1 is solved along the motion. A table holds 64 harmonics of a band of 1 kHz: those of
        periods up to 5.1 mm at 80 mm/s. A contact that would take more than MOST_WORK keeps its table, unless its
        surface is too long for one. A finger that may leave its line over an area is always solved along its path. If
        that would take more than MOST_WORK, its points are farther apart, as far as COARSER allows.
        The mean that displacement leaves out is that of PLACES places of the surface, at each load.
        Error: a finger swings by a cosine, as fast as the fastest usual hand, at the lightest, the scan's and the
        heaviest usual load. z over one swing is periodic, so its Fourier series gives the band exactly. It is solved at
        twice the rate; what the usual rate folds into the band is the difference. To
        this the errors of the filter and of the solver's segments, or of points that are farther apart, are added.
Source  design, sections 1 and 8.
Limits  The error is that of one swing, at one place for each load. Effects that read a table of their own, over a
        period, keep the table of the contact too, so that all channels have one delay.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable
from dataclasses import dataclass, replace
from time import thread_time
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.contact.area_path import coarsened, turn_step, turned
from synth.contact.load_balance import Contact
from synth.contact.scene_contact import contact_of
from synth.effects.effect import Kind
from synth.motion.scan_motion import ScanMotion
from synth.plan.effect_choice import asked as asked_effects
from synth.plan.effect_choice import outputs_of
from synth.plan.frame_solver import EXACT_CELL
from synth.plan.request import HAND_LOADS, HAND_SPEEDS, Request, harmonics_in_band
from synth.plan.scene_table import band_of, bounds_for
from synth.response.band_filter import SOLUTIONS, band_filter
from synth.response.mean_approach import Mean, mean_curve, mean_over_area
from synth.response.response_cache import ResponseCache
from synth.response.table_error import QUANTITIES
from synth.scene.scene import Scene
from synth.surfaces import profile_of
from synth.surfaces.height_field import HeightField

OVER_AREA = 3.0  # time of a solution on a height field over that of its cells: 50 us at 0.3 N for 2,091 cells
MOST_WORK = 0.2  # predicted s of processor time per second; more would leave no room for other hands
COARSER = (1.0, 1.5, 2.0, 3.0, 4.0)  # factors on the distance of the points of an area
MEAN_TOLERANCE = 0.1  # of the mean of z over the load: its error is a thousandth of this, of the peak-to-peak
AREA_MEAN_TOLERANCE = 2.0  # the same over an area, where the mean of PLACES places errs by more than these 0.2 %
PLACES, MEANS = 128, 9  # places and least loads of the mean of z: a fingertip takes 30 us for each of both
SWING = 0.1  # s: a shorter swing passes less of the surface, a longer one delays the first sound
PATH_SLOPE = 0.618033988749895  # of the path on which solutions per second are judged: it meets no line of points
TURNED = 0.03  # s of the swing on which the error of a finger that turns is measured
FOLD_POWER = 1.5  # of the rate, by which the folded error falls at least: kinks of order 3/2 give 2.5
MORE_FOLDS = 1.0 / (1.0 - 2.0**-FOLD_POWER)  # what folds at the usual rate, over what no longer folds at twice it


@dataclass(frozen=True, slots=True)
class DirectPlan:
    """How a voice solves eq. 1 along its motion.

    contact: the contact over the whole surface.
    mean: mean of z over places of the surface (m), over the cube root of the load (N^(1/3)).
    heaviest: largest load that is solved, N; a heavier one is read as this load.
    band: frequency up to which every component is kept, Hz.
    finer: factor on the usual number of solutions.
    rate: solutions per second.
    fastest: speed up to which the errors are told, m/s.
    loads: lightest, own and heaviest load for which the errors are told, N.
    errors: of displacement, velocity and acceleration, relative to the peak-to-peak.
    solution_seconds: measured processor time of a solution at the load where it is longest, s.
    area: whether the finger may leave its line over an area.
    turning: what is added to `errors` while the finger turns over an area.
    """

    contact: Contact
    mean: Mean
    heaviest: float
    band: float
    finer: int
    rate: float
    fastest: float
    loads: tuple[float, ...]
    errors: tuple[float, ...]
    solution_seconds: float
    area: bool
    turning: tuple[float, ...]

    @property
    def work(self) -> float:
        """Measured processor time of a second of sound, s."""
        return self.rate * self.solution_seconds

    @property
    def memory_bytes(self) -> int:
        """Memory of the contact, in bytes."""
        return self.contact.grid.nbytes + 4096


def follows_path(scene: Scene) -> bool:
    """Return whether a hand can lead the finger of `scene` over an area and turn it.

    The texture must vary across. No effect may replace the response by a simulation, which knows one line only.
    """
    return isinstance(profile_of(scene), HeightField) and not any(asked_effects(scene, Kind.BALANCE))


def over_area(asked: Request) -> bool:
    """Return whether the finger may leave the line of the scan: on a path over an area, or led by a hand."""
    return asked.area or not asked.scene.scan.along_x


def beyond_table(asked: Request, contact: Contact) -> bool:
    """Return whether a moving voice of the request is solved directly on `contact`, by the rule of this module."""
    scene = asked.scene
    if asked.stretch is not None or over_area(asked):
        return True
    if predicted_work(scene, contact) > MOST_WORK:
        return False
    if any(effect.has_table for effect, _settings in outputs_of(scene)):
        return False
    most = bounds_for(scene).harmonics
    return harmonics_in_band(scene, most + 1) > most


def predicted_work(scene: Scene, contact: Contact) -> float:
    """Return the predicted processor time (s) of a second of a voice that solves `contact` along its motion."""
    rate = min(SOLUTIONS * band_of(scene), scene.output.sample_rate)
    cell = EXACT_CELL * (OVER_AREA if isinstance(contact.geometry.profile, HeightField) else 1.0)
    return 1e-9 * cell * contact.grid.cells * rate


def affordable(scene: Scene) -> Contact:
    """Return the contact of `scene` over an area, with points so far apart that a voice takes MOST_WORK, if it can."""
    coarsest = contact_of(scene, coarser=COARSER[-1])
    work = predicted_work(scene, coarsest) * COARSER[-1] ** 2
    return contact_of(scene, coarser=next((one for one in COARSER if work <= MOST_WORK * one**2), COARSER[-1]))


def direct_plan(
    asked: Request, contact: Contact, whole: Contact, cache: ResponseCache, tolerance: float | None = None
) -> DirectPlan:
    """Return how a voice of the request solves its scene directly.

    contact: contact of one period, on which the solver's segments are judged.
    whole: contact of the whole surface, which is solved.
    tolerance: largest error, with more solutions where they are needed. None: the usual number.
    """
    scene, heaviest, (low, high) = asked.scene, bounds_for(asked.scene).heaviest, asked.told_loads
    loads = min(low, HAND_LOADS[0]), scene.scan.load, max(high, HAND_LOADS[1])
    judged = tuple(max(load, scene.scan.lift_load) for load in loads)
    fastest = max(ScanMotion(scene).fastest(), HAND_SPEEDS[1])
    told = (scene.output.sample_rate, band_of(scene), fastest, judged, heaviest, tolerance)
    area = over_area(asked)
    key: Hashable = ("direct plan", contact.key, whole.key, area, *told)
    return cache.get(key, lambda: _planned(contact, whole, area, *told))


def _planned(
    contact: Contact,
    whole: Contact,
    area: bool,
    rate: int,
    band: float,
    fastest: float,
    loads: tuple[float, ...],
    heaviest: float,
    tolerance: float | None,
) -> DirectPlan:
    averaged: Callable[..., Mean] = mean_over_area if area else mean_curve
    turning = np.zeros(len(QUANTITIES))
    missed = AREA_MEAN_TOLERANCE if area else MEAN_TOLERANCE
    mean = averaged(whole, (0.0, heaviest), loads[1], missed, PLACES, MEANS)
    swing = Swing(SOLUTIONS * band, band, fastest, PATH_SLOPE if area else 0.0)
    folded, seconds = _folded(whole, swing, loads)
    judged, finer = contact.refined(), 1
    if area:
        turning = turning_errors(whole, replace(swing, seconds=TURNED), loads[1])
        judged = _of_file(whole)
    coarse = _changed(whole if area else contact, judged, swing, loads[1])
    while True:
        filters = [band_filter(quantity, rate, band, finer) for quantity in QUANTITIES]
        steps = rate / filters[0].stride
        left = (SOLUTIONS * band / steps) ** FOLD_POWER
        parts = zip(folded, coarse, filters, strict=True)
        errors = tuple(left * fold + segment + one.error for fold, segment, one in parts)
        if tolerance is None or max(errors) <= tolerance or filters[0].stride == 1:
            told = tuple(turning.tolist())
            return DirectPlan(whole, mean, heaviest, band, finer, steps, fastest, loads, errors, seconds, area, told)
        finer *= 2


@dataclass(frozen=True, slots=True)
class Swing:
    """A finger that swings by a cosine, solved at twice the usual rate.

    rate: usual number of solutions per second.
    band: Hz.
    fastest: largest speed, m/s.
    across: by how much farther than along x it swings across, on a path over an area.
    seconds: duration of a swing, s.
    """

    rate: float
    band: float
    fastest: float
    across: float = 0.0
    seconds: float = SWING

    @property
    def steps(self) -> int:
        """Number of solutions, even."""
        return 2 * math.ceil(self.seconds * self.rate)

    def heights(self, contact: Contact, load: float, begin: float, turned_by: float = 0.0) -> Array:
        """Return z (m) of `contact` at `load` (N) over a swing that begins at `begin` (turns).

        turned_by: angle of the finger from its line, on a path over an area, rad.
        """
        reach = self.seconds * self.fastest / (2.0 * math.pi * math.hypot(1.0, self.across))
        turned = np.asarray(reach * np.cos(2.0 * math.pi * np.arange(self.steps) / self.steps))
        phases, loads = begin + turned / contact.geometry.texture_period, np.full(self.steps, load)
        if not self.across:
            return contact.heights(phases, loads)
        over: Any = contact
        direction = np.full(self.steps, over.line.direction + turned_by)
        return np.asarray(over.heights(phases, loads, np.stack([self.across * turned, direction])))

    def curves(self, z: Array) -> Array:
        """Return z and its two time derivatives in the band, without the mean, SI [3, steps]."""
        series = np.fft.rfft(z)
        hertz = np.arange(len(series)) / self.seconds
        series[hertz > self.band] = series[0] = 0.0
        orders = np.arange(len(QUANTITIES))[:, np.newaxis]
        return np.asarray(np.fft.irfft(series * (2j * math.pi * hertz) ** orders, len(z)))


def _folded(contact: Contact, swing: Swing, loads: tuple[float, ...]) -> tuple[Array, float]:
    """Return what folds into the band of each quantity at the usual rate, and the time of a solution (s).

    The first is relative to the peak-to-peak at the same load, or at the scan's own load where that is larger.
    """
    changed, extents, seconds = [], [], 0.0
    for number, load in enumerate(loads):
        contact.heights(np.zeros(1), np.full(1, load))  # what the first call prepares is no part of the time
        started = thread_time()
        z = swing.heights(contact, load, (number + 0.5) / len(loads))
        seconds = max(seconds, (thread_time() - started) / swing.steps)
        fine = swing.curves(z)
        changed.append(np.max(np.abs(fine[:, ::2] - swing.curves(z[::2])), axis=1))
        extents.append(np.ptp(fine, axis=1))
    parts = relative(np.array(changed), np.maximum(extents, extents[1]))
    return MORE_FOLDS * np.max(parts, axis=0), seconds


def _changed(contact: Contact, better: Contact | None, swing: Swing, load: float) -> Array:
    """Return the change of each quantity from `contact` to `better`, relative to its peak-to-peak; 0 without one."""
    if better is None:
        return np.zeros(len(QUANTITIES))
    before, after = (swing.curves(swing.heights(one, load, 0.5)) for one in (contact, better))
    return relative(np.max(np.abs(after - before), axis=1), np.ptp(after, axis=1))


def _of_file(contact: Any) -> Contact | None:
    """Return a contact over an area with the points of a file; None where it has them."""
    return None if contact.coarser == 1.0 else coarsened(contact, 1.0)


def turning_errors(contact: Any, swing: Swing, load: float) -> Array:
    """Return the error of each quantity halfway between two directions of a finger, relative to its peak-to-peak."""
    half = 0.5 * turn_step(contact)
    between = swing.curves(swing.heights(contact, load, 0.5, half))
    exact = swing.curves(swing.heights(turned(contact, half), load, 0.5))
    return relative(np.max(np.abs(between - exact), axis=1), np.ptp(exact, axis=1))


def relative(change: Array, extent: Array) -> Array:
    """Return `change` / `extent`, 0 where the extent is 0."""
    return np.asarray(np.divide(change, extent, where=extent > 0.0, out=np.zeros_like(extent)))
