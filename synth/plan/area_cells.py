"""Choose the size of the cells over an area where the own motion of a file does not choose it.

Stage   2 (PLAN).
Model   For a simulation, a long surface and a force, a finger swings over the area as `swing.Swing` does, at the
        largest speed of the scan and at its load. The cells are halved until their remaining error, by the change when
        they are halved, is DISCRETE_SHARE of the tolerance, or until smaller ones would take more than MOST_WORK. A
        live voice along a line keeps the usual cells and reports their error, over an area and where they cannot be
        halved by the change from cells twice as large.
Source  design, section 4.
Limits  The swing is short, and along one line of the area.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.kept_files import json_form
from synth.motion.scan_motion import ScanMotion
from synth.plan.direct_plan import PATH_SLOPE
from synth.plan.live_work import LEFT_OF_CHANGE
from synth.plan.request import HAND_SPEEDS, Request
from synth.plan.scene_table import entry_of
from synth.plan.swing import Swing, changed_by
from synth.response.demand import Demand, harmonics_of, points_for
from synth.response.discretisation import DISCRETE_SHARE, FIRST_ORDER, changes, remaining
from synth.response.table_error import QUANTITIES
from synth.response_cache import ResponseCache
from synth.sampling.band_filter import SOLUTIONS

SECONDS = 0.05  # of the swing: at 80 mm/s it covers 1.3 mm
SHORT, BEGINS = 0.03, (0.1, 0.5, 0.8)  # length (s) and middle phases (turns) of the swings on which cells are judged
UNSEEN = 2.0  # the error of cells along a path over that on the swings: in 28 random scenes it was up to 2.2
MOST_WORK = 10_000  # per place, in cells of the exact solver: 0.6 ms; a second of sound then takes 10 s


@dataclass(frozen=True, slots=True)
class CellErrors:
    """Errors of displacement, velocity and acceleration by the cells of a contact, relative to the peak-to-peak."""

    errors: tuple[float, ...]


CELLS_FORM = json_form(asdict, lambda fields: CellErrors(tuple(fields["errors"])))


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

    def found() -> CellErrors:
        """Return the change between two sizes of the cells, as the error that it leaves."""
        area, phases = contact.geometry.over_area, points_for(highest)
        pair = (contact.doubled(), contact) if area or (smaller := contact.halved()) is None else (contact, smaller)
        theta, demand = np.arange(phases) / phases, Demand(highest, tuple(range(len(QUANTITIES))), 0.0)
        before, after = (harmonics_of(one.approach(theta, load)[0], highest) for one in pair)
        changed, _allowed = changes(before, after, demand, contact.scale_at(load))
        left = 1.0 / (1.0 - FIRST_ORDER)  # one change cannot show a faster fall
        if pair[1] is contact:
            left = LEFT_OF_CHANGE if area else 1.0
        return CellErrors(tuple(left * one for one in changed))

    key: tuple[Any, ...] = ("cells along the line", contact.key, load, highest)
    return np.array(cache.get(key, found, partial(entry_of, scene, contact, key[2:], CELLS_FORM)).errors)


def beside_cells(tolerance: float, cells: Array) -> float:
    """Return the part of `tolerance` for the other errors of a file; cells: as of `cells_along_path`."""
    return tolerance - min(float(np.max(cells)), DISCRETE_SHARE * tolerance)
