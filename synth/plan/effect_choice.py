"""Choose the effects that are simulated: those with settings, and those set to "auto" that change the output enough.

Stage   2, used by `preparation`.
Model   For "auto", the output of the scene is computed with and without the effect, at the scene's own speed and load.
        The change is the largest difference, relative to the peak-to-peak without the effect. The effect is simulated
        if the change is more than PUT_IN of the tolerance. Effects are judged in the order in which they run, each
        together with those that were chosen before it.
Limits  The change is an estimate. It is within a factor of two of the change of a whole render.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.contact.load_balance import Contact
from synth.effects.effect import BalanceEffect, Effect, Kind, OutputEffect
from synth.errors import Fault, SceneError
from synth.plan.request import Request
from synth.response.mean_approach import Mean
from synth.response.reading_filter import ORDERS
from synth.response.table_error import QUANTITIES
from synth.scene.effects_section import AUTO, FrozenMapping, declaration
from synth.scene.scene import Scene

PUT_IN = 0.4  # of the tolerance: between a tenth, which would be negligible, and the whole
MEAN_PHASES = 64  # phases of a period over which the contact is averaged; more would change its stiffness by under 1 %


@dataclass(frozen=True, slots=True)
class SimulationCase(Request):
    """A request to simulate.

    contact: the contact, in the shape that the effects give it.
    tolerance: the tolerance as a number.
    mean: of z over a period (m), as `preparation` has it.
    """

    contact: Contact
    tolerance: float
    mean: Mean | None = None

    @property
    def orders(self) -> tuple[int, ...]:
        """The orders of the channels' time derivatives, rising, also for a finger at rest."""
        return tuple(sorted({ORDERS[channel.quantity] for channel in self.scene.output.channel_list}))

    @property
    def nominal(self) -> Scene:
        """The steady scan at the scene's own speed and load."""
        scan = self.scene.scan.model_copy(
            update={"stroke": None, "trajectory": None, "heading": 0.0, "load": self.load}
        )
        return self.scene.model_copy(update={"scan": scan})

    @property
    def load(self) -> float:
        """The scan's load (N): a pull, or a load that is at least the lift load."""
        load = self.scene.scan.load
        return load if load < 0.0 else max(load, self.scene.scan.lift_load)

    @property
    def pressed(self) -> float:
        """The load (N) at which the contact is solved: at least the lift load."""
        return max(self.load, self.scene.scan.lift_load)


def stiffness_round(contact: Contact, load: float) -> float:
    """Return the mean of -dF/dz (N/m) over a period at `load` (N): the stiffness for small motions."""
    phases = np.arange(MEAN_PHASES) / MEAN_PHASES
    height, _slope = contact.approach(phases, load)
    _depth, touching = contact.measure(phases, height, load)
    return float(contact.stiffness_at(load) * np.mean(touching))


@dataclass(frozen=True, slots=True)
class SimulatedEffect:
    """An effect that is simulated.

    reason: why "auto" chose it, as a sentence; "" if the scene sets it.
    """

    effect: Effect
    settings: Any
    reason: str = ""


@dataclass(frozen=True, slots=True)
class LeftOut:
    """One thing that is not simulated.

    name: name of the effect or component.
    reason: why it is left out, as a sentence.
    effect_on_output: change of the output that it would cause, relative; None if none was computed.
    """

    name: str
    reason: str
    effect_on_output: float | None


def asked(scene: Scene, kind: Kind) -> Iterator[tuple[Effect, Any, bool]]:
    """Yield each effect of one kind that `scene` names, in order, with its settings and whether it is "auto"."""
    for name in sorted(scene.effects):
        effect, settings = effect_called(name), scene.effects[name]
        if effect.kind == kind:
            yield effect, effect.settings() if settings == AUTO else settings, settings == AUTO


PROBE = "a probe"


def require_one_shape(scene: Scene) -> None:
    """Raise SceneError if `scene` sets two effects that cannot be combined under a load that varies."""
    shapes = [shape.name for shape, _settings, auto in asked(scene, Kind.SHAPE) if not auto]
    shapes += [PROBE] * (scene.finger.kind == "probe")
    for law, _settings, auto in asked(scene, Kind.BALANCE):
        if shapes and isinstance(law, BalanceEffect) and law.of_one_shape and not auto:
            raise two_shapes(shapes[0], law.name)


def two_shapes(shape: str, law: str) -> SceneError:
    """Return the error of `shape`, an effect or PROBE, and the effect `law` under a load that varies."""
    hint = (
        f"{law} is simulated on a contact that keeps its shape, and with {shape} the shape follows the load. "
        "Keep the load constant, or leave one of the two out."
    )
    allowed = f"{shape} and {law} can be combined only at a constant load"
    return SceneError([Fault(f"/effects/{law}", "a load that varies, or a hand", allowed, hint)])


def effect_called(name: str) -> Effect:
    """Return the effect called `name`."""
    effect = declaration(name)
    assert isinstance(effect, Effect), f"{name} is of no kind"
    return effect


def judged(
    effect: Effect, settings: Any, orders: tuple[int, ...], change: tuple[float, ...], turns: float, tolerance: float
) -> SimulatedEffect | LeftOut:
    """Return `effect` as simulated or left out.

    orders: orders of time derivatives.
    change: change of each order by the effect, relative to its peak-to-peak.
    turns: texture periods per second.
    """
    largest = max(change)
    words = (
        f"It moves the {QUANTITIES[orders[change.index(largest)]]} by {largest:.2g} of its peak-to-peak at "
        f"{abs(turns):.4g} Hz, tolerance {tolerance:.2g}."
    )
    if largest > PUT_IN * tolerance:
        return SimulatedEffect(effect, settings, words)
    return LeftOut(effect.name, words, largest)


def outputs_of(scene: Scene) -> list[tuple[OutputEffect[Any], Any]]:
    """Return the effects on the output that `scene` names, with their settings."""
    found = []
    for effect, settings, _auto in asked(scene, Kind.OUTPUT):
        assert isinstance(effect, OutputEffect)
        found.append((effect, settings))
    return found


def added_quantities(scene: Scene) -> tuple[str, ...]:
    """Return the quantities of the channels that the effects of `scene` add."""
    return tuple(quantity for effect, settings in outputs_of(scene) for quantity in effect.channels(scene, settings))


def with_added_scales(scene: Scene, full_scale: tuple[float | None, ...]) -> Scene:
    """Return `scene` with the full scales `full_scale` in the channels that its effects add."""
    chosen, place = dict(scene.effects), 0
    for effect, settings in outputs_of(scene):
        count = effect.added(settings)
        chosen[effect.name] = effect.scaled(settings, full_scale[place : place + count])
        place += count
    return scene.model_copy(update={"effects": FrozenMapping(chosen)})


def relative_change(before: Array, after: Array) -> float:
    """Return the largest difference between two curves, relative to the peak-to-peak of the first."""
    difference, extent = float(abs(after - before).max()), float(before.max() - before.min())
    if extent > 0.0:
        return difference / extent
    return float("inf") if difference > 0.0 else 0.0
