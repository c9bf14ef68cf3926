"""Choose the size of the cells, or of the columns, in which the contact of a scene is solved.

Stage   2 (PLAN), used by `prepare`.
Model   A file takes what its tolerance requires. Over an area where it leaves its line or its load varies, `own_motion`
        halves the cells. For a simulation, a long surface and a force, a finger swings over the area as `swing.Swing`
        does, at the largest speed of the scan and at its load: the cells are halved until their remaining error, by the
        change when they are halved, is DISCRETE_SHARE of the tolerance, or until smaller ones would take more than
        MOST_WORK. Otherwise the series halves them. A voice with deadlines takes what it can solve in time
        (`direct_plan.affordable`), and tells the error: the change by halved cells, or, over an area and where they
        cannot be halved, that from cells twice as large.
Source  design, section 4.
Limits  The swing is short, and along one line of the area.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.contact.geometry import Geometry
from synth.contact.load_balance import Contact
from synth.contact.scene_contact import contact_of
from synth.effects.effect import Kind
from synth.kept_files import FileForm, json_form
from synth.motion.scan_motion import ScanMotion
from synth.plan.direct_plan import LEFT_OF_CHANGE, PATH_SLOPE, affordable
from synth.plan.effect_choice import asked as asked_effects
from synth.plan.request import HAND_SPEEDS, Request
from synth.plan.scene_table import entry_of
from synth.plan.swing import Swing, changed_by
from synth.response.demand import Demand, harmonics_of, points_for
from synth.response.discretisation import DISCRETE_SHARE, FIRST_ORDER, changes, remaining
from synth.response.reading_filter import SOLUTIONS
from synth.response.table_error import QUANTITIES
from synth.response_cache import ResponseCache

SECONDS = 0.05  # of the swing: at 80 mm/s it covers 1.3 mm
SHORT, BEGINS = 0.03, (0.1, 0.5, 0.8)  # length (s) and middle phases (turns) of the swings on which cells are judged
UNSEEN = 2.0  # the error of cells along a path over that on the swings: in 28 random scenes it was up to 2.2
MOST_WORK = 10_000  # per place, in cells of the exact solver: 0.6 ms; a second of sound then takes 10 s


CELLS_FORM: FileForm[tuple[float, ...]] = json_form(list, tuple)


def cells_along_path(
    asked: Request, contact: Any, tolerance: float, orders: tuple[int, ...] | None = None
) -> tuple[Any, Array]:
    """Return `contact`, or a force, in the cells of a file along a path, and the error of each quantity by the cells.

    A finger at rest swings at a usual speed of a hand.

    orders: of a force; None: those of the request.
    """
    scene, listed = asked.scene, list(asked.orders if orders is None else orders)
    load, fastest = max(scene.scan.load, scene.scan.lift_load), ScanMotion(scene).fastest() or HAND_SPEEDS[1]
    swing = Swing(SOLUTIONS * scene.output.band_limit, scene.output.band_limit, fastest, PATH_SLOPE, SHORT)
    if contact.halved() is None:
        return contact, UNSEEN * changed_by(contact.doubled(), contact, swing, load, BEGINS)
    left, earlier = np.zeros(len(QUANTITIES)), None
    while (smaller := contact.halved()) is not None:
        many = smaller.grid.cells > MOST_WORK
        if many and earlier is not None:
            break
        changed = tuple(changed_by(contact, smaller, swing, load, BEGINS).tolist())
        if many:
            return contact, np.array(changed) / (1.0 - smaller.settles)
        left = np.array(remaining(changed, earlier, smaller.settles))
        contact, earlier = smaller, changed
        if np.max(left[listed]) <= DISCRETE_SHARE * tolerance:
            break
    return contact, UNSEEN * left


def first_cells(contact: Any) -> Any:
    """Return `contact` in the cells that a file along a line halves first: larger ones if its own cannot be halved."""
    return contact.doubled() if contact.halved() is None else contact


def cells_along_line(asked: Request, contact: Any, cache: ResponseCache) -> Array:
    """Return the error of each quantity by the cells of a live voice along its line, from the change by halved cells.

    contact: over the area. The speed and load are those of the scan.
    """
    scene, highest = asked.scene, max(asked.highest, 1)
    load = max(scene.scan.load, scene.scan.lift_load)

    def found() -> tuple[float, ...]:
        """Return the change between two sizes of the cells, as the error that it leaves."""
        area, phases = contact.geometry.over_area, points_for(highest)
        pair = (contact.doubled(), contact) if area or (smaller := contact.halved()) is None else (contact, smaller)
        theta, demand = np.arange(phases) / phases, Demand(highest, tuple(range(len(QUANTITIES))), 0.0)
        before, after = (harmonics_of(one.approach(theta, load)[0], highest) for one in pair)
        changed, _allowed = changes(before, after, demand, contact.scale_at(load))
        left = 1.0 / (1.0 - FIRST_ORDER)  # one change cannot show a faster fall
        if pair[1] is contact:
            left = LEFT_OF_CHANGE if area else 1.0
        return tuple(left * one for one in changed)

    key: tuple[Any, ...] = ("cells along the line", contact.key, load, highest)
    return np.array(cache.get(key, found, partial(entry_of, scene, contact, key[2:], CELLS_FORM)))


def beside_cells(tolerance: float, cells: Array) -> float:
    """Return the part of `tolerance` for the other errors of a file; cells: as of `cells_along_path`."""
    return tolerance - min(float(np.max(cells)), DISCRETE_SHARE * tolerance)


def contact_in_cells(asked: Request, cache: ResponseCache, tolerance: float, *, file: bool) -> tuple[Contact, Array]:
    """Return the contact of the request, and the error of each quantity by its cells, where nothing later tells it.

    file: whether it takes the cells that `tolerance` requires, instead of those that can be solved in time.
    """
    none = np.zeros(len(QUANTITIES))
    if Geometry.of_scene(asked.scene).over_area:
        return _over_area(asked, cache, tolerance, none, file=file)
    return _on_line(asked, cache, none, file=file)


def shape_in_cells(
    asked: Request, cache: ResponseCache, tolerance: float, shaped: Any, cells: Array, *, file: bool
) -> tuple[Contact, Array]:
    """Return a contact in the shape that effects give it, and the error by its cells; on a line as they are.

    shaped, cells: the contact, and the error by the cells of the contact without the shape.
    """
    if not shaped.geometry.over_area or not any(asked_effects(asked.scene, Kind.SHAPE)):
        return shaped, cells
    none = np.zeros(len(QUANTITIES))
    if not file:
        return shaped, none if asked.area else cells_along_line(asked, shaped, cache)
    usual = replace(shaped, coarser=1.0)
    if _at_places(asked):
        found: tuple[Contact, Array] = cells_along_path(asked, usual, tolerance)
        return found
    return usual if asked.over_area or asked.load_varies else first_cells(usual), none


def _at_places(asked: Request) -> bool:
    """Return whether a file over an area is solved at points, or at places of a long surface under one load."""
    own = asked.over_area or asked.load_varies
    return any(asked_effects(asked.scene, Kind.BALANCE)) or (asked.stretch is not None and not own)


def _over_area(
    asked: Request, cache: ResponseCache, tolerance: float, none: Array, *, file: bool
) -> tuple[Contact, Array]:
    scene, stretch = asked.scene, None if asked.stretch is None else asked.stretch.profile
    if not file:
        contact = affordable(scene, cache, stretch) if asked.area else contact_of(scene, stretch)
        return contact, none if asked.area else cells_along_line(asked, contact, cache)
    if _at_places(asked):
        return cells_along_path(asked, contact_of(scene, stretch), tolerance)
    if asked.over_area or asked.load_varies:  # `own_motion` halves the usual cells
        return contact_of(scene, stretch), none
    contact = contact_of(scene, stretch, refines=True)
    return contact.doubled() or contact, none  # the first of two halvings shows how fast the error falls


def _on_line(asked: Request, cache: ResponseCache, none: Array, *, file: bool) -> tuple[Contact, Array]:
    scene, stretch = asked.scene, None if asked.stretch is None else asked.stretch.profile
    columns = scene.finger.traits.of_area  # of a fingertip
    if file:
        contact = contact_of(scene, stretch, refines=True)
        return first_cells(contact) if columns else contact, none
    contact = affordable(scene, cache, stretch) if asked.area or columns else contact_of(scene, stretch)
    simulated = any(asked_effects(scene, Kind.BALANCE))
    told = (asked.area or columns) and (not asked.moving or simulated)
    return contact, cells_along_line(asked, contact, cache) if told else none
