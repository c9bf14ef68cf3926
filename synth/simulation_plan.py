"""How a scene is simulated step by step, and what that changes: planned by a pilot run at its own speed and load.

Stage   2, used by `preparation`; `simulation.running` runs it.
Model   A pilot of whole texture periods at the scan's speed and load is run with n and with 2 n steps a frame; n
        doubles until they agree within SETTLED of the tolerance. Its steps also hold the elastic contact's z, read from
        the same table: the difference of the two is what the effects change. Up to SMALL of the peak-to-peak it is
        added to the response, so that a small effect leaves the response as exact as it is; beyond, the simulation
        takes the place of the response.
Limits  `errors` adds what halving the steps changed (second order: a third more than the difference), and what the
        table's error makes of the quantity through the linear motion round the load; of a viscous skin, what half as
        many points changed. Where more steps would take more than BUSY of a second's sound, doubling ends, and `errors`
        tells what is left.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from synth.contact.balance import Contact
from synth.contact.exact import Array
from synth.contact.mean import mean_curve
from synth.contact.spectrum import curves, points_for
from synth.effect_choice import relative_change
from synth.errors import CannotRender
from synth.scene import Scene
from synth.simulation.decimation import Decimator
from synth.simulation.running import CHANGE, RESPONSE, STATIC_RESPONSE, Running, Signal, Simulation
from synth.simulation.skin_points import SkinPoints
from synth.simulation.skin_steps import SkinStepper
from synth.simulation.steppers import Asked, asking, step_time, stepper_of, stiffness_round
from synth.simulation.steps import ATTACHED, HEIGHT, ROWS, STATIC, Stepper
from synth.simulation.table_steps import TableStepper
from synth.simulation.terms import Terms

FEWEST_STEPS = 96e3  # steps a second at least: contacts change within tens of microseconds
BUSY = 0.14  # s of work a second of sound that steps may take, as predicted: more would not run live beside others
SETTLED = 0.4  # of the tolerance: what halving the steps may change of a quantity
SMALL = 0.1  # of the peak-to-peak: a smaller change is added to the response, a larger one takes its place
PILOT, LONGEST_PILOT = 0.05, 20.0  # s: of whole periods at least, and where a period takes longer than that
HEAVIEST_HAND = 5.0  # N: a hand is prepared for at least; heavier, the contact is linear, which it is once all touches
STEADY_BAND, MOVING_BAND = (0.40, 0.45), (0.35, 0.49)  # of the rate: kept and removed (design, section 4)
WIDENING = 1.5  # times the bandwidth: where a narrower band is removed; steeper filters look further ahead
LEAST_ATTENUATION, MOST_ATTENUATION = 70.0, 140.0  # dB
STIFFER = 2.0  # times its mean that a contact's stiffness is where the table's error counts most (seen: up to 2)
LEFT_BY_POINTS = 0.55  # of what half the points change: order 1.5, by kinks where the surface comes down on the skin
PHASES = 1024  # at which the table is compared with the exact contact


@dataclass(frozen=True, slots=True)
class SimulationPlan:
    """How a scene is simulated.

    simulation: ready to run. added: its change is added to the response; otherwise it is in the place of it. change,
    errors, extents, peaks: of each order asked for: what the effects change, relative; the error, relative to the
    peak-to-peak; peak-to-peak and peak (SI) at the scan's speed and load. pilot: the run that showed it; nominal,
    finer: what it ran, and the same in steps of half the length.
    """

    simulation: Simulation
    added: bool
    orders: tuple[int, ...]
    change: tuple[float, ...]
    errors: tuple[float, ...]
    extents: tuple[float, ...]
    peaks: tuple[float, ...]
    pilot: Pilot
    nominal: Simulation
    finer: Simulation

    @property
    def signals(self) -> tuple[Signal, ...]:
        """What a voice asks of the simulation: a signal for each order."""
        return tuple(Signal(CHANGE if self.added else RESPONSE, order) for order in self.orders)

    def change_from(self, other: SimulationPlan) -> tuple[float, ...]:
        """Return by how much each order differs from another simulation of the same scan, relative to that one."""
        pairs = zip(other.pilot.moved, self.pilot.moved, strict=True)
        return tuple(relative_change(before, after) for before, after in pairs)

    @property
    def memory_bytes(self) -> int:
        """Bytes that it holds."""
        return self.simulation.nbytes


@dataclass(frozen=True, slots=True)
class Case:
    """What is to be simulated: the scene, its contact, and what is wanted of it.

    orders: time derivatives of z, rising. tolerance: as a number. loads: smallest and largest (N). moving: its speed or
    load changes. forces: the horizontal forces are wanted too.
    """

    scene: Scene
    contact: Contact
    orders: tuple[int, ...]
    tolerance: float
    loads: tuple[float, float]
    moving: bool
    by_hand: bool
    forces: bool

    @property
    def nominal(self) -> Scene:
        """The steady scan at the scene's own speed and load."""
        scan = self.scene.scan.model_copy(update={"stroke": None, "trajectory": None, "load": self.load})
        return self.scene.model_copy(update={"scan": scan})

    @property
    def load(self) -> float:
        """The scan's load (N), a pull too; or the lift load where it presses less."""
        load = self.scene.scan.load
        return load if load < 0.0 else max(load, self.scene.scan.lift_load)

    @property
    def pressed(self) -> float:
        """The load (N) at which the contact is pressed."""
        return max(self.load, self.scene.scan.lift_load)

    @property
    def turns(self) -> float:
        """Texture periods a second, signed."""
        return self.scene.scan.speed / self.scene.texture.period


