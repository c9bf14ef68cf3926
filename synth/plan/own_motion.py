"""The peaks of each quantity along a scan's own motion, and the mean of z that displacement leaves out.

Stage   2, used by `preparation`.
Model   The quickest landing or lift of a recording is solved, and what its steps leave is part of the errors. The
        others leave as much at most, or what is allowed.
        Where the peaks along the motion are not those of the steady scan, `motion_peak` finds them. On a long surface
        the peaks of displacement and approach are those at PLACES places.
Source  design, section 4.
Limits  A peak between two of the places is missed.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.contact.load_balance import Contact
from synth.plan.channels import APPROACH, SteadyScan, extent_and_peak
from synth.plan.direct_plan import AREA_MEAN_TOLERANCE, MEAN_TOLERANCE, over_area
from synth.plan.direct_plan import MEANS as AREA_MEANS
from synth.plan.direct_plan import PLACES as AREA_PLACES
from synth.plan.frame_solver import FOLDED_SHARE, PATIENCE, WITH_MEAN, FramePlan, FrameSolver
from synth.plan.landing import MOST_FINER, quickest
from synth.plan.motion_peak import differs_from_cruise, peaks_along
from synth.plan.request import Request, harmonics_in_band
from synth.response.mean_approach import Mean, mean_curve, mean_over_area
from synth.response.series_curve import SeriesCurve
from synth.scene.scene import Scene
from synth.surfaces.height_field import HeightField

MEAN_SHARE = 50.0  # times the tolerance: the costly mean on a line over an area, whose error is then a twentieth of it
OF_ACCELERATION = 0.03  # least part of the tolerance that the mean keeps for it: a load may pass its knots quickly
OF_LINES = 50.0  # that part, times the square of the band in lines of the texture: what is heard of a knot at most
PLACES = 512  # places of a long surface at which the peaks of displacement and approach are computed


def own_motion(
    asked: SteadyScan, series: Contact, contact: Contact, tolerance: float, frames: FramePlan | None
) -> tuple[Mean | None, FramePlan | None, dict[int, float], str]:
    """Return the mean of z, the plan of the frames, the peak of each order along the own motion, and a warning or "".

    If the scan's own speed and load determine the peaks, the mean is None and only a long surface has peaks.

    series: contact of one period of the series; `contact` is on the whole surface.
    frames: how a file is solved, without its landings.
    """
    scene, listed = asked.scene, asked.scene.output.channel_list
    approach, long = has_approach(scene), asked.stretch is not None
    probed = np.arange(PLACES) / PLACES
    peaks = asked.peaks_over(contact.heights(probed, np.full(PLACES, pressed(scene)))) if long else {}
    still = bool(asked.silence(peaks)) or not harmonics_in_band(scene, 1)
    # in the turns more harmonics are in the band; a file is as loud as its own frames
    differs = still or not asked.live or differs_from_cruise(scene)
    if asked.by_hand or not asked.moving or not (approach or long or differs):
        return None, frames, peaks, ""
    mean = own_mean(asked, contact, tolerance)
    if frames is not None and scene.scan.trajectory is not None and asked.load_varies:
        frames = with_landings(asked, frames, contact, mean, tolerance)
    if all(channel.full_scale for channel in listed) or not (approach or differs):
        return mean, frames, peaks, ""
    known = tuple(sorted({0, *asked.orders, *({WITH_MEAN} if approach else ())}))
    of_series = not (asked.live or asked.load_varies or long or over_area(asked))  # as `voice.solved_frames` reads it
    read = SeriesCurve(asked.spectrum.harmonics).heights if of_series else None
    found, warning = peaks_along(contact, asked, mean, known, series, read, frames)
    return mean, frames, dict(zip(known, found.tolist(), strict=True)), warning


def with_landings(steady: SteadyScan, plan: FramePlan, contact: Contact, mean: Mean, tolerance: float) -> FramePlan:
    """Return `plan` with what a landing may leave of each quantity, and the error that the quickest one leaves.

    steady: a recording whose load varies, at its own speed and load.
    contact: on the whole surface.
    mean: mean of z over a period, as for `FrameSolver`.
    """
    scene, orders, place = steady.scene, steady.orders, quickest(steady.scene)
    if place is None:
        return plan
    rate, limit = scene.output.sample_rate, FOLDED_SHARE * tolerance
    most = max(2, min(MOST_FINER, math.floor(PATIENCE / (plan.work * scene.output.duration))))

    def at_place(allowed: Array) -> tuple[Array, Array]:
        """Return the frames about the place, and the error that is left, SI."""
        solver = FrameSolver(
            contact.heights, scene, mean, rate, count=plan.count, stride=plan.stride, scale=plan.scale, longest=0,
            landings=dict(zip(orders, allowed.tolist(), strict=True)), finer=most,
        )  # fmt: skip
        return solver.solved_with_error(math.floor(place * rate / solver.chunk), orders)

    extents = np.array([extent_and_peak(steady.series(order))[0] for order in orders])
    least = np.array([steady.least(order) for order in orders])
    if np.any(extents <= least):  # then the steady motion is no measure
        moved = np.ptp(at_place(np.full(len(orders), np.inf))[0], axis=1)
        own = np.where(extents <= least, np.maximum(moved, least), extents)
        if not own.all():
            return plan
        plan = replace(plan, errors=tuple((np.array(plan.errors) * np.maximum(extents, least) / own).tolist()))
        extents = own
    left = at_place(limit * extents)[1] / extents
    return replace(plan, allowed=tuple((limit * extents).tolist()), finer=most).with_errors(np.maximum(left, limit))


def own_mean(asked: Request, contact: Any, tolerance: float) -> Mean:
    """Return the mean of z that the displacement of the request leaves out; `tolerance` is that of the scene."""
    if over_area(asked):
        return mean_over_area(contact, asked.loads, pressed(asked.scene), AREA_MEAN_TOLERANCE, AREA_PLACES, AREA_MEANS)
    if isinstance(contact.geometry.profile, HeightField):
        tolerance = min(max(MEAN_SHARE * tolerance, MEAN_TOLERANCE), AREA_MEAN_TOLERANCE)
        return mean_curve(contact, asked.loads, pressed(asked.scene), tolerance, AREA_PLACES, AREA_MEANS)
    lines = asked.scene.output.band_limit / max(abs(asked.turns), 1e-9)
    part = min(max(OF_LINES / lines**2, OF_ACCELERATION), 1.0) if 2 in asked.orders else 1.0
    return mean_curve(contact, asked.loads, pressed(asked.scene), part * tolerance)


def has_approach(scene: Scene) -> bool:
    """Return whether a channel is z itself, which is not 0 where the finger does not move."""
    return any(channel.quantity == APPROACH for channel in scene.output.channel_list)


def pressed(scene: Scene) -> float:
    """Return the load (N) at which the response of `scene` is solved: for a finger that pulls, the lift load."""
    return scene.scan.load if scene.scan.load > 0.0 else scene.scan.lift_load
