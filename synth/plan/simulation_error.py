"""The errors of a simulation by its points, its table, and the start of its motion.

Stage   2 (PLAN), used by `simulation_plan`.
Model   An error is the change between two pilots, times what halving leaves of it.
"""

from __future__ import annotations

import math
from dataclasses import replace

from synth.effects.simulation.running import Simulation
from synth.plan.effect_choice import SimulationCase
from synth.plan.pilot_run import Pilot, is_heavy, run_pilot, started

LEAST_SHARE = 0.3  # of the tolerance, for steps and points where the series needs nearly all of it
LEFT_BY_TABLE = 1.0  # error over the change by a table half as fine: derivatives of z gain one order, or less


def left_by_series(case: SimulationCase) -> float:
    """Return the part of the tolerance that the series of the contact without effects leaves, where it is read."""
    spent = 0.0 if case.known is None else max(case.known.errors)
    return max(case.tolerance - spent, LEAST_SHARE * case.tolerance)


def table_errors(case: SimulationCase, tried: Pilot) -> tuple[tuple[float, ...], tuple[Simulation, ...]]:
    """Return the error of each order by the table, from the change by a table half as fine, and these two simulations.

    The error is 0 without a table.
    """
    coarser = tried.simulation.stepper.coarser()
    if coarser is None or not tried.repeats:
        return (0.0,) * len(case.orders), ()
    other = started(replace(tried.simulation, stepper=coarser), case)
    errors = tuple(LEFT_BY_TABLE * one for one in tried.differs_from(other))
    return errors, (other.simulation, tried.simulation)


def start_errors(case: SimulationCase, tried: Pilot) -> tuple[float, ...]:
    """Return the estimated difference of each order between a constant scan's start and its later motion."""
    simulation, steady = tried.simulation, tried.simulation.steady
    if steady is not None:
        heavy = is_heavy(case, simulation.stepper.mass)
        later, factor = steady.later(simulation.stepper, case.highest, of_mass=heavy)
        others = [replace(simulation, steady=other) for other in later]
    else:
        memory = simulation.stepper.memory
        others = [replace(simulation, settling=2.0 * simulation.settling)]
        factor = 1.0 / -math.expm1(-simulation.settling / memory) if memory > 0.0 else 1.0
    differences = []
    for run in (run_pilot(other, case) for other in others):
        if case.orders[0] == 0:  # the output has one offset, so a drift of the mean is heard
            run.moved[0] += run.offset - tried.offset
            run.own[:1] += run.offset - tried.offset
        differences.append(run.differs_from(tried))
    return tuple(factor * max(each) for each in zip(*differences, strict=True))
