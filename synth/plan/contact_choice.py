"""Choose the size of the cells, or of the columns, in which the contact of a scene is solved.

Stage   2 (PLAN), used by `prepare`.
Model   A file takes what its tolerance requires. Over an area where it leaves its line or its load varies, `own_motion`
        halves the cells; where effects simulate it, `area_cells` has halved them; otherwise the series halves them. A
        voice with deadlines takes what it can solve in time (`direct_plan.affordable`), and its error is told.
Source  design, section 4.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.contact.geometry import Geometry
from synth.contact.load_balance import Contact
from synth.contact.scene_contact import contact_of
from synth.effects.effect import Kind
from synth.plan.area_cells import cells_along_line, cells_along_path, first_cells
from synth.plan.effect_choice import asked as asked_effects
from synth.plan.live_work import affordable
from synth.plan.request import Request
from synth.response.table_error import QUANTITIES
from synth.response_cache import ResponseCache


def contact_in_cells(asked: Request, cache: ResponseCache, tolerance: float, *, file: bool) -> tuple[Contact, Array]:
    """Return the contact of the request, and the error of each quantity by its cells, where nothing later tells it.

    file: whether it takes the cells that `tolerance` requires, instead of those that can be solved in time.
    """
    geometry, none = Geometry.of_scene(asked.scene), np.zeros(len(QUANTITIES))
    if geometry.over_area:
        return _over_area(asked, cache, tolerance, none, file=file)
    return _on_line(asked, cache, none, line=on_line(asked, geometry), file=file)


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


def on_line(asked: Request, geometry: Geometry) -> bool:
    """Return whether a fingertip, which has columns, is on a texture along a line."""
    return asked.scene.finger.traits.of_area and not geometry.over_area


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


def _on_line(asked: Request, cache: ResponseCache, none: Array, *, line: bool, file: bool) -> tuple[Contact, Array]:
    scene, stretch = asked.scene, None if asked.stretch is None else asked.stretch.profile
    if file:
        contact = contact_of(scene, stretch, refines=True)
        return first_cells(contact) if line else contact, none
    contact = affordable(scene, cache, stretch) if asked.area or line else contact_of(scene, stretch)
    simulated = any(asked_effects(scene, Kind.BALANCE))
    told = (asked.area or line) and (not asked.moving or simulated)
    return contact, cells_along_line(asked, contact, cache) if told else none