def plan_simulation(case: Case, terms: Terms) -> SimulationPlan:
    """Return how `case` is simulated with `terms`; CannotRender where the contact changes its shape with the load."""
    if not case.contact.of_one_shape and case.loads[0] != case.loads[1]:
        raise CannotRender(
            "An effect that shapes the contact (contact_growth, curvature) and one that moves it (inertia, "
            "viscous_skin, adhesion) go together at a load that does not change: the simulation reads a contact of one "
            "shape. Leave one of them out, or keep the load constant."
        )
    asked, lift_load = Asked(static=True, forces=case.forces), case.scene.scan.lift_load
    steps = max(2, math.ceil(FEWEST_STEPS / case.scene.output.sample_rate))
    room = BUSY / (steps * case.scene.output.sample_rate)
    stepper = stepper_of(case.contact, terms, case.pressed, _loads(case), lift_load, case.tolerance, asked, room)
    simulation = Simulation(
        stepper=stepper,
        scene=case.nominal,
        steps=steps,
        filters=_filters(case, terms, steps),
        reference=_reference(case, stepper),
        offset=0.0,
        held=terms.adhesion is not None,
        settling=terms.settling(stiffness_round(case.contact, case.pressed)),
    )
    coarse = _pilot(simulation, case)
    while True:
        finer = replace(simulation, steps=2 * simulation.steps, filters=_filters(case, terms, 2 * simulation.steps))
        fine = _pilot(finer, case)
        unsettled = fine.differs_from(coarse)
        fastest = 2 * case.scene.output.sample_rate * simulation.steps > _most_steps(simulation)
        if fastest or max(unsettled) <= SETTLED * case.tolerance:
            return _planned(case, terms, (simulation, finer), coarse, unsettled)
        simulation, coarse = finer, fine


@dataclass(frozen=True, slots=True)
class Pilot:
    """A run at the scan's speed and load: float64 [orders, frames] of z and of the elastic z; the offset of
    displacement (m). alone: nothing may be added to the response, as it has none for loads below 0, and what follows a
    hand is later than it."""

    moved: Array
    static: Array
    offset: float
    alone: bool

    @property
    def change(self) -> tuple[float, ...]:
        """What the effects change of each order, relative to the elastic peak-to-peak."""
        pairs = zip(self.static, self.moved, strict=True)
        return tuple(relative_change(before, after) for before, after in pairs)

    @property
    def added(self) -> bool:
        """True where the change is small enough to be added to the response."""
        return max(self.change) <= SMALL and not self.alone

    def differs_from(self, other: Pilot) -> tuple[float, ...]:
        """Return the largest difference of each order from another pilot, relative to the peak-to-peak."""
        gaps = self.moved - other.moved
        if self.added:
            gaps -= self.static - other.static
        extents = np.ptp(self.moved, axis=1)
        return tuple(
            float(np.max(np.abs(gap))) / extent if extent > 0.0 else 0.0
            for gap, extent in zip(gaps, extents, strict=True)
        )


