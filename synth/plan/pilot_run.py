"""Runs of a simulation at the scan's own speed and load, and along its own motion, by which a simulation is planned.

Stage   2 (PLAN), used by `simulation_plan`.
Model   A pilot is a run of whole texture periods of the steady scan. A stroke or a recording is also run along its own
        motion.
        The points or the table of a simulation err by the same amount with the effects and without them. The motion
        of a contact without them is known to the tolerance, so what a constant scan takes from a simulation is the
        difference that the effects make (a control variate).
Limits  A period that is longer than LONGEST_PILOT is run in part.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from synth.arrays import Array
from synth.effects.simulation.periodic import FEWEST_STEPS as FEWEST_OF_PERIOD
from synth.effects.simulation.periodic import LONGEST, Period, steady_of
from synth.effects.simulation.running import RESPONSE, Running, Signal, Simulation
from synth.motion.scan_motion import LIFT_TIME, ScanMotion
from synth.plan.effect_choice import SimulationCase, relative_change, stiffness_round
from synth.scene.output_section import BAND

PILOT, LONGEST_PILOT = 0.05, 20.0  # s, shortest run of whole periods, and longest run if a period is longer than that
LONGEST_OWN = 10.0  # s of a recording along which the change by the effects is computed
SEARCHED = 6  # periods that are run to find a steady motion, its error and that of the contact without effects
OWN = 1.0  # s of a stroke or a recording along which the number of steps is judged


@dataclass(frozen=True, slots=True)
class Pilot:
    """A simulation in its initial state, and a run of it at the scan's speed and load.

    simulation: the simulation with its steady motion.
    moved: z minus its offset, and derivatives, SI, float64 [orders, frames].
    offset: offset of the displacement, m.
    own: the same along the first part of a stroke or a recording; otherwise it has no frames.
    repeats: False if the motion does not repeat. Runs with other steps then begin elsewhere and cannot be compared.
    """

    simulation: Simulation
    moved: Array
    offset: float
    own: Array
    repeats: bool

    @property
    def work(self) -> float:
        """Predicted time of its steps, s."""
        simulation, steady = self.simulation, self.simulation.steady
        if steady is not None and steady.harmonics is not None and not self.own.size:
            return SEARCHED * steady.steps * simulation.stepper.step_time
        return float(work_of(simulation) * self.moved.shape[1] / simulation.scene.output.sample_rate)

    def differs_from(self, other: Pilot) -> tuple[float, ...]:
        """Return the largest difference of each order from `other`, relative to the peak-to-peak."""
        steady = map(relative_change, self.moved, other.moved)
        if not self.own.size:
            return tuple(steady)
        return tuple(map(max, steady, map(relative_change, self.own, other.own)))


def started(simulation: Simulation, case: SimulationCase) -> Pilot:
    """Return the pilot of `simulation` in its steady motion.

    The search begins from the steady motion that `simulation` has, if any. There is no search for a finger at rest, or
    if a period is too long to be run several times.
    """
    if _searched(simulation, case):
        crossings = case.scene.texture.period / case.scene.finger.ridge_period
        period = Period.of(case.turns, case.nominal.scan.load, steps_of_period(simulation, case))
        asked = period, crossings, case.tolerance, simulation.steady, case.highest
        stepper, heavy = simulation.stepper, is_heavy(case, simulation.stepper.mass)
        steady = steady_of(stepper, *asked, of_mass=heavy)
        if case.known is not None and steady is not None and steady.harmonics is not None:
            elastic = steady_of(stepper.elastic, period, crossings, case.tolerance, None, case.highest, of_mass=False)
            assert elastic is not None, "a contact without mass and adhesion repeats"
            steady = replace(steady, missed=case.known.harmonics[: case.highest + 1] - elastic.height())
        simulation = replace(simulation, steady=steady)
    return run_pilot(simulation, case)


def _searched(simulation: Simulation, case: SimulationCase) -> bool:
    """Return whether a steady motion is searched: the finger moves, and a period is not too long."""
    return case.turns != 0.0 and simulation.rate <= LONGEST * abs(case.turns)


def is_heavy(case: SimulationCase, mass: float) -> bool:
    """Return whether `mass` (kg) has an effect at the end of the band."""
    band = min(case.scene.output.bandwidth_hz, BAND * case.scene.output.sample_rate)
    return mass * (math.pi * band) ** 2 > stiffness_round(case.contact, case.pressed)


def steps_of_period(simulation: Simulation, case: SimulationCase) -> int:
    """Return the whole number of steps nearest to a texture period."""
    return max(FEWEST_OF_PERIOD, round(simulation.rate / abs(case.turns)))


def work_of(simulation: Simulation) -> float:
    """Return the predicted time (s) of the steps of a second of sound."""
    return simulation.rate * simulation.stepper.step_time


def _run(simulation: Simulation, case: SimulationCase, frames: int) -> Array:
    """Return the first `frames` frames of a run, SI, float64 [orders, frames]."""
    signals = tuple(Signal(RESPONSE, order) for order in case.orders)
    return Running(simulation, signals).along(0, frames)


def run_pilot(simulation: Simulation, case: SimulationCase) -> Pilot:
    """Return a run of whole periods, or of a part of a period that is longer than LONGEST_PILOT."""
    rate = case.scene.output.sample_rate
    period = 1.0 / abs(case.turns) if case.turns else PILOT
    whole = rate * min(period * max(1.0, math.ceil(PILOT / period)), LONGEST_PILOT)
    moved = _run(simulation, case, max(64, math.ceil(whole) + 1))
    offset = 0.0
    if case.orders[0] == 0:
        times = np.append(np.arange(math.ceil(whole)), whole)
        risen = np.interp(times, np.arange(moved.shape[1]), moved[0] - moved[0, 0])
        offset = float(moved[0, 0] + np.trapezoid(risen, times) / whole)
        moved[0] -= offset
    own = np.empty((len(case.orders), 0))
    if case.moving and not case.by_hand:
        own = run_own(replace(simulation, offset=offset), case, OWN)
        if case.scene.scan.trajectory is not None:  # the lift at its end is larger than the motion that is judged
            own = own[:, : max(1, round(ScanMotion(case.scene, whole=case.live).duration * rate))]
    repeats = simulation.steady is not None or not _searched(simulation, case)
    return Pilot(simulation, moved, offset, own, repeats)


def run_own(simulation: Simulation, case: SimulationCase, longest: float) -> Array:
    """Return a run along the scan's own motion, at most `longest` seconds, SI, float64 [orders, frames]."""
    output = case.scene.output
    motion = ScanMotion(case.scene, whole=case.live)
    seconds = min(output.duration, longest, motion.duration + (LIFT_TIME if motion.lifts else 0.0))
    return _run(replace(simulation, scene=case.scene), case, max(1, round(seconds * output.sample_rate)))
