"""Make the stepper of a simulation: a table of the energy or points of skin, and the pulp that carries the contact.

Stage   2, used by `simulation_plan`.
Model   The force of a spring, with or without adhesion, depends only on the positions, so a table of its energy
        represents it. Under a round finger the table spans what the heaviest load touches, and serves all lighter ones.
        A viscous skin has a memory at every place, so points of the skin are simulated. So is a contact whose ends
        move with the load, which would need another table at every load, and a finger that leaves its line or turns
        over an area, which would need one in every direction.
        Displacement is relative to the mean of the quasi-static z over a period, at the present load. The pulp is at
        rest there too. Without skin and adhesion, that mean is read from the table. It is therefore the mean of the
        simulated z even below the table, where the table continues as a straight line.
Source  design, section 4.
Limits  The table of a hand covers loads from LIGHTEST to HEAVIEST_HAND with its tolerance. `EnergyTable.error` reports
        its error.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from synth.contact.area_path import ContactOnArea
from synth.contact.load_balance import Contact
from synth.effects.simulation.pulp import NO_PULP, Pulp, attracted_mean
from synth.effects.simulation.steps import Stepper, StiffnessLaw
from synth.effects.simulation.terms import ELASTIC, Terms
from synth.plan.effect_choice import MEAN_PHASES, SimulationCase, outputs_of
from synth.plan.request import N_MAX, harmonics_in_band
from synth.response.mean_approach import MEAN_PHASES as MEAN_PLACES
from synth.response.mean_approach import Mean, heights_of_mean, mean_of
from synth.surfaces.height_field import HeightField

HEAVIEST_HAND = 5.0  # N, least upper end of a hand's loads; above that end the contact is linear, as if all touched
HAND_MEAN = 0.1  # tolerance of the mean of z over a hand's load, which a hand never repeats exactly
HAND_PLACES = 128  # for that mean: 512 change it by at most 1e-4 of the peak-to-peak from 0.05 N on, 4e-4 at 1 mN
LIGHTEST = 0.01  # N, smallest load of the table for a varying load
TABLE_SHARE = 0.2  # error of the table, as a part of the tolerance
BELOW = 0.1  # of a1 + a2: how much more a finger over an area may sink, since z is known at some places only
PULLS = 2  # a round finger that is pulled deeper is longer, and then pulled a little more
LOOSEST_TABLE, TIGHTEST_TABLE = 1e-3, 1e-5  # of z: derivatives need a tighter one; beyond the tightest it takes seconds


def point_stepper(case: SimulationCase, terms: Terms, points: int, mean: Mean | None = None) -> tuple[Stepper, Mean]:
    """Return the stepper of `case` with `terms` and some `points` points, and the mean of z without skin.

    mean: the latter, if known.
    """
    from synth.effects.simulation.skin_points import WHOLE, SkinPoints, Span  # import only what the scene needs
    from synth.effects.simulation.skin_steps import SkinStepper

    _lightest, heaviest = _loads_covered(case)
    contact, pull, reach, sunk = _attraction(case, terms, heaviest)
    mean = mean or _exact_mean(case)
    stiffness = StiffnessLaw.of(contact, heaviest, case.scene.scan.lift_load)
    if contact.of_one_line:
        found = SkinPoints.of_contact(contact, heaviest, points)
    else:
        assert isinstance(contact, ContactOnArea)
        found = SkinPoints.over_area(contact, _lowest(contact, heaviest) - sunk, points)
    forces, span = slope_forces(case), Span.of(contact, heaviest) if case.load_varies else WHOLE
    stepper = SkinStepper(
        found, terms.skin or ELASTIC, stiffness, terms.mass, terms.damping, forces, NO_PULP, span, pull, reach or 1.0
    )
    if pull > 0.0:
        return _on_attracted_pulp(case, terms, stepper), mean
    return replace(stepper, pulp=_resting(case, terms, mean)), mean


def slope_forces(case: SimulationCase) -> int:
    """Return how many components of the slope force the outputs of `case` read: along y only over an area."""
    outputs = outputs_of(case.scene)
    over_area = case.contact.geometry.over_area
    return int(bool(outputs)) + int(over_area and any(effect.reads_across(settings) for effect, settings in outputs))


def table_stepper(case: SimulationCase, terms: Terms, finer: float = 1.0) -> tuple[Stepper, Mean]:
    """Return the stepper of `case` with `terms` on a table of the energy, and the mean of z without adhesion.

    Without adhesion the mean is read from the table, so it is also the mean of the simulated z.

    finer: the usual tolerance of the table over its own.
    """
    from synth.effects.simulation.energy_table import EnergyTable
    from synth.effects.simulation.table_steps import TableStepper

    load, forces, (lightest, heaviest) = case.pressed, bool(outputs_of(case.scene)), _loads_covered(case)
    contact, pull, reach, sunk = _attraction(case, terms, heaviest)
    stiffness = StiffnessLaw.of(contact, heaviest, case.scene.scan.lift_load)
    exact = LOOSEST_TABLE if case.by_hand else table_tolerance(case, finer)
    held = harmonics_in_band(case.scene, N_MAX)
    table = EnergyTable.of(contact, load, lightest, heaviest, sunk, reach, exact, harmonics=held, live=case.live)
    period = contact.geometry.texture_period
    stepper = TableStepper(table, stiffness, terms.mass, terms.damping, pull, reach, period, forces)
    if pull > 0.0:
        return _on_attracted_pulp(case, terms, stepper), _exact_mean(case)
    ends = (stiffness.lightest, max(case.loads[1], load)) if case.load_varies else (load, load)
    mean = mean_of(stepper.heights, ends, load, _mean_tolerance(case))
    return replace(stepper, pulp=_resting(case, terms, mean)), mean


def table_tolerance(case: SimulationCase, finer: float) -> float:
    """Return the tolerance of the table of a scan; finer: as of `table_stepper`."""
    return max(min(TABLE_SHARE * case.tolerance, LOOSEST_TABLE) / finer, TIGHTEST_TABLE)


def _attraction(case: SimulationCase, terms: Terms, heaviest: float) -> tuple[Contact, float, float, float]:
    """Return the contact over all loads up to `heaviest` (N), and the attraction of `terms`.

    That is the pull if everything touches (N), its reach (m), and how much deeper the contact then is (m). Its width is
    that at the load of the scan, or at `heaviest` if the load moves the ends of the contact.
    """
    load, contact = case.pressed, case.contact.over_loads(heaviest)
    if terms.adhesion is None:
        return contact, 0.0, 0.0, 0.0
    at = heaviest if case.load_varies and not contact.of_one_surface else load
    reach = terms.adhesion.reach
    for _ in range(PULLS):
        pull = terms.adhesion.stress * contact.width_at(at) * contact.geometry_at(at).contact_length
        sunk = reach + _sunk(contact, load, heaviest, pull)
        contact = case.contact.over_loads(heaviest, sunk)
    pull = terms.adhesion.stress * contact.width_at(at) * contact.geometry_at(at).contact_length
    return contact, pull, reach, sunk


def _on_attracted_pulp(case: SimulationCase, terms: Terms, stepper: Any) -> Any:
    """Return `stepper`, whose surfaces attract, on the pulp of `terms`: at rest at the mean of z with adhesion."""
    if terms.pulp == 0.0:
        return stepper
    ends = (min(case.loads[0], -stepper.pull), case.loads[1]) if case.load_varies else (case.load, case.load)
    return replace(stepper, pulp=Pulp(terms.pulp, attracted_mean(stepper.at_rest, *ends)))


def _lowest(contact: Any, heaviest: float) -> float:
    """Return the height (m) of a finger over an area above which it can touch at `heaviest` (N).

    As the table of the energy does, points allow for a peak-to-peak below the lowest z.
    """
    texture = contact.geometry.profile
    assert texture is not None
    heights = heights_of_mean(contact, across=isinstance(texture, HeightField))
    z = heights(np.arange(MEAN_PHASES) / MEAN_PHASES, heaviest)
    return float(np.min(z) - np.ptp(z) - texture.extent[1] - BELOW * contact.geometry.height_scale)


def _loads_covered(case: SimulationCase) -> tuple[float, float]:
    """Return the lightest and the heaviest load (N) that are simulated exactly, the scan's own between them."""
    # a landing or lifting finger passes lighter loads than these only briefly
    low, high = (LIGHTEST, max(HEAVIEST_HAND, 4.0 * case.pressed)) if case.by_hand else case.loads
    return min(max(low, LIGHTEST), case.pressed), max(high, case.pressed)


