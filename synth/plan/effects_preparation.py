"""What the effects of a scene become when it is prepared: another contact, a simulation, stages of the output.

Stage   2, the part of `preparation` that a scene with effects alone pays for; `effect_choice` says which there are.
Model   see `effect`. Effects on the balance that are left to us are judged one after another, each by a pilot with and
        one without it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from synth.contact.balance import Contact
from synth.effects.effect import AddedChannel, Kind, OutputStage
from synth.plan.channels import ORDERS, PEAK, STILL, ChannelPlan
from synth.plan.effect_choice import Called, Change, Spared, asked, judged, outputs_of, shape_of, terms_of
from synth.response.cache import ResponseCache
from synth.response.spectrum import Demand
from synth.scene.scene import Scene

if TYPE_CHECKING:
    from synth.plan.simulation_pilot import Case
    from synth.plan.simulation_plan import SimulationPlan

NEARLY = 1.05  # times the tolerance: less than this is not worth a warning, since the error is itself an estimate
QUANTITIES: Mapping[int, str] = {0: "displacement", 1: "velocity", 2: "acceleration"}


@dataclass(frozen=True, slots=True)
class PreparedEffects:
    """The effects of one scene, ready.

    called, spared: what is simulated and what is left out, in the order in which they run. simulation: of the effects
    on the balance, None where there are none. stages: of the effects on the output; silent: their channels in a scene
    that is silent.
    """

    called: tuple[Called, ...]
    spared: tuple[Spared, ...]
    simulation: SimulationPlan | None = None
    stages: tuple[OutputStage, ...] = ()
    silent: tuple[AddedChannel, ...] = ()

    @property
    def channels(self) -> tuple[AddedChannel, ...]:
        """The channels that the stages add, in order."""
        return self.silent or tuple(channel for stage in self.stages for channel in stage.channels)

    def warnings(self, tolerance: float) -> tuple[str, ...]:
        """Return what a listener should know: what misses the tolerance."""
        late = {channel.quantity: channel.error for channel in self.channels}
        gone: tuple[str, ...] = ()
        if self.simulation is not None and self.simulation.let_go:
            gone = ("The finger pulls harder than what holds it: it has let go, and nothing moves.",)
        if self.simulation is not None:
            pairs = zip(self.simulation.orders, self.simulation.errors, strict=True)
            late |= {QUANTITIES[order]: error for order, error in pairs}
        return gone + tuple(
            f"The {quantity.replace('_', ' ')} reaches an error of {error:.2g} of its peak-to-peak, not the "
            f"{tolerance:.2g} asked for: effects are simulated step by step."
            for quantity, error in late.items()
            if error > NEARLY * tolerance
        )

    def scaled_as(self, other: PreparedEffects) -> PreparedEffects:
        """Return silent effects with the full scales of another preparation's channels."""
        pairs = zip(self.silent, other.channels, strict=False)
        return replace(self, silent=tuple(replace(now, full_scale=then.full_scale) for now, then in pairs))

    def louder(self, times: float) -> PreparedEffects:
        """Return the effects with the automatic full scale of each channel that they add so many times as large."""
        silent = tuple(replace(one, full_scale=one.full_scale * times) for one in self.silent)
        return replace(self, stages=tuple(stage.louder(times) for stage in self.stages), silent=silent)

    @property
    def memory_bytes(self) -> int:
        """Bytes that they hold."""
        held = 0 if self.simulation is None else self.simulation.memory_bytes
        return held + sum(stage.memory_bytes for stage in self.stages)


def shape_for(
    contact: Contact, scene: Scene, demand: Demand, loads: tuple[float, float], turns: float
) -> tuple[Contact, PreparedEffects]:
    """Return the contact in the shape that `scene` calls for, and the effects that shape it."""
    low, high = (max(load, scene.scan.lift_load) for load in loads)
    judged_at = tuple(sorted({low, max(scene.scan.load, scene.scan.lift_load), high}))
    quantities = tuple(QUANTITIES[order] for order in demand.orders)
    shaped, called, spared = shape_of(contact, scene, demand, judged_at, quantities, turns)
    return shaped, PreparedEffects(tuple(called), tuple(spared))


