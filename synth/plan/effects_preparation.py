"""Prepare the effects of a scene: they become another contact, a simulation, or stages of the output.

Stage   2, the part of `prepare` that only scenes with effects need. `effect_choice` chooses the effects.
Model   See `effect`. Effects on the balance that are set to "auto" are judged one after another, each with a pilot that
        has the effect and one that does not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from synth.contact.load_balance import Contact
from synth.effects.effect import AddedChannel, BalanceEffect, Effect, Kind, OutputStage, ShapeEffect
from synth.effects.simulation.terms import Terms
from synth.errors import SceneError
from synth.motion.motion import LARGEST_LOAD
from synth.plan.channels import NEARLY, PEAK, ROUNDING, STILL, ChannelPlan, extent_and_peak
from synth.plan.effect_choice import (
    LeftOut,
    SimulatedEffect,
    SimulationCase,
    Tried,
    asked,
    beside,
    groups,
    judged,
    largest_of,
    motion_of,
    moving_ends,
    outputs_of,
    relative_change,
    unfit,
    unresolved,
)
from synth.plan.motion_peak import steady_peak
from synth.plan.request import Request
from synth.response.demand import Demand, curves, points_for
from synth.response.series_curve import SeriesCurve
from synth.response.spectrum import solve_spectrum
from synth.response.table_making import HEAVIEST
from synth.scene.scene import Scene

if TYPE_CHECKING:
    from synth.plan.simulation_plan import SimulationPlan

LET_GO = "The load pulls harder than the adhesion holds: the finger has come off the texture, and the output is silent."
JUDGED_TO = 0.05  # error of the series with which a shape is judged, as a part of the tolerance


@dataclass(frozen=True, slots=True)
class PreparedEffects:
    """The prepared effects of one scene.

    called: effects that are simulated, in the order in which they run.
    spared: effects that are left out, in the same order.
    simulation: simulation of the effects on the balance, or None.
    stages: stages of the effects on the output.
    silent: channels of the effects on the output, if z is silent.
    """

    called: tuple[SimulatedEffect, ...]
    spared: tuple[LeftOut, ...]
    simulation: SimulationPlan | None = None
    stages: tuple[OutputStage, ...] = ()
    silent: tuple[AddedChannel, ...] = ()

    @property
    def channels(self) -> tuple[AddedChannel, ...]:
        """The channels that the stages add, in order."""
        return (*(channel for stage in self.stages for channel in stage.channels), *self.silent)

    def warnings(self, tolerance: float, felt: float, channels: Sequence[ChannelPlan]) -> tuple[str, ...]:
        """Return a warning for each quantity that misses the tolerance, and one if the finger has come off.

        felt: largest error of an added channel without a warning, if nothing is simulated.
        channels: of the scene, whose errors are those of the simulation and of the cells of its contact.
        """
        gone: tuple[str, ...] = ()
        limit, note = felt, ""
        late = {channel.quantity: channel.error for channel in self.channels if channel.error > channel.unfelt}
        if self.simulation is not None:
            late |= {channel.quantity: channel.error for channel in channels}
            limit, note = NEARLY * tolerance, " Effects are simulated step by step."
            if self.simulation.let_go:
                gone = (LET_GO,)
        return gone + tuple(
            f"The error of the {quantity.replace('_', ' ')} is {error:.2g} of its peak-to-peak; the tolerance is "
            f"{tolerance:.2g}.{note}"
            for quantity, error in late.items()
            if error > limit
        )

    def scaled_as(self, other: PreparedEffects) -> PreparedEffects:
        """Return the effects of a silent scene with the full scales of `other`."""
        pairs = zip(self.silent, other.channels[len(self.channels) - len(self.silent) :], strict=False)
        return replace(self, silent=tuple(replace(now, full_scale=then.full_scale) for now, then in pairs))

    def louder(self, times: float, moved: tuple[float, ...]) -> PreparedEffects:
        """Return the effects with larger automatic full scales. `times` and `moved` are those of `OutputStage`."""
        silent = tuple(replace(one, full_scale=one.full_scale * times) for one in self.silent)
        return replace(self, stages=tuple(stage.louder(times, moved) for stage in self.stages), silent=silent)


def shape_for(
    contact: Contact, scene: Scene, demand: Demand, loads: tuple[float, float], turns: float, tolerance: float
) -> tuple[Contact, PreparedEffects]:
    """Return the contact in the shape that the effects of `scene` give it, and the effects on the shape.

    demand: harmonics, orders and tolerance of the scene's series; tolerance: that of the scene.
    loads: smallest and largest load of the scan, N.
    turns: texture periods per second.
    """
    heaviest = max(*loads, scene.scan.lift_load)
    of_cells = heaviest if heaviest < LARGEST_LOAD else max(HEAVIEST, scene.scan.load)  # of a hand
    judged_at = sorted({max(load, scene.scan.lift_load) for load in (*loads, scene.scan.load)})
    called: list[SimulatedEffect] = []
    spared: list[LeftOut] = []
    for given, autos in groups(scene, Kind.SHAPE):
        for effect, settings in given:
            assert isinstance(effect, ShapeEffect)
            contact = effect.shaped(contact, settings).covering(of_cells)
            called.append(SimulatedEffect(effect, settings))
        tried: list[Tried] = []
        for effect, settings in autos:
            assert isinstance(effect, ShapeEffect)
            reason = unfit(scene, effect, load_varies=loads[0] != loads[1])
            if given or reason:
                spared.append(LeftOut(effect.name, reason, None) if reason else _beside_given(effect, given[0][0]))
                continue
            try:
                shaped = effect.shaped(contact, settings).covering(of_cells)
                shaped.geometry_at(heaviest)
                change = _shape_change(contact, shaped, demand, judged_at)
            except SceneError as error:
                spared.append(LeftOut(effect.name, f"It has no solution here: {error}", None))
                continue
            tried.append(Tried(judged(effect, settings, demand.orders, change, turns, tolerance), change, shaped))
        chosen, others = largest_of(tried)
        spared += others
        if chosen is not None:
            contact = chosen.result
            called.append(chosen.simulated)
    return contact, PreparedEffects(tuple(called), tuple(spared))


def _beside_given(effect: Effect, other: Effect) -> LeftOut:
    return beside(effect, other, "which the scene sets", None)


def _shape_change(plain: Contact, shaped: Contact, demand: Demand, loads: list[float]) -> tuple[float, ...]:
    """Return the largest change of each order over `loads`, relative to the peak-to-peak of the plain contact."""
    finer = Demand(demand.highest, demand.orders, JUDGED_TO * demand.tolerance)
    points, kept = points_for(demand.highest), slice(demand.highest + 1)
    pairs = [[solve_spectrum(one, load, finer).harmonics[kept] for one in (plain, shaped)] for load in loads]
    return tuple(
        max(relative_change(*(curves(series, order, points) for series in pair)) for pair in pairs)
        for order in demand.orders
    )


def effects_of(case: SimulationCase, shapes: PreparedEffects) -> PreparedEffects:
    """Return the effects of `case`, without the stages of the output. The contact of `case` has its shape.

    Raises SceneError if two of them cannot be combined under the loads of `case`.
    """
    if case.load_varies and not case.contact.of_one_surface:
        for law, _settings, auto in asked(case.scene, Kind.BALANCE):
            if isinstance(law, BalanceEffect) and law.needs_fixed_ends and not auto:
                raise moving_ends(shapes.called[0].effect.name, law.name)
    plan, called, spared = _simulated(case)
    called += [SimulatedEffect(*one) for one in outputs_of(case.scene) if one[0].kind == Kind.OUTPUT]
    moving, resting = motion_of(case.scene, by_hand=case.by_hand)
    return PreparedEffects((*moving, *shapes.called, *called), (*resting, *shapes.spared, *spared), plan)


def left_out(scene: Scene, silence: str, error: float, *, by_hand: bool) -> PreparedEffects:
    """Return the effects of a scene whose z is silent: those on the motion are simulated, the others are silent.

    error: of silent channels, relative to their peak-to-peak.
    by_hand: whether a hand sets the motion, instead of the scan.
    """
    silent = []
    for effect, settings in outputs_of(scene):
        if effect.kind == Kind.OUTPUT:
            for quantity, scale in zip(effect.channels(scene, settings), effect.scales(settings), strict=True):
                silent.append(AddedChannel(quantity, scale or 1.0, 0.0, error, "silence"))
    called, spared = motion_of(scene, by_hand=by_hand)
    moving = {effect.name for effect, _settings, _auto in asked(scene, Kind.MOTION)}
    spared += [LeftOut(name, silence, 0.0) for name in scene.effects if name not in moving]
    return PreparedEffects(tuple(called), tuple(spared), silent=tuple(silent))


def simulated_channel(
    base: ChannelPlan, full_scale: float | None, plan: SimulationPlan, request: Request, *, along: bool
) -> ChannelPlan:
    """Return the plan of a channel of a simulated scene.

    base: plan of the channel with the response only.
    full_scale: full scale in the scene, SI, or None.
    along: whether the full scale of `base` is that of the scan's own motion.
    """
    if base.order not in plan.orders:  # a finger at rest has no velocity
        return base
    place, scene, reader = plan.orders.index(base.order), request.scene, None
    peak, extent, level = plan.peaks[place], plan.extents[place], plan.level if base.is_approach else 0.0
    series = None if request.moving else plan.series(base.order)
    if series is not None:
        reader = SeriesCurve(series)
        extent, peak = extent_and_peak(series)
    peak += abs(level)
    if reader is not None and not request.live:
        peak = steady_peak(reader, level, scene)
    scale = full_scale or (peak / PEAK if peak > STILL else 1.0)
    if full_scale is None and along and base.is_approach:
        scale = base.full_scale
    rounding = ROUNDING * max(1.0, abs(level) / extent) if reader is not None and extent > 0.0 else 0.0
    return ChannelPlan(base.quantity, base.order, scale, plan.errors[place] + rounding, extent, reader, level)


def _simulated(case: SimulationCase) -> tuple[SimulationPlan | None, list[SimulatedEffect], list[LeftOut]]:
    """Return the simulation of the effects on the balance, the effects simulated, and the effects left out."""
    terms, called, spared = Terms(), [], list[LeftOut]()
    ordered = groups(case.scene, Kind.BALANCE)
    for effect, settings in (one for given, _autos in ordered for one in given):
        assert isinstance(effect, BalanceEffect)
        terms = effect.balanced(terms, settings)
        called.append(SimulatedEffect(effect, settings))
    if not ordered:
        return None, [], []
    from synth.plan.simulation_plan import plan_simulation

    ends_move = not case.contact.of_one_surface
    plan = None if (terms.of_rest if case.rests else terms).quasi_static else plan_simulation(case, terms)
    for given, autos in ordered:
        tried: list[Tried] = []
        for effect, settings in autos:
            assert isinstance(effect, BalanceEffect)
            reason = unfit(case.scene, effect, load_varies=case.load_varies, ends_move=ends_move)
            if given or reason:
                spared.append(LeftOut(effect.name, reason, None) if reason else _beside_given(effect, given[0][0]))
                continue
            candidate = effect.balanced(terms, settings)
            if case.rests and candidate.of_rest == terms.of_rest:
                spared.append(LeftOut(effect.name, "The finger rests, so it changes nothing.", 0.0))
                continue
            try:
                found = plan_simulation(case, candidate)
            except SceneError as error:
                spared.append(LeftOut(effect.name, f"It has no solution here: {error}", None))
                continue
            change = found.change
            if plan is not None:
                change = tuple(map(relative_change, plan.pilot.moved, found.pilot.moved))
            verdict = judged(effect, settings, case.orders, change, case.turns, case.tolerance)
            known = (0.0,) * len(change) if plan is None else plan.errors
            verdict = unresolved(effect, case.orders, change, found.errors, known, case.tolerance) or verdict
            tried.append(Tried(verdict, change, (candidate, found)))
        chosen, others = largest_of(tried)
        spared += others
        if chosen is not None:
            terms, plan = chosen.result
            called.append(chosen.simulated)
    return plan, sorted(called, key=lambda one: one.effect.name), spared