def _pilot(simulation: Simulation, case: Case) -> Pilot:
    """Return a run of whole periods; only a run of one that is too long may hold a part of it."""
    rate = case.scene.output.sample_rate
    period = 1.0 / abs(case.turns) if case.turns else PILOT
    seconds = min(period * max(1.0, math.ceil(PILOT / period)), max(LONGEST_PILOT, PILOT))
    frames = max(64, round(seconds * rate))
    signals = tuple(Signal(kind, order) for kind in (RESPONSE, STATIC_RESPONSE) for order in case.orders)
    rows = Running(simulation, signals).along(0, frames)
    moved, static = rows[: len(case.orders)], rows[len(case.orders) :]
    offset = 0.0
    if case.orders[0] == 0:
        offset = float(np.mean(moved[0] - static[0]))
        moved[0] -= offset
    return Pilot(moved, static, offset, case.by_hand or min(case.loads) < 0.0)


def _planned(
    case: Case, terms: Terms, tried: tuple[Simulation, Simulation], pilot: Pilot, unsettled: tuple[float, ...]
) -> SimulationPlan:
    """Return the plan: the stepper without what only the pilot wanted, and the errors added up."""
    simulation, added = tried[0], pilot.added
    if isinstance(simulation.stepper, SkinStepper):
        of_contact = _point_errors(case, simulation.stepper, simulation, pilot)
    else:
        of_contact = _table_errors(case, terms, simulation, pilot)
    filtered = 10.0 ** (-_attenuation(case) / 20.0)
    share = max(pilot.change) if added else 1.0  # what the filter's error is of
    errors = tuple(4.0 / 3.0 * one + other + share * filtered for one, other in zip(unsettled, of_contact, strict=True))
    stepper = asking(simulation.stepper, Asked(static=added, forces=case.forces))
    return SimulationPlan(
        simulation=replace(simulation, scene=case.scene, stepper=stepper, offset=pilot.offset),
        added=added,
        orders=case.orders,
        change=pilot.change,
        errors=errors,
        extents=tuple(float(extent) for extent in np.ptp(pilot.moved, axis=1)),
        peaks=tuple(float(peak) for peak in np.max(np.abs(pilot.moved), axis=1)),
        pilot=pilot,
        nominal=tried[0],
        finer=tried[1],
    )


