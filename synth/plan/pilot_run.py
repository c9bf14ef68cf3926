"""Runs of a simulation at the scan's own speed and load, and along its own motion, their filters and their errors.

Stage   2 (PLAN), used by `simulation_plan`.
Model   A pilot is a run of whole texture periods of the steady scan. A stroke or a recording is also run along its own
        motion.
        The points or the table of a simulation err by the same amount with the effects and without them. The motion
        of a contact without them is known to the tolerance, so what a constant scan takes from a simulation is the
        difference that the effects make (a control variate).
        An error is the change between two pilots, times what halving leaves of it.
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
from synth.effects.simulation.terms import Terms
from synth.motion.scan_motion import LIFT_TIME, ScanMotion
from synth.plan.effect_choice import SimulationCase, relative_change, stiffness_round
from synth.sampling.decimation import Decimator, narrowest
from synth.sampling.frame_solver import WHOLE_TO, edge_of
from synth.scene.output_section import BAND

PILOT, LONGEST_PILOT = 0.05, 20.0  # s, shortest run of whole periods, and longest run if a period is longer than that
LONGEST_OWN = 10.0  # s of a recording along which the change by the effects is computed
SEARCHED = 6  # periods that are run to find a steady motion, its error and that of the contact without effects
OWN = 1.0  # s of a stroke or a recording along which the number of steps is judged
LEAST_SHARE = 0.3  # of the tolerance, for steps and points where the series needs nearly all of it
SECOND_ORDER, SLOWEST = 0.25, 2.0 / 3.0  # of an error that steps of half the length leave: least and most
UNLIKE = 3.0  # times the difference between two parts of a motion that does not repeat: others may differ more
STEADY_BAND, MOVING_BAND = (0.40, 0.45), (0.35, 0.49)  # kept and removed band, as parts of the rate
# Kept and removed band, as parts of a narrower bandwidth: of a live scan, behind a hand, and where only steps and
# points are compared. A steeper filter looks further ahead, which would increase the delay of a hand, 2.6 ms at 1 kHz.
SCAN_BAND, HAND_BAND, JUDGED_BAND = (0.9, 1.0), (1.0, 2.0), (1.0, 1.5)
LEAST_ATTENUATION, MOST_ATTENUATION = 70.0, 140.0  # dB


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
        steps = max(FEWEST_OF_PERIOD, round(simulation.rate / abs(case.turns)))
        period = Period.of(case.turns, case.nominal.scan.load, steps)
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


def left_by_series(case: SimulationCase) -> float:
    """Return the part of the tolerance that the series of the contact without effects leaves, where it is read."""
    spent = 0.0 if case.known is None else max(case.known.errors)
    return max(case.tolerance - spent, LEAST_SHARE * case.tolerance)


def table_errors(case: SimulationCase, tried: Pilot) -> tuple[tuple[float, ...], tuple[Simulation, ...]]:
    """Return the error of each order by the table, from the change by a table half as fine, and these two simulations.

    How fast the error falls is that of this change over the one before. The error is 0 without a table.
    """
    coarser = tried.simulation.stepper.coarser()
    if coarser is None or not tried.repeats:
        return (0.0,) * len(case.orders), ()
    other = started(replace(tried.simulation, stepper=coarser), case)
    changed = before = tried.differs_from(other)
    if (coarsest := coarser.coarser()) is not None and other.repeats:
        before = other.differs_from(started(replace(other.simulation, stepper=coarsest), case))
    left = (whole - one for whole, one in zip(steps_errors(changed, before), changed, strict=True))
    errors = tuple(map(min, left, changed))  # derivatives of z gain one order, or less
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
    memory = simulation.stepper.memory
    earlier = run_pilot(replace(simulation, settling=2.0 * simulation.settling), case)
    if case.orders[0] == 0:  # the output has one offset, so a drift of the mean is heard
        earlier.moved[0] += earlier.offset - tried.offset
        earlier.own[:1] += earlier.offset - tried.offset
    factor = 1.0 / -math.expm1(-simulation.settling / memory) if memory > 0.0 else 1.0
    return tuple((factor if tried.repeats else UNLIKE) * one for one in tried.differs_from(earlier))


def attenuation_of(case: SimulationCase) -> float:
    """Return the attenuation (dB) of removed components: to a tenth of the tolerance."""
    return min(max(-20.0 * math.log10(0.1 * case.tolerance), LEAST_ATTENUATION), MOST_ATTENUATION)


def filters_of(case: SimulationCase, terms: Terms, steps: int, *, judged: bool = False) -> Decimator:
    """Return the decimator from `steps` steps to a frame.

    If the mass has an effect within the band, the decimator compensates for the amplitude that its steps lose.

    judged: for a pilot that is only compared with others; its filter is shorter.
    """
    orders = tuple(sorted({0, *case.orders}))
    rate, width = case.scene.output.sample_rate, 0.0
    kept, removed = MOVING_BAND if case.moving else STEADY_BAND  # parts of the rate
    narrow = case.scene.output.bandwidth_hz / rate
    if narrow < kept:
        kept, removed = JUDGED_BAND if judged else HAND_BAND if case.by_hand else SCAN_BAND
        kept, removed = kept * narrow, min(removed * narrow, MOVING_BAND[1])
        if case.live and not case.by_hand:
            removed = max(removed, kept + narrowest(attenuation_of(case)))
        if not judged and not case.live:
            half, width = edge_of(narrow / BAND)
            kept, removed = WHOLE_TO * narrow, 2.0 * half - WHOLE_TO * narrow
    heavy = is_heavy(case, terms.mass)
    late = 0.0 if terms.skin is None else 1.0 - terms.skin.coefficients(1.0 / (rate * steps))[2]
    both, damped = (kept, removed), attenuation_of(case)
    return Decimator.of(orders, rate, steps, both, damped, width=width, of_mass=heavy, late=late, live=case.live)
