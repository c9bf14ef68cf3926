"""Plan a step-by-step simulation: steps, points, errors, and the change by the effects, found with pilot runs.

Stage   2, used by `prepare`. `simulation.running` runs the simulation, which replaces the response.
Model   Points: their distance is halved until their error, from the change of the pilot by the last halving, is within
        POINTS_SHARE of the tolerance. Over an area this takes four times as many.
        A table of a file is made finer while it errs by more than that share. Points replace one that is still too
        coarse, such as that of a texture with a long period.
        Steps: pilots are run with n and 2 n steps per frame. n is doubled until they agree within SETTLED of the
        tolerance or, live, within TABLE_STEPS of the error of the table if that is larger.
        Change: a pilot of the same contact without mass, memory and adhesion shows what the effects change.
        `errors` is the sum of
        - the change by twice the steps, plus a third of it (second order), or more where it falls more slowly;
        - for skin, the change by half the points; for a table, the change by half as many phases and heights; of a
          constant scan only of the difference that the effects make (`pilot_run`), and the error of the series;
        - what has not settled where the scan begins;
        - what the filter lets through, and what that of a live voice takes from the end of the band. A constant scan
          whose motion repeats has no filter.
Source  design, section 4: components below 0.40 of the rate are kept and those above 0.45 removed; 0.35 and 0.49 where
        the speed changes.
Limits  The errors are estimates; tests/synth/effects compares them with independent solutions. Doubling ends where the
        steps of a second of sound would take longer than BUSY (live) or BUSY_FILE (file), or the next pilot longer than
        PATIENCE; of a constant scan, which plays without steps, only the latter counts. `errors` then contains the
        remaining error. Slow scans of coarse textures, whose periods are long, are therefore planned within seconds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from synth.effects.simulation.running import RESPONSE, WHOLE, Signal, Simulation
from synth.effects.simulation.terms import ELASTIC, Terms
from synth.motion.moved_skin import mover_of
from synth.plan.contact_steppers import TIGHTEST_TABLE, point_stepper, slope_forces, table_stepper, table_tolerance
from synth.plan.effect_choice import SimulationCase, relative_change, stiffness_round
from synth.plan.pilot_run import (
    LONGEST_OWN,
    SEARCHED,
    Pilot,
    attenuation_of,
    filters_of,
    left_by_series,
    run_own,
    run_pilot,
    start_errors,
    started,
    steps_errors,
    table_errors,
    work_of,
)
from synth.response.demand import Complex
from synth.response.lift_gate import gate
from synth.scene.output_section import FULL_BAND, Channel

FEWEST_STEPS = 96e3  # smallest number of steps per second: contacts change within tens of microseconds
DOUBLED, DOUBLED_LIVE = 3, 1  # doublings of the fewest steps after which a motion counts as one that does not repeat
SETTLING = 0.5  # most s that are simulated before the first frame of a run that begins in the middle of its motion
LEFT_OF_START, PASSED = 1e-2, 3.0  # of the tolerance: what is left of a start then; periods that pass, for adhesion
BUSY, BUSY_FILE = 0.14, 8.0  # predicted s of work per second: more hinders other live voices; files would take hours
PATIENCE, PATIENCE_FILE = 0.2, 3.0  # predicted s of work of the next finer pilot, live and for a file
SHARED = 1.5  # measured over predicted time on a processor that shares its caches: 1 to 2 were seen
FEWEST_POINTS, MOST_POINTS = 65, 16385  # along a line: fewer points save less than a call costs; the most take 30 us
MOST_OVER_AREA = 1 << 17  # over an area: 20 MB of states
SETTLED = 0.4  # largest change of a quantity by twice the steps, as a part of the tolerance
TABLE_STEPS = 0.25  # the same, live, as a part of the error of the table if that is larger: more steps would not help
RESTED = 512.0  # harmonics of the scan by which a finger at rest is planned; with 64, its place erred by 2e-4
TOO_COARSE = 4.0  # error of a file's table over the tolerance, above which points replace the table; they cost more
POINTS_SHARE = 0.4  # error of the skin's points, as a part of the tolerance
FINER_TABLE = 8.0  # factor on the tolerance of a table, while a quantity errs by more than POINTS_SHARE
LEFT_BY_POINTS = 0.55  # error over the change by half the points: order 1.5, from kinks where surfaces begin to touch
LEFT_BY_CORNERS = 1.0  # the same on a texture with corners: order 1
LEFT_OVER_AREA = 1.1  # the same of a fingertip, whose rows converge unevenly: of 150 random scenes one needed 1.1


@dataclass(frozen=True, slots=True)
class SimulationPlan:
    """How a scene is simulated. Tuples have one value per order.

    simulation: simulation that is ready to run.
    orders: orders of the time derivatives.
    change: change by the effects, relative to the peak-to-peak of the response.
    errors: error, relative to the peak-to-peak.
    peaks: peak at the scan's speed and load, or along a recording, SI.
    pilot: the pilot from which these were computed.
    finer: the same simulation with steps of half the length.
    coarser: two simulations that differ in their points or in their table only, the coarser one first; or none.
    filtered: the part of `errors` by the filter.
    of_series: whether the samples are read from the series of a period, instead of being simulated while it plays.
    table_finer: of the table, as of `table_stepper`.
    """

    simulation: Simulation
    orders: tuple[int, ...]
    change: tuple[float, ...]
    errors: tuple[float, ...]
    peaks: tuple[float, ...]
    pilot: Pilot
    finer: Simulation
    coarser: tuple[Simulation, ...]
    filtered: float
    of_series: bool
    table_finer: float

    @property
    def nominal(self) -> Simulation:
        """The simulation of the pilot."""
        return self.pilot.simulation

    @property
    def extents(self) -> tuple[float, ...]:
        """Peak-to-peak (SI) of each order at the scan's speed and load; along a stroke or a recording, if larger."""
        runs = self.pilot.moved, self.pilot.own
        return tuple(np.max([np.ptp(run, axis=1) for run in runs if run.size], axis=0).tolist())

    @property
    def signals(self) -> tuple[Signal, ...]:
        """The signals that a voice takes from the simulation: z minus its mean, for every order."""
        return tuple(Signal(RESPONSE, order) for order in self.orders)

    def series(self, order: int) -> Complex | None:
        """Return the series of an order at the scan's own speed and load (SI); None if the motion does not repeat."""
        found = self.simulation.series(Signal(RESPONSE, order))
        if found is not None:
            found[0] = 0.0
        return found

    @property
    def level(self) -> float:
        """Mean of z at the scan's own load (m), under the gate."""
        simulation = self.simulation
        found, scan = simulation.series(Signal(WHOLE, 0)), simulation.scene.scan
        if found is not None:
            return float(found[0].real)
        lifted = 1.0 if simulation.held else gate(scan.load, scan.lift_load)
        return float(lifted * simulation.rest(max(scan.load, 0.0)))

    @property
    def let_go(self) -> bool:
        """True if the adhesion cannot hold the finger at the scan's own load."""
        return self.simulation.held and not any(self.extents)

    @property
    def work(self) -> float:
        """Predicted processor time of the steps of a second of sound, s."""
        return 0.0 if self.of_series else SHARED * work_of(self.simulation)


