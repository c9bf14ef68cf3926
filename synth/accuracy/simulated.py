"""The methods to compute a scene whose response a simulation replaces: steps, tables and points of several sizes.

Stage   no stage. These are the methods of `simulation_plan` in several sizes, and what one would write instead.
Model   Steps: the simulation of the plan in RATIOS times as many steps. Table: the energy of the contact at fewer
        phases and heights. Points: fewer of them. The reference has FINEST times the steps, on a table for a tenth of
        the tolerance, or on points at half the distance.
        Baseline: m z'' + c z' + k_p (z - z_w) = k I - w, with I the mean over L of max(h - z, 0) on equally spaced
        points. SciPy's `solve_ivp` (LSODA) integrates it, and the filter of the simulation makes frames of it.
Source  Fagiani & Barbieri (2016), eq. 1; `effects.inertia`.
Limits  The baseline has a mass, a damper and a spring at one load; skin and attraction are left out.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from synth.accuracy.baseline import Trapezoid
from synth.accuracy.method import LeftOutMethod, Method, Ready, clock
from synth.accuracy.motion import FINEST, REFERENCE_SECONDS, FrameReference, MotionCase
from synth.arrays import Array
from synth.contact.load_balance import Contact
from synth.effects.effect import BalanceEffect
from synth.effects.simulation.running import RESPONSE, WHOLE, Running, Signal, Simulation
from synth.effects.simulation.steps import Stepper
from synth.effects.simulation.terms import Terms
from synth.held_memory import held_by
from synth.motion.scan_motion import ScanMotion
from synth.plan.contact_steppers import point_stepper, table_stepper
from synth.plan.effect_choice import SimulationCase
from synth.plan.pilot_run import filters_of, started
from synth.plan.simulation_plan import SimulationPlan, refinement
from synth.response.demand import harmonics_of
from synth.response.lift_gate import gate
from synth.response.series_curve import SeriesCurve
from synth.sampling.decimation import MOST_TAPS

RATIOS = (0.25, 0.5, 1.0, 2.0, 4.0)  # of the plan's steps
FEWEST = 2  # steps per frame, which the filters need
TABLE_TOLERANCE = 0.1  # of the tolerance: that of the reference's table
COARSER = 2  # how often a table or points are halved
LEAST_POINTS = 3  # of a simulation
TWICE = 2.0  # runs of a slow method
BASELINE = ((12, 1e-3), (25, 1e-4), (50, 1e-5), (100, 1e-6))  # points per ridge, relative tolerance of `solve_ivp`
SETTLING = 0.02  # s that the baseline computes before the piece: the default pulp forgets in 2.4 ms
TIMED = 0.02  # s of motion on which it is timed
EVALUATIONS = 6e5  # of the forces per second of motion: LSODA on the default mass
NEARLY = 0.75  # of the length of the filter of a file: shorter ones let through 1e-3 and more
PROBED = 16  # places at which a force is timed
MEAN_PHASES = 256  # phases of a period, for z_w


@dataclass(frozen=True)
class Simulated:
    """A scene whose response a simulation replaces.

    case: its motion.
    plan: its simulation.
    request, terms: those of the plan.
    """

    case: MotionCase
    plan: SimulationPlan
    request: SimulationCase
    terms: Terms

    @classmethod
    def of(cls, case: MotionCase) -> Simulated:
        """Return the simulation of `case`."""
        solved = case.solved
        assert solved.effects is not None and solved.effects.simulation is not None and solved.contact is not None
        terms = Terms()
        for one in solved.effects.called:
            if isinstance(one.effect, BalanceEffect):
                terms = one.effect.balanced(terms, one.settings)
        request = SimulationCase(*solved.request, solved.contact, solved.tolerance, solved.mean, solved.spectrum)
        return cls(case, solved.effects.simulation, request, terms)

    @property
    def stepper(self) -> Any:
        """The stepper of the plan."""
        return self.plan.simulation.stepper

    @cached_property
    def of_points(self) -> bool:
        """Whether points are simulated, not a table."""
        return self.stepper.coarser() is None

    @property
    def signal(self) -> Signal:
        """The signal of the channel."""
        planned = self.case.planned
        return Signal(WHOLE, 0) if planned.is_approach else Signal(RESPONSE, planned.order)

    def filtered(self, ratio: float) -> bool:
        """Return whether `ratio` times the steps of the plan have a filter nearly as long as that of the plan."""
        return NEARLY * self.steps(ratio) * self.plan.simulation.filters.margin <= MOST_TAPS

    def steps(self, ratio: float) -> int:
        """Return the steps per frame, `ratio` times those of the plan."""
        return max(FEWEST, round(ratio * self.plan.simulation.steps))

    def count(self, halvings: int) -> int:
        """Return the number of points if their distance is doubled `halvings` times."""
        return int(self.stepper.points.rows.shape[1] // refinement(self.request) ** halvings)

    def made(self, halvings: int) -> Any:
        """Return the stepper of the plan, made anew: a table `halvings` times half as fine, or so many fewer points."""
        if self.of_points:
            return point_stepper(self.request, self.terms, self.count(halvings), self.plan.simulation.reference)[0]
        stepper: Any = table_stepper(self.request, self.terms, self.plan.table_finer)[0]
        for _halving in range(halvings):
            stepper = stepper.coarser()
        return stepper

    @property
    def finer(self) -> Stepper:
        """The stepper of the reference."""
        if not self.of_points:
            tolerance = TABLE_TOLERANCE * self.request.tolerance
            return table_stepper(replace(self.request, tolerance=tolerance), self.terms, self.plan.table_finer)[0]
        count = self.stepper.points.rows.shape[1] * refinement(self.request)
        return point_stepper(self.request, self.terms, count, self.plan.simulation.reference)[0]

    def values(self, simulation: Simulation) -> Array:
        """Return the channel (SI) at the frames of the piece."""
        first, frames = self.case.piece
        return np.asarray(Running(simulation, (self.signal,)).along(first, frames)[0])

    def resized(self, steps: int, stepper: Stepper) -> Simulation:
        """Return the simulation in `steps` steps per frame on `stepper`."""
        filters = filters_of(self.request, self.terms, steps)
        begun = started(replace(self.plan.nominal, stepper=stepper, steps=steps, filters=filters), self.request)
        return replace(begun.simulation, scene=self.request.scene, offset=begun.offset)


def simulated_reference(scene: Simulated) -> tuple[FrameReference, int, float]:
    """Return the reference, how many times the steps of the plan it has, and the time (s) of a run of the plan."""
    scene.values(scene.plan.simulation)
    began = clock()
    scene.values(scene.plan.simulation)
    usual = clock() - began
    finest, points = FINEST, refinement(scene.request) if scene.of_points else 1
    while finest > 2 and not (scene.filtered(finest) and usual * finest * points <= REFERENCE_SECONDS):
        finest //= 2
    best = scene.values(scene.resized(scene.steps(finest), scene.finer))
    second = scene.values(scene.resized(scene.steps(finest // 2), scene.stepper))
    return FrameReference.between(scene.case, best, second), finest, usual


def step_name(scene: Simulated, ratio: float) -> str:
    """Return the name of the simulation with `ratio` times the steps of the plan."""
    return f"simulated, {scene.steps(ratio) * scene.case.rate} steps a second"


def simulated_methods(scene: Simulated, finest: int, usual: float) -> Iterator[Method]:
    """Yield the simulation in several sizes; finest, usual: of `simulated_reference`."""
    yield from _baseline(scene)
    named = {step_name(scene, ratio): ratio for ratio in RATIOS if ratio < finest}
    for name, ratio in named.items():
        made = partial(_ready, scene, scene.steps(ratio), 0, chosen=name == step_name(scene, 1.0))
        yield Method(name, "steps", made, TWICE * (1.0 + ratio) * usual)
    for power in range(1, COARSER + 1):
        if scene.of_points and scene.count(power) < LEAST_POINTS:
            return
        size = f"on a coarser table, {100 // 2**power} % as fine"
        if scene.of_points:
            size = f"on fewer points, {scene.count(power)} points"
        made = partial(_ready, scene, scene.steps(1.0), power)
        yield Method(f"simulated {size}", "cells", made, 2.0 * TWICE * usual)


def without_methods(scene: Simulated) -> Iterator[LeftOutMethod]:
    """Yield the methods that do not apply."""
    name = "trapezoid and solve_ivp"
    if scene.terms.skin is not None or scene.terms.adhesion is not None:
        yield LeftOutMethod(name, "baseline", "It integrates a mass. Skin or attraction has a state at every point.")
    elif scene.request.load_varies:
        yield LeftOutMethod(name, "baseline", "It integrates a mass at one load, and the load changes.")
    elif not scene.request.contact.of_one_line:
        yield LeftOutMethod(name, "baseline", "It integrates a contact along one line, and this finger has an area.")


def _ready(scene: Simulated, steps: int, halvings: int, *, chosen: bool = False) -> Ready:
    """Return a simulation, ready to run; halvings: of its table or points."""
    simulation = scene.plan.simulation if chosen else scene.resized(steps, scene.made(halvings))
    setup = scene.case.setup if chosen else None
    return scene.case.ready(partial(scene.values, simulation), held_by(simulation).bytes, setup)


def _baseline(scene: Simulated) -> Iterator[Method]:
    """Yield what one would write, with the fewest points first."""
    if any(without_methods(scene)):
        return
    for points, tolerance in BASELINE:
        moving = Integrated(scene, points, tolerance)
        a_force = moving.seconds_a_force()
        frames = scene.case.piece[1]
        seconds = a_force * EVALUATIONS * (frames / scene.case.rate + SETTLING)
        name = f"trapezoid and solve_ivp, {points} points a ridge, relative tolerance {tolerance:.0e}"
        yield Method(name, "baseline", moving.ready, seconds + 2.0 * TWICE * a_force * EVALUATIONS * (SETTLING + TIMED))


class Integrated:
    """A mass on a contact, integrated by SciPy.

    points: per ridge.
    tolerance: relative tolerance of `solve_ivp`.
    """

    def __init__(self, scene: Simulated, points: float, tolerance: float) -> None:
        self._scene, self._tolerance = scene, tolerance
        self._load = scene.request.pressed
        contact: Contact = scene.request.contact
        self._rule = Trapezoid(contact, self._load, points)
        self._stiffness, self._period = contact.stiffness_at(self._load), contact.geometry.texture_period
        phases = np.arange(MEAN_PHASES) / MEAN_PHASES
        target = np.full(MEAN_PHASES, contact.indentation(self._load))
        self._rest = float(np.mean(self._rule.roots(phases, target)))
        self._target = target[:1]

    def force(self, phase: float, z: float) -> float:
        """Return the sum of the pressure (N) at a place (turns)."""
        h, v = self._rule.weighted(self._rule.heights(phase, 0.0))
        return self._stiffness * float(v @ np.maximum(h - z, 0.0))

    def seconds_a_force(self) -> float:
        """Return the time (s) of one evaluation of the forces."""
        began = clock()
        for phase in range(PROBED):
            self.force(phase / PROBED, self._rest)
        return (clock() - began) / PROBED

    def ready(self) -> Ready:
        """Return the integration, ready to run. It is timed without the part before the piece."""
        case = self._scene.case
        timed = math.ceil((SETTLING + TIMED) * case.rate)
        run = partial(self._integrated, np.arange(case.piece[0] * 1.0, case.piece[0] + timed) / case.rate, 0.0)
        return Ready(timed, self._rule.nbytes, run, lambda _points: self.values())

    def values(self) -> Array:
        """Return the channel (SI) at the frames of the piece."""
        case, simulation = self._scene.case, self._scene.plan.simulation
        (first, frames), signal, steady = case.piece, self._scene.signal, simulation.steady
        rest = float(simulation.rest(self._load)) if signal.kind == RESPONSE and signal.order == 0 else 0.0
        lifted = gate(self._load, case.scene.scan.lift_load)
        if not self._scene.request.moving and steady is not None and steady.harmonics is not None:
            turns, highest = abs(self._scene.request.turns), self._scene.request.highest
            z = self._integrated(first / case.rate + np.arange(steady.steps) / (steady.steps * turns), SETTLING)
            series = harmonics_of(z, highest) * (2j * math.pi * turns * np.arange(highest + 1)) ** signal.order
            series[0] -= rest
            places = turns * np.arange(frames) / case.rate
            return np.asarray(lifted * SeriesCurve(series).heights(places, places))
        filters = simulation.filters
        steps, rate = filters.steps, case.rate * filters.steps
        begin = (first - filters.margin) * steps
        times = np.arange(begin, begin + (frames - 1 + 2 * filters.margin) * steps + 1) / rate
        z = np.ascontiguousarray(lifted * (self._integrated(times, SETTLING) - rest))
        return filters.read(z, filters.orders.index(signal.order), frames)

    def _integrated(self, times: Array, before: float) -> Array:
        """Return z (m) at `times` (s), from the contact without a mass `before` (s) the first of them."""
        from scipy.integrate import solve_ivp

        case, terms = self._scene.case, self._scene.terms
        first = math.floor((float(times[0]) - before) * case.rate)
        motion = ScanMotion(case.scene).at(first, math.ceil(float(times[-1]) * case.rate) - first + 1)
        at, turns = (first + np.arange(motion.frames)) / case.rate, motion.position / self._period

        def moves(t: float, state: Array) -> tuple[float, float]:
            """Return the rates of z and of its speed."""
            z, v = state
            pressed = self.force(float(np.interp(t, at, turns)), z) - self._load
            return v, (pressed - terms.damping * v - terms.pulp * (z - self._rest)) / terms.mass

        start = float(self._rule.roots(turns[:1], self._target)[0])
        small = 1e-6 * self._tolerance, 1e-3 * self._tolerance
        found = solve_ivp(
            moves, (at[0], times[-1]), (start, 0.0), "LSODA", times, rtol=self._tolerance, atol=small,
            max_step=1.0 / case.rate,
        )  # fmt: skip
        return np.asarray(found.y[0])
