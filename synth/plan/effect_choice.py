"""Which effects a scene calls for: those it sets, and those it leaves to us that change enough of its output.

Stage   2, used by `preparation`.
Model   "auto" is decided by what the effect does to this scene, at its own speed and load: the output is computed with
        and without it, and the largest difference is told relative to the peak-to-peak without it. PUT_IN of the
        tolerance and more is simulated. Effects are decided in the order in which they run, each against what is
        simulated before it.
Limits  an estimate, within a factor of two of what a whole render changes by.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.contact.load_balance import Contact
from synth.effects.effect import Effect, Kind, OutputEffect
from synth.errors import CannotRender
from synth.plan.request import Request
from synth.response.reading_filter import ORDERS
from synth.response.table_error import QUANTITIES
from synth.scene.effects_section import AUTO, FrozenMapping, declaration
from synth.scene.scene import Scene

OF_ONE_SHAPE = (
    "An effect that shapes the contact (contact_growth, curvature) and one that moves it (inertia, viscous_skin, "
    "adhesion) go together at a load that does not change: the simulation reads a contact of one shape. Leave one of "
    "them out, or keep the load constant."
)
PUT_IN = 0.4  # of the tolerance: between a tenth, below which nobody would miss it, and all of it
MEAN_PHASES = 64  # of a period over which the contact is averaged: more would move its stiffness by less than 1 %


@dataclass(frozen=True, slots=True)
class SimulationCase(Request):
    """What is to be simulated: a request, its contact in its shape, and the tolerance as a number."""

    contact: Contact
    tolerance: float

    @property
    def orders(self) -> tuple[int, ...]:
        """The time derivatives of the channels, rising, of a finger that stands still too."""
        return tuple(sorted({ORDERS[channel.quantity] for channel in self.scene.output.channel_list}))

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
class LeftOut:
    """One thing that is not simulated: why, and how much of the output it would change (relative, or None: nothing)."""

    name: str
    reason: str
    effect_on_output: float | None


def asked(scene: Scene, kind: Kind) -> Iterator[tuple[Effect, Any, bool]]:
    """Yield the effects of one kind that `scene` names, in order, with their settings, and whether they are left to
    us.
    """
    for name in sorted(scene.effects):
        effect, settings = effect_called(name), scene.effects[name]
        if effect.kind == kind:
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


def judged(
    effect: Effect, settings: Any, orders: tuple[int, ...], change: tuple[float, ...], turns: float, tolerance: float
) -> SimulatedEffect | LeftOut:
    """Return `effect` as called for or spared, by what it changes of each order, relative to its peak-to-peak."""
    largest = max(change)
    words = (
        f"It moves the {QUANTITIES[orders[change.index(largest)]]} by {largest:.2g} of its peak-to-peak at "
        f"{abs(turns):.4g} Hz, tolerance {tolerance:.2g}."
    )
    if largest > PUT_IN * tolerance:
        return SimulatedEffect(effect, settings, words)
    return LeftOut(effect.name, words, largest)


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


def relative_change(before: Array, after: Array) -> float:
    """Return the largest difference of two curves, relative to the peak-to-peak of the first."""
    difference, extent = float(abs(after - before).max()), float(before.max() - before.min())
    if extent > 0.0:
        return difference / extent
    return float("inf") if difference > 0.0 else 0.0
