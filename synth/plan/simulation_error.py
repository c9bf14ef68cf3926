"""The errors of a simulation by its points, its table, and the start of its motion.

Stage   2 (PLAN), used by `simulation_plan`.
Model   An error is the change between two pilots, times what halving leaves of it.
"""

from __future__ import annotations

import math
from dataclasses import replace

from synth.effects.simulation.running import Simulation
from synth.plan.effect_choice import SimulationCase
from synth.plan.pilot_run import Pilot, run_pilot, started

LEAST_SHARE = 0.3  # of the tolerance, for steps and points where the series needs nearly all of it
SECOND_ORDER, SLOWEST = 0.25, 2.0 / 3.0  # of an error that steps of half the length leave: least and most
UNLIKE = 3.0  # times the difference between two parts of a motion that does not repeat: others may differ more
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


def steps_errors(changed: tuple[float, ...], before: tuple[float, ...]) -> tuple[float, ...]:
    """Return the error of each order by the steps, from its change by steps of half the length.

    Steps are of second order where they resolve the motion, and of a lower order for a mass that bounces.

    before: the change by steps that are twice as long; 0 where it is not known.
    """
    falls = (one / two if two > 0.0 else SECOND_ORDER for one, two in zip(changed, before, strict=True))
    return tuple(one / (1.0 - min(max(fall, SECOND_ORDER), SLOWEST)) for one, fall in zip(changed, falls, strict=True))


def start_errors(case: SimulationCase, tried: Pilot) -> tuple[float, ...]:
    """Return the estimated difference of each order between a constant scan's start and its later motion."""
    simulation, steady = tried.simulation, tried.simulation.steady
    if steady is not None and steady.harmonics is not None:
        return (steady.left,) * len(case.orders)
    earlier, memory = (
        run_pilot(replace(simulation, settling=2.0 * simulation.settling), case),
        simulation.stepper.memory,
    )
    if case.orders[0] == 0:  # the output has one offset, so a drift of the mean is heard
        earlier.moved[0] += earlier.offset - tried.offset
        earlier.own[:1] += earlier.offset - tried.offset
    factor = 1.0 / -math.expm1(-simulation.settling / memory) if memory > 0.0 else 1.0
    return tuple((factor if tried.repeats else UNLIKE) * one for one in earlier.differs_from(tried))
