"""The peaks of each quantity along a scan's own motion, and the mean of z that displacement leaves out.

Stage   2, used by `preparation`.
Model   Where the peaks along the motion are not those of the steady scan, `motion_peak` finds them. On a long surface
        the peaks of displacement and approach are those at PLACES places.
Source  design, section 4.
Limits  A peak between two of the places is missed.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from synth.contact.load_balance import Contact
from synth.plan.channels import APPROACH, SteadyScan
from synth.plan.direct_plan import AREA_MEAN_TOLERANCE, MEAN_TOLERANCE, over_area
from synth.plan.direct_plan import MEANS as AREA_MEANS
from synth.plan.direct_plan import PLACES as AREA_PLACES
from synth.plan.frame_solver import WITH_MEAN, FramePlan
from synth.plan.landing import at_landings
from synth.plan.motion_peak import OVERSAMPLING, differs_from_cruise, peaks_along
from synth.plan.request import Request, harmonics_in_band
from synth.response.mean_approach import Mean, mean_curve, mean_over_area
from synth.response.series_curve import SeriesCurve
from synth.scene.scene import Scene
from synth.surfaces.height_field import HeightField

MEAN_SHARE = 50.0  # times the tolerance: the costly mean on a line over an area, whose error is then a twentieth of it
OF_ACCELERATION = 0.03  # part of the tolerance that the mean keeps for it, since a load may pass its knots quickly
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
        frames = at_landings(asked, frames, contact, mean, tolerance)
    if all(channel.full_scale for channel in listed) or not (approach or differs):
        return mean, frames, peaks, ""
    known = tuple(sorted({0, *asked.orders, *({WITH_MEAN} if approach else ())}))
    of_series = not (asked.live or asked.load_varies or long or over_area(asked))  # as `voice.solved_frames` reads it
    read = SeriesCurve(asked.spectrum.harmonics).heights if of_series else None
    count = OVERSAMPLING if frames is None else frames.count
    found, warning = peaks_along(contact, scene, mean, known, series, read, count=count, whole=asked.live)
    return mean, frames, dict(zip(known, found.tolist(), strict=True)), warning


def own_mean(asked: Request, contact: Any, tolerance: float) -> Mean:
    """Return the mean of z that the displacement of the request leaves out; `tolerance` is that of the scene."""
    if over_area(asked):
        return mean_over_area(contact, asked.loads, pressed(asked.scene), AREA_MEAN_TOLERANCE, AREA_PLACES, AREA_MEANS)
    if isinstance(contact.geometry.profile, HeightField):
        tolerance = min(max(MEAN_SHARE * tolerance, MEAN_TOLERANCE), AREA_MEAN_TOLERANCE)
        return mean_curve(contact, asked.loads, pressed(asked.scene), tolerance, AREA_PLACES, AREA_MEANS)
    part = OF_ACCELERATION if 2 in asked.orders else 1.0
    return mean_curve(contact, asked.loads, pressed(asked.scene), part * tolerance)


def has_approach(scene: Scene) -> bool:
    """Return whether a channel is z itself, which is not 0 where the finger does not move."""
    return any(channel.quantity == APPROACH for channel in scene.output.channel_list)


def pressed(scene: Scene) -> float:
    """Return the load (N) at which the response of `scene` is solved: for a finger that pulls, the lift load."""
    return scene.scan.load if scene.scan.load > 0.0 else scene.scan.lift_load