def effects_of(solved: Any, shapes: PreparedEffects, cache: ResponseCache) -> PreparedEffects:
    """Return all effects of what is solved so far, a `preparation.Preparation` with the contact in its shape."""
    scene: Scene = solved.scene
    called, spared, plan = list(shapes.called), list(shapes.spared), None
    if any(True for _ in asked(scene, Kind.BALANCE)):
        plan, more, without = _simulated(solved, bool(outputs_of(scene)))
        called, spared = called + more, spared + without
    found = PreparedEffects(tuple(called), tuple(spared), plan)
    stages = []
    for effect, settings in outputs_of(scene):
        stages.append(effect.prepare(replace(solved, effects=found), settings, cache))
        called.append(Called(effect, settings))
    return PreparedEffects(tuple(called), tuple(spared), plan, tuple(stages))


def left_out(scene: Scene, silence: str) -> PreparedEffects:
    """Return the effects of a scene that is silent: none is simulated; the channels that they add are silent too."""
    silent = []
    for effect, settings in outputs_of(scene):
        for quantity, scale in zip(effect.channels(settings), effect.scales(settings), strict=True):
            silent.append(AddedChannel(quantity, scale or 1.0, 0.0, 0.0, "silence"))
    spared = tuple(Spared(name, silence, 0.0) for name in scene.effects)
    return PreparedEffects((), spared, silent=tuple(silent))


def simulated_channel(base: ChannelPlan, full_scale: float | None, plan: SimulationPlan, *, along: bool) -> ChannelPlan:
    """Return a channel as it is with the simulation.

    base: with the response alone; full_scale: as asked for; along: the full scale of `base` is that of a motion.
    """
    place = plan.orders.index(base.order)
    peak, extent = plan.peaks[place], plan.extents[place]
    if base.is_approach:
        load = max(plan.nominal.scene.scan.load, 0.0)
        peak += abs(float(plan.simulation.reference(np.cbrt([load]))[0]) + plan.simulation.offset)
    scale = full_scale or (peak / PEAK if peak > STILL else 1.0)
    if full_scale is None and along and base.is_approach:
        scale = base.full_scale
    error = plan.errors[place] + (base.error if plan.added else 0.0)
    return ChannelPlan(base.quantity, base.order, scale, error, extent, base.reader if plan.added else None, base.level)


def _simulated(solved: Any, forces: bool) -> tuple[SimulationPlan | None, list[Called], list[Spared]]:
    """Return the simulation of the effects on the balance, those that are called for, and those left out."""
    from synth.plan.simulation_plan import plan_simulation

    case = _case(solved, forces)
    terms, called, open_ones = terms_of(case.scene)
    spared: list[Spared] = []
    plan = None if terms.quasi_static else plan_simulation(case, terms)
    for effect, settings in open_ones:
        candidate = effect.balanced(terms, settings)
        tried = plan_simulation(case, candidate)
        relative = tried.change if plan is None else tried.change_from(plan)
        quantities = tuple(QUANTITIES[order] for order in case.orders)
        verdict = judged(effect, settings, Change(quantities, relative, abs(case.turns)), case.tolerance)
        if isinstance(verdict, Called):
            terms, plan = candidate, tried
            called.append(verdict)
        else:
            spared.append(verdict)
    return plan, sorted(called, key=lambda one: one.effect.name), spared


def _case(solved: Any, forces: bool) -> Case:
    from synth.plan.simulation_pilot import Case

    return Case(
        scene=solved.scene,
        contact=solved.contact,
        orders=tuple(sorted({ORDERS[channel.quantity] for channel in solved.scene.output.channel_list})),
        tolerance=solved.tolerance,
        loads=solved.loads,
        moving=solved.moving,
        by_hand=solved.by_hand,
        live=solved.paced or solved.by_hand,
        forces=forces,
    )
