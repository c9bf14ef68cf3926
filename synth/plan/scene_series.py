"""The series of z that a scene needs: its harmonics, its tolerance, and the contact in the shape of its effects.

Stage   2 (PLAN), used by `prepare`.
Source  design, section 4.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from synth.arrays import Array
from synth.contact.load_balance import Contact
from synth.effects.effect import Kind
from synth.perception.threshold import imperceptible_tolerance
from synth.plan.channels import SMALLEST_MOTION, spendable
from synth.plan.effect_choice import asked as asked_effects
from synth.plan.effects_preparation import PreparedEffects, shape_for
from synth.plan.mean_choice import pressed
from synth.plan.request import Request
from synth.plan.scene_table import entry_of
from synth.response.demand import Demand, curves, points_for
from synth.response.discretisation import fine_enough
from synth.response.spectrum import SPECTRUM_FORM, Spectrum, solve_spectrum
from synth.response.table_error import QUANTITIES
from synth.response.table_making import HEAVIEST
from synth.response_cache import ResponseCache

SERIES_SHARE = 0.7  # part of the tolerance of a scan that moves or is simulated; landings, steps and points: the rest
TIGHTEST, LOOSEST = 1e-7, 3e-2  # range of the tolerance for "imperceptible", which is the range of accuracy.tolerance
OF_LEVELS = 2e-2  # least tolerance of a series that gives only the levels of a live voice


def shaped_contact(
    asked: Request, contact: Contact, tolerance: float, left: float
) -> tuple[Contact, PreparedEffects | None, Demand, Array]:
    """Return the contact in the shape that the scene's effects give it, the effects, and the demand on the series.

    The last value is the error of each quantity by segments or columns of a simulation that no series tells.

    tolerance: that of the scene; left: the part of it that the cells of the contact leave.
    """
    scene, loads, shapes, errors = asked.scene, asked.loads, None, np.zeros(len(QUANTITIES))
    if scene.effects:
        demand = Demand(max(asked.highest, 1), asked.orders, left)
        contact, shapes = shape_for(contact, scene, demand, loads, asked.turns, tolerance)
        contact.geometry_at(max(*loads, scene.scan.lift_load))  # raises if the contact is too long at this load
    left = series_tolerance(asked, left)
    simulated = any(asked_effects(scene, Kind.BALANCE))
    share = SERIES_SHARE if asked.moving or simulated else 1.0
    still = 0.0 if asked.live and asked.moving else SMALLEST_MOTION
    slower = 0 if asked.load_varies else asked.reach
    demand = Demand(max(asked.highest, 1), asked.orders, share * spendable(left), still, slower)
    long = asked.stretch is not None
    # the making of a table refines it
    if simulated or ((asked.load_varies or long) and not asked.live):
        usual, ends = pressed(scene), (0.0, HEAVIEST) if asked.by_hand else loads
        judged = tuple(sorted({max(load, scene.scan.lift_load) for load in (*ends, usual)}))
        contact, found = fine_enough(contact, judged, usual, demand)
        if simulated and asked.moving:
            errors[list(asked.orders)] = found
    return contact, shapes, demand, errors


def series_tolerance(asked: Request, tolerance: float) -> float:
    """Return the tolerance of the series where the rest of the request has `tolerance`.

    A live voice that moves has only its levels from the series: it reads a table, or solves along its motion.
    """
    return max(tolerance, OF_LEVELS) if asked.live and asked.moving else tolerance


def series_of(asked: Request, contact: Contact, demand: Demand, cache: ResponseCache) -> Spectrum:
    """Return the series of z that meets `demand`, at the load of the request."""
    what = pressed(asked.scene), demand, asked.kept
    solve = partial(solve_spectrum, contact, *what)
    found = cache.get(
        ("spectrum", contact.key, *what), solve, partial(entry_of, asked.scene, contact, what, SPECTRUM_FORM)
    )
    given = all(one.full_scale for one in asked.scene.output.channel_list)
    if given and demand.of_still(found.harmonics):  # a given full scale keeps it heard
        return series_of(asked, contact, replace(demand, still=0.0), cache)
    return found


def imperceptible(contact: Contact, asked: Request) -> float:
    """Return the tolerance at which the error of the harmonics is not felt. `contact` is without effects on shape."""
    spectrum = solve_spectrum(contact, pressed(asked.scene), Demand(asked.highest, asked.orders, 1e-2))
    turns, tolerance = abs(asked.turns), LOOSEST
    harmonics = np.arange(1, len(spectrum.harmonics)) * max(turns, 1e-9)
    for order in asked.orders:
        extent = float(np.ptp(curves(spectrum.harmonics, order, points_for(len(spectrum.harmonics) - 1))))
        felt = imperceptible_tolerance(harmonics, order, extent * turns**order, asked.scene.accuracy.threshold)
        tolerance = min(tolerance, felt)
    return max(tolerance, TIGHTEST)