def plan_simulation(case: SimulationCase, terms: Terms, *, of_points: bool = False) -> SimulationPlan:
    """Return how `case` is simulated with `terms`; of_points: on points even if a table serves it."""
    assert terms.mass > 0.0 or terms.damping == 0.0, "an effect that adds a damper also gives a mass"
    if case.rests and (at_rest := _at_rest(case, terms)).of_series:
        return at_rest
    ends_move = case.load_varies and not case.contact.of_one_surface  # no table serves all loads
    of_points = of_points or terms.skin is not None or ends_move or not case.scene.scan.along_x
    of_points = of_points or slope_forces(case) > 1  # a table has the energy along x only
    if slope_forces(case):  # a force takes nothing from the series, and needs as many points as before
        case = replace(case, spectrum=None)
    busy, patience = (BUSY, PATIENCE) if case.live else (BUSY_FILE, PATIENCE_FILE)
    counts = _points(case, terms, busy) if of_points else [0]
    tried = _begun(case, terms, counts[0])
    (of_contact, pair), table_finer = table_errors(case, tried), 1.0
    if not counts[0] and not case.live:
        tried, of_contact, pair, table_finer = _on_finer_table(case, terms, tried, of_contact, pair)
    coarse = not case.live and max(of_contact) > TOO_COARSE * case.tolerance
    if coarse and terms.adhesion is None and case.contact.of_one_line:
        return plan_simulation(case, terms, of_points=True)
    own = case.known.errors if case.known is not None else (0.0,) * len(case.orders)
    allowed = [max(SETTLED * left_by_series(case), TABLE_STEPS * one * case.live) for one in of_contact]
    if counts[1:]:
        tried, of_contact, pair = _on_more_points(case, terms, tried, counts[1:], patience)
    before: tuple[float, ...] = (0.0,) * len(case.orders)
    while True:
        finer = started(_halved_steps(case, terms, tried.simulation), case)
        of_steps = finer.differs_from(tried)
        dear = (not case.constant and work_of(finer.simulation) > busy) or 2.0 * finer.work > patience
        if not tried.repeats or dear or all(map(float.__le__, of_steps, allowed)):
            break
        tried, before = finer, of_steps
    filters = filters_of(case, terms, tried.simulation.steps)
    heard = run_pilot(replace(tried.simulation, filters=filters), case)
    change, peaks = _change_and_peaks(case, heard)
    steady = heard.simulation.steady
    of_series = not case.moving and steady is not None and steady.harmonics is not None
    filtered = 0.0 if of_series else 10.0 ** (-attenuation_of(case) / 20.0) + filters.droop
    parts = zip(steps_errors(of_steps, before), of_contact, start_errors(case, tried), own, strict=True)
    errors = tuple(sum(each) + filtered for each in parts)
    ready = replace(heard.simulation, scene=case.scene, offset=heard.offset)
    twice, *halves = (replace(one, filters=filters_of(case, terms, one.steps)) for one in (finer.simulation, *pair))
    return SimulationPlan(
        ready, case.orders, change, errors, peaks, heard, twice, tuple(halves), filtered, of_series, table_finer
    )


