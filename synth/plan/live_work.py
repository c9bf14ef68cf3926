"""The work of a voice that solves its contact live, and the cells or columns with which it keeps its deadlines.

Stage   2 (PLAN), used by `contact_choice` and `direct_plan`.
Model   Over an area solutions of a turned finger may take MOST_TURNED. If they would take more, the cells are enlarged,
        up to the last factor of COARSER. Along a line the columns of a fingertip are, by COARSER_ON_LINE.
Source  design, section 8. Times are those of `frame_solver`.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from functools import partial

from synth.contact.load_balance import Contact
from synth.contact.scene_contact import contact_of
from synth.kept_files import json_form
from synth.plan.frame_plan import solution_nanoseconds
from synth.plan.scene_table import band_of, entry_of
from synth.response_cache import ResponseCache
from synth.sampling.band_filter import SOLUTIONS
from synth.scene.scene import Scene
from synth.surfaces.profile import Profile

LEFT_OF_CHANGE = 0.7  # error of cells over the change by cells twice as large: up to 0.57 in 20 random scenes of dots
FEWER = 0.5  # factor on the usual number of solutions over an area, where z is smoother, if FOLDED permits it
COARSER = (1.0, 1.5, 2.0, 3.0)  # factors on the size of the cells of an area
MOST_TURNED = 0.16  # predicted s per second for a finger turned over an area, at 1.8 N; at 0.3 N it takes half of it
# Factors on the distances of a fingertip's columns, and the predicted s per second up to which each is taken. At 3 a
# smooth texture may have noise as loud as itself.
COARSER_ON_LINE = ((1.0, 0.1), (2.0, 0.22))
SPREAD_FORM = json_form(asdict, lambda fields: Spread(fields["coarser"]))


def predicted_work(scene: Scene, contact: Contact) -> float:
    """Return the predicted processor time (s) of a second of a voice that solves `contact` along its motion."""
    rate = min(least_solutions(contact) * SOLUTIONS * band_of(scene), scene.output.sample_rate)
    return 1e-9 * solution_nanoseconds(contact) * rate


@dataclass(frozen=True)
class Spread:
    """Factor on the size of a finger's cells over an area, as `affordable` has chosen it."""

    coarser: float


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

    def chosen() -> Spread:
        """Return the least factor on the usual distances."""
        work = predicted_work(scene, fine)
        return Spread(next((one for one, most in limits if work <= most), limits[-1][0]))

    key_parts = scene.output.sample_rate, band_of(scene)
    file = partial(entry_of, scene, fine, key_parts, SPREAD_FORM)
    spread = cache.get(("spread", fine.key, key_parts), chosen, file) if over else chosen()
    return fine if spread.coarser == 1.0 else contact_of(scene, profile, spread.coarser)
