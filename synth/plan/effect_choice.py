"""Which effects a scene calls for: those it sets, and those it leaves to us that change enough of its output.

Stage   2, used by `preparation`.
Model   "auto" is decided by what the effect does to this scene, at its own speed and load: the output is computed with
        and without it, and the largest difference is told relative to the peak-to-peak without it. PUT_IN of the
        tolerance and more is simulated. Effects are decided in the order in which they run, each against what is
        simulated before it.
Limits  an estimate, within a factor of two of what a whole render changes by.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.contact.load_balance import Contact
from synth.effects.effect import BalanceEffect, Effect, Kind, OutputEffect, ShapeEffect
from synth.effects.simulation.terms import Terms
from synth.errors import CannotRender
from synth.response.spectrum import Demand, curves, points_for, solve_spectrum
from synth.scene.effect_registry import declaration
from synth.scene.effects_section import AUTO, FrozenMapping
from synth.scene.scene import Scene

OF_ONE_SHAPE = (
    "An effect that shapes the contact (contact_growth, curvature) and one that moves it (inertia, viscous_skin, "
    "adhesion) go together at a load that does not change: the simulation reads a contact of one shape. Leave one of "
    "them out, or keep the load constant."
)
PUT_IN = 0.4  # of the tolerance: between a tenth, below which nobody would miss it, and all of it
JUDGED_TO = 0.05  # of the tolerance: error of the series by which a shape is judged
MEAN_PHASES = 64  # of a period over which the contact is averaged: more would move its stiffness by less than 1 %
QUANTITIES: Mapping[int, str] = {0: "displacement", 1: "velocity", 2: "acceleration"}


@dataclass(frozen=True, slots=True)
class SimulationCase:
    """What is to be simulated: the scene, its contact, and what is wanted of it.

    orders: time derivatives of z, rising. tolerance: as a number. loads: smallest and largest (N). moving: its speed or
    load changes. live: its blocks have deadlines. forces: the horizontal forces are wanted too.
    """

    scene: Scene
    contact: Contact
    orders: tuple[int, ...]
    tolerance: float
    loads: tuple[float, float]
    moving: bool
    by_hand: bool
    live: bool
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

    @property
    def stiffness(self) -> float:
        """What a small motion meets at the load (N/m)."""
        return stiffness_round(self.contact, self.pressed)


def stiffness_round(contact: Contact, load: float) -> float:
    """Return the mean of -dF/dz (N/m) over a period at `load` (N): what a small motion meets."""
    phases = np.arange(MEAN_PHASES) / MEAN_PHASES
    height, _slope = contact.approach(phases, load)
    _depth, touching = contact.measure(phases, height, load)
    return float(contact.stiffness_at(load) * np.mean(touching))


@dataclass(frozen=True, slots=True)
class SimulatedEffect:
    """An effect that is simulated. reason: why "auto" put it in, as a sentence; "" where the scene asks for it."""

    effect: Effect
    settings: Any
    reason: str = ""


@dataclass(frozen=True, slots=True)
class LeftOutEffect:
    """An effect that is left out: its name, why, and what it would change, relative."""

    name: str
    reason: str
    change: float


def asked(scene: Scene, kind: Kind) -> Iterator[tuple[Effect, Any, bool]]:
    """Yield the effects of one kind that `scene` names, in order, with their settings, and whether they are left to
    us.
    """
    for effect in in_order([effect for effect in map(effect_called, scene.effects) if effect.kind == kind]):
        settings = scene.effects[effect.name]
        yield effect, effect.settings() if settings == AUTO else settings, settings == AUTO


def require_one_shape(scene: Scene) -> None:
    """Raise CannotRender where `scene` asks for effects on shape and balance both: no hand may lead these."""
    if all(any(not auto for *_effect, auto in asked(scene, kind)) for kind in (Kind.SHAPE, Kind.BALANCE)):
        raise CannotRender(OF_ONE_SHAPE)


def effect_called(name: str) -> Effect:
    """Return the effect of that name."""
    effect = declaration(name)
    assert isinstance(effect, Effect), f"{name} is of no kind"
    return effect


def in_order(effects: list[Effect]) -> list[Effect]:
    """Return effects of one kind in the order of their names, each behind those that it declares to come after."""
    waiting, ordered = sorted(effects, key=lambda effect: effect.name), []
    while waiting:
        names = {effect.name for effect in waiting}
        ready = next(effect for effect in waiting if not names.intersection(effect.after))
        waiting.remove(ready)
        ordered.append(ready)
    return ordered


def judged(
    effect: Effect, settings: Any, orders: tuple[int, ...], change: tuple[float, ...], turns: float, tolerance: float
) -> SimulatedEffect | LeftOutEffect:
    """Return `effect` as called for or spared, by what it changes of each order, relative to its peak-to-peak."""
    largest = max(change)
    words = (
        f"It moves the {QUANTITIES[orders[change.index(largest)]]} by {largest:.2g} of its peak-to-peak at "
        f"{abs(turns):.4g} Hz, tolerance {tolerance:.2g}."
    )
    return (
        SimulatedEffect(effect, settings, words)
        if largest > PUT_IN * tolerance
        else LeftOutEffect(effect.name, words, largest)
    )


def shape_of(
    contact: Contact, scene: Scene, demand: Demand, loads: tuple[float, ...], turns: float
) -> tuple[Contact, list[SimulatedEffect], list[LeftOutEffect]]:
    """Return the contact with the shapes that `scene` calls for, those effects, and those left out.

    demand: what a series of this scene must hold. loads: N, at which a change is judged. turns: texture periods a
    second.
    """
    called: list[SimulatedEffect] = []
    spared: list[LeftOutEffect] = []
    for effect, settings, auto in asked(scene, Kind.SHAPE):
        assert isinstance(effect, ShapeEffect)
        shaped = effect.shaped(contact, settings)
        verdict: SimulatedEffect | LeftOutEffect = SimulatedEffect(effect, settings)
        if auto:
            relative = _shape_change(contact, shaped, demand, loads)
            verdict = judged(effect, settings, demand.orders, relative, turns, demand.tolerance)
        if isinstance(verdict, SimulatedEffect):
            contact = shaped
            called.append(verdict)
        else:
            spared.append(verdict)
    return contact, called, spared


def terms_of(scene: Scene) -> tuple[Terms, list[SimulatedEffect], list[tuple[BalanceEffect, Any]]]:
    """Return the terms of the balance that `scene` sets, those effects, and the effects that it leaves to us."""
    terms, called, open_ones = Terms(), [], []
    for effect, settings, auto in asked(scene, Kind.BALANCE):
        assert isinstance(effect, BalanceEffect)
        if auto:
            open_ones.append((effect, settings))
        else:
            terms = effect.balanced(terms, settings)
            called.append(SimulatedEffect(effect, settings))
    return terms, called, open_ones


def outputs_of(scene: Scene) -> list[tuple[OutputEffect[Any], Any]]:
    """Return the effects on the output that `scene` calls for, with their settings."""
    found = []
    for effect, settings, _auto in asked(scene, Kind.OUTPUT):
        assert isinstance(effect, OutputEffect)
        found.append((effect, settings))
    return found


def added_quantities(scene: Scene) -> tuple[str, ...]:
    """Return the quantities of the channels that the effects of `scene` add."""
    return tuple(quantity for effect, settings in outputs_of(scene) for quantity in effect.channels(settings))


def with_added_scales(scene: Scene, full_scale: tuple[float | None, ...]) -> Scene:
    """Return `scene` with the full scale of each channel that its effects add."""
    chosen, place = dict(scene.effects), 0
    for effect, settings in outputs_of(scene):
        count = len(effect.channels(settings))
        chosen[effect.name] = effect.scaled(settings, full_scale[place : place + count])
        place += count
    return scene.model_copy(update={"effects": FrozenMapping(chosen)})


def _shape_change(plain: Contact, shaped: Contact, demand: Demand, loads: tuple[float, ...]) -> tuple[float, ...]:
    """Return the largest change of each order over `loads`, relative to its peak-to-peak in the plain contact."""
    finer = Demand(demand.highest, demand.orders, JUDGED_TO * demand.tolerance)
    largest = [0.0] * len(demand.orders)
    for load in loads:
        series = [solve_spectrum(contact, load, finer).harmonics for contact in (plain, shaped)]
        for place, order in enumerate(demand.orders):
            before, after = (curves(one[: demand.highest + 1], order, points_for(demand.highest)) for one in series)
            largest[place] = max(largest[place], relative_change(before, after))
    return tuple(largest)


def relative_change(before: Array, after: Array) -> float:
    """Return the largest difference of two curves, relative to the peak-to-peak of the first."""
    difference, extent = float(abs(after - before).max()), float(before.max() - before.min())
    if extent > 0.0:
        return difference / extent
    return float("inf") if difference > 0.0 else 0.0