def _at_rest(case: SimulationCase, terms: Terms) -> SimulationPlan:
    """Return the plan of a finger at rest: where a scan without mass and memory, of any speed, would stop."""
    scene = case.scene
    channels = (Channel.model_construct(quantity="displacement"),)
    output = scene.output.model_copy(
        update={"channels": channels, "bandwidth": FULL_BAND, "sample_rate": int(0.5 * FEWEST_STEPS)}
    )
    scan = scene.scan.model_copy(update={"speed": scene.texture.period * output.band_limit / RESTED})
    slow = replace(case, scene=scene.model_copy(update={"scan": scan, "output": output}))
    plan = plan_simulation(slow, terms.of_rest)
    return replace(plan, simulation=replace(plan.simulation, scene=scene))


def _on_finer_table(
    case: SimulationCase, terms: Terms, tried: Pilot, errors: tuple[float, ...], pair: tuple[Simulation, ...]
) -> tuple[Pilot, tuple[float, ...], tuple[Simulation, ...], float]:
    """Return `tried` on a table that is fine enough, its error by the table, and the two simulations of `table_errors`.

    The table keeps its tolerance of z; a derivative of z may err more. The last value is that of `table_stepper`.
    """
    finer, most = 1.0, POINTS_SHARE * case.tolerance
    while tried.repeats and max(errors) > most and table_tolerance(case, finer) > TIGHTEST_TABLE:
        stepper = table_stepper(case, terms, finer * FINER_TABLE)[0]
        other = started(replace(tried.simulation, stepper=stepper), case)
        fewer, both = table_errors(case, other)
        if not max(fewer) < max(errors):  # it has as many nodes as are allowed
            break
        tried, errors, pair, finer = other, fewer, both, finer * FINER_TABLE
    return tried, errors, pair, finer


def _on_more_points(
    case: SimulationCase, terms: Terms, tried: Pilot, counts: list[int], patience: float
) -> tuple[Pilot, tuple[float, ...], tuple[Simulation, ...]]:
    """Return `tried` on the first of `counts` points that err by their share of the tolerance, or that are affordable.

    Its error of each order follows, and the two simulations whose difference it is.
    """
    profile = case.contact.geometry.profile
    left = LEFT_BY_POINTS if case.contact.of_one_line else LEFT_OVER_AREA
    if profile is not None and profile.corners.size:
        left = LEFT_BY_CORNERS
    for count in counts:
        before = tried
        stepper = point_stepper(case, terms, count, tried.simulation.reference)[0]
        tried = started(replace(tried.simulation, stepper=stepper), case)
        errors = tuple(left * one for one in tried.differs_from(before))
        enough = max(errors) <= POINTS_SHARE * left_by_series(case)
        if not tried.repeats or enough or refinement(case) * tried.work > patience:
            break
    return tried, errors, (before.simulation, tried.simulation)