def _point_errors(case: Case, stepper: SkinStepper, simulation: Simulation, pilot: Pilot) -> tuple[float, ...]:
    """Return what the points of the skin leave of each order, relative to its peak-to-peak: from half as many."""
    load = max(case.pressed, stepper.load_law.lightest)
    points = SkinPoints.of_contact(case.contact, load, (stepper.points.count + 1) // 2)
    halved = _pilot(replace(simulation, stepper=replace(stepper, points=points)), case)
    moved = halved.moved - np.mean(halved.moved - pilot.moved, axis=1)[:, np.newaxis]
    return tuple(LEFT_BY_POINTS * float(one) for one in replace(halved, moved=moved).differs_from(pilot))


def _table_errors(case: Case, terms: Terms, simulation: Simulation, pilot: Pilot) -> tuple[float, ...]:
    """Return what the error of the stepper's own contact makes of each order, relative to its peak-to-peak.

    The stepper's own equilibrium is compared with the exact one over a period; how much of that comes through at each
    harmonic is the linear motion's: K / (K - m w^2 + i c w), less 1 where the elastic z is taken off again.
    """
    stepper = simulation.stepper
    assert isinstance(stepper, TableStepper)
    sticks = stepper.pull > 0.0
    gap = np.fft.rfft(_adhesive_gap(case, stepper) if sticks else _elastic_gap(case, stepper)) / PHASES
    limit = harmonics_within(case)
    frequency = 2.0 * math.pi * abs(case.turns) * np.arange(len(gap))
    stiffness = stiffness_round(case.contact, case.pressed)
    through = 1.0 / (1.0 + (1j * terms.damping * frequency - terms.mass * frequency**2) / stiffness)
    seen = gap * (through - 1.0 if pilot.added and not sticks else through)
    seen[limit + 1 :] = 0.0
    errors = []
    for order, extent in zip(case.orders, np.ptp(pilot.moved, axis=1), strict=True):
        curve = curves(seen, order, points_for(len(seen) - 1)) * abs(case.turns) ** order
        errors.append(STIFFER * float(np.max(np.abs(curve))) / extent if extent > 0.0 else 0.0)
    return tuple(errors)


def _elastic_gap(case: Case, stepper: Stepper) -> Array:
    """Return by how much (m) the stepper's elastic z lies above the exact one, over a period."""
    phases = np.arange(PHASES) / PHASES
    whole = (np.arange(PHASES, dtype=np.uint64)) << np.uint64(64 - int(math.log2(PHASES)))
    rows = np.empty((ROWS, PHASES))
    state = stepper.start(0, case.pressed, 0.0, 1.0 / case.scene.output.sample_rate)
    stepper.run(state, whole, np.full(PHASES, case.pressed), rows)
    return np.asarray(rows[STATIC] - case.contact.approach(phases, case.pressed)[0])


def _adhesive_gap(case: Case, stepper: TableStepper) -> Array:
    """Return by how much (m) a finger that adhesion holds, at rest, lies above the exact equilibrium, over a period."""
    still = replace(stepper, mass=0.0, damping=0.0)
    phases = np.arange(PHASES) / PHASES
    whole = (np.arange(PHASES, dtype=np.uint64)) << np.uint64(64 - int(math.log2(PHASES)))
    rows = np.empty((ROWS, PHASES))
    load = case.load
    still.run(still.start(0, load, 0.0, 1.0), whole, np.full(PHASES, load), rows)
    depth, touching = case.contact.measure(phases, rows[HEIGHT], case.pressed)
    far, wide = case.contact.measure(phases, rows[HEIGHT] - stepper.reach, case.pressed)
    stiffness, pulling = case.contact.stiffness_at(case.pressed), stepper.pull / stepper.reach
    excess = (stiffness + pulling) * depth - pulling * far - load
    slope = (stiffness + pulling) * touching - pulling * wide
    held = (rows[ATTACHED] > 0.0) & (slope > 0.0)
    return np.where(held, -excess / np.where(held, slope, 1.0), 0.0)


def _reference(case: Case, stepper: TableStepper | SkinStepper) -> Callable[[Array], Array]:
    """Return z (m) that displacement is about; points of skin stand about another mean than the contact itself."""
    mean = mean_curve(case.contact, _mean_loads(case), case.pressed, case.tolerance)
    if isinstance(stepper, TableStepper):
        return mean
    raised = float(np.mean(_elastic_gap(case, stepper)))
    return lambda roots: mean(roots) + raised


def harmonics_within(case: Case) -> int:
    """Return how many harmonics of the scan's fundamental lie in the pass band."""
    passing = _band(case)[0] * case.scene.output.sample_rate
    return int(min(PHASES // 2 - 1, passing / abs(case.turns) if case.turns else PHASES // 2 - 1))


def _loads(case: Case) -> tuple[float, float]:
    """Return between which loads (N) the stepper's contact must be right."""
    low, high = case.loads
    if case.by_hand:
        return case.scene.scan.lift_load, max(4.0 * case.pressed, HEAVIEST_HAND)
    return max(min(low, case.pressed), case.scene.scan.lift_load), max(high, case.pressed)


def _most_steps(simulation: Simulation) -> float:
    """Return how many steps a second BUSY allows."""
    return BUSY / step_time(simulation.stepper)


def _mean_loads(case: Case) -> tuple[float, float]:
    low, high = case.loads
    return (case.pressed, case.pressed) if low == high else (max(low, 0.0), max(high, case.pressed))


def _band(case: Case) -> tuple[float, float]:
    """Return the ends of what is kept and of what is removed, as parts of the rate."""
    passing, stopping = MOVING_BAND if case.moving else STEADY_BAND
    bandwidth = case.scene.output.bandwidth
    part = math.inf if bandwidth is None else bandwidth / case.scene.output.sample_rate
    return (part, min(WIDENING * part, MOVING_BAND[1])) if part < passing else (passing, stopping)


def _attenuation(case: Case) -> float:
    asked = min(max(-20.0 * math.log10(0.1 * case.tolerance), LEAST_ATTENUATION), MOST_ATTENUATION)
    # derivatives raise what lies above a narrow band
    return asked + 20.0 * max(case.orders) * math.log10(max(STEADY_BAND[0] / _band(case)[0], 1.0))


def _filters(case: Case, terms: Terms, steps: int) -> Decimator:
    orders = tuple(sorted({0, *case.orders}))
    rate, band = case.scene.output.sample_rate, _band(case)
    heavy = terms.mass * (math.pi * band[0] * rate) ** 2 > stiffness_round(case.contact, case.pressed)
    return Decimator.of(orders, rate, steps, band, _attenuation(case), of_mass=heavy)