def _exact_mean(case: SimulationCase) -> Mean:
    """Return the mean of z of the contact of `case`, without adhesion, at its loads."""
    low, high = case.loads
    between = (max(low, 0.0), max(high, case.pressed)) if case.load_varies else (case.pressed, case.pressed)
    if case.mean is not None and between == case.loads:
        return case.mean
    places = HAND_PLACES if case.by_hand else MEAN_PLACES
    return mean_of(heights_of_mean(case.contact), between, case.pressed, _mean_tolerance(case), places)


def _mean_tolerance(case: SimulationCase) -> float:
    return max(case.tolerance, HAND_MEAN * case.by_hand)


def _resting(case: SimulationCase, terms: Terms, mean: Mean) -> Pulp:
    """Return the pulp of `terms`, at rest at `mean`."""
    return Pulp(terms.pulp, mean if case.load_varies and terms.pulp > 0.0 else float(mean(np.zeros(1))[0]))


def _sunk(contact: Contact, load: float, heaviest: float, pull: float) -> float:
    """Return the largest additional depth (m) of the contact of `load` (N) if `pull` (N) is added to `heaviest` (N).

    It is larger than the additional mean indentation, because only a part of the length touches.
    """
    phases, stiffness = np.arange(MEAN_PHASES) / MEAN_PHASES, contact.stiffness_at(heaviest)
    solver = contact.solver(load)
    pressed, pulled = (solver.solve(phases, force / stiffness).height for force in (heaviest, heaviest + pull))
    return float(np.max(pressed - pulled))