def refinement(case: SimulationCase) -> int:
    """Return how many times as many points halve their distance."""
    return 2 if case.contact.of_one_line else 4


def _points(case: SimulationCase, terms: Terms, busy: float) -> list[int]:
    """Return the numbers of points to try, each at half the distance of the one before. Time limits the last."""
    from synth.effects.simulation.skin_steps import point_seconds

    steps, finer = max(2.0 * case.scene.output.sample_rate, FEWEST_STEPS), refinement(case)
    if case.constant:  # only the search takes time
        steps, busy = SEARCHED * steps / max(abs(case.turns), 1e-9), PATIENCE if case.live else PATIENCE_FILE
    in_rows, attracts = not case.contact.of_one_line, terms.adhesion is not None
    seconds = point_seconds(terms.skin or ELASTIC, in_rows=in_rows, attracts=attracts)
    most = MOST_POINTS if case.contact.of_one_line else MOST_OVER_AREA
    counts = [min(max(FEWEST_POINTS, int(busy / steps / seconds)), most)]
    while counts[0] > finer * FEWEST_POINTS or len(counts) == 1:
        counts.insert(0, (counts[0] + finer - 1) // finer)
    return counts


def _change_and_peaks(case: SimulationCase, tried: Pilot) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return two values of each order: its change by the effects, and its peak (SI).

    The change is relative to the elastic peak-to-peak. It is that at the scan's speed and load; for a recording, and
    where an effect moves the skin, the larger of that and the change along the motion. The peak is then always that
    along the motion.
    """
    simulation, moved = tried.simulation, tried.moved
    elastic = replace(simulation, stepper=simulation.stepper.elastic, steady=None, settling=0.0)
    still = started(elastic, case)
    change = tuple(map(relative_change, still.moved, moved))
    if (case.scene.scan.trajectory is not None or mover_of(case.scene) is not None) and not case.by_hand:
        moved = run_own(replace(simulation, offset=tried.offset), case, LONGEST_OWN)
        still_own = run_own(replace(elastic, offset=still.offset), case, LONGEST_OWN)
        change = tuple(map(max, change, map(relative_change, still_own, moved)))
    return change, tuple(np.max(np.abs(moved), axis=1).tolist())


def _begun(case: SimulationCase, terms: Terms, points: int) -> Pilot:
    """Return the pilot with the fewest steps in which the motion repeats; if it never does, with the fewest.

    A mass on skin may swing without end in steps that are too long for it.

    points: of skin.
    """
    first = tried = started(_first_simulation(case, terms, points), case)
    for _doubling in range(DOUBLED_LIVE if case.live else DOUBLED):
        if tried.repeats:
            return tried
        tried = started(_halved_steps(case, terms, tried.simulation), case)
    return tried if tried.repeats else first


def _settling(case: SimulationCase, terms: Terms, memory: float) -> float:
    """Return the time (s) after which a start is forgotten; memory: time constant of the skin, s."""
    lasting = memory
    if terms.mass > 0.0:  # it rings, or creeps against a damper
        stiffness = stiffness_round(case.contact, case.pressed) + terms.pulp
        slowest = max(2.0 * terms.mass / terms.damping, terms.damping / stiffness) if terms.damping else math.inf
        lasting = max(lasting, slowest)
    forgotten = -math.log(LEFT_OF_START * case.tolerance) * lasting
    passed = PASSED / abs(case.turns) if case.turns else math.inf
    return min(max(forgotten, passed), SETTLING)


def _halved_steps(case: SimulationCase, terms: Terms, simulation: Simulation) -> Simulation:
    """Return `simulation` of a pilot in steps of half the length."""
    steps = 2 * simulation.steps
    return replace(simulation, steps=steps, filters=filters_of(case, terms, steps, judged=True))


def _first_simulation(case: SimulationCase, terms: Terms, points: int) -> Simulation:
    """Return the simulation of `case` with `terms`, the fewest steps, and `points` points of skin."""
    steps = max(2, math.ceil(FEWEST_STEPS / case.scene.output.sample_rate))
    stepper, mean = point_stepper(case, terms, points) if points else table_stepper(case, terms)
    return Simulation(
        stepper=stepper,
        scene=case.nominal,
        steps=steps,
        filters=filters_of(case, terms, steps, judged=True),
        reference=mean,
        offset=0.0,
        held=terms.adhesion is not None,
        settling=_settling(case, terms, stepper.memory),
        whole=case.live,
    )
