"""Choose the effects that are simulated: those with settings, and those set to "auto" that change the output enough.

Stage   2, used by `prepare`.
Model   For "auto", the output of the scene is computed with and without the effect, at the scene's own speed and load.
        The change is the largest difference, relative to the peak-to-peak without the effect. The effect is simulated
        if the change is more than PUT_IN of the tolerance. Effects are judged in the order in which they run, each
        together with those that were chosen before it. An effect whose simulation errs by more than the effect changes
        is left out, since the output would be worse with it. Of two that replace the same thing, the one that the scene
        sets is taken, or the one with the larger change. "auto" is never refused: what does not fit the scene is left
        out.
Limits  The change is an estimate. It is within a factor of two of the change of a whole render.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.contact.load_balance import Contact
from synth.effects.effect import BalanceEffect, Effect, Kind, MotionEffect, OutputEffect, ShapeEffect
from synth.errors import Fault, SceneError
from synth.plan.request import Request
from synth.response.mean_approach import Mean
from synth.response.reading_filter import ORDERS
from synth.response.spectrum import Spectrum
from synth.response.table_error import QUANTITIES
from synth.scene.effects_section import AUTO, FrozenMapping, declaration
from synth.scene.scene import Scene

ALIKE = 1.5  # times the error of the simulation without an effect: with it, such an error is no worse
PUT_IN = 0.4  # of the tolerance: between a tenth, which would be negligible, and the whole
LONGEST_WHOLE = 1.0  # m: longest period over which effects are solved: the longest of a texture that is not a profile
MEAN_PHASES = 64  # phases of a period over which the contact is averaged; more would change its stiffness by under 1 %


@dataclass(frozen=True, slots=True)
class SimulationCase(Request):
    """A request to simulate.

    contact: the contact, in the shape that the effects give it.
    tolerance: the tolerance as a number.
    mean: of z over a period (m), as `Preparation` has it.
    spectrum: the series of z at the scan's load, without the effects on the balance; None where it is not known.
    """

    contact: Contact
    tolerance: float
    mean: Mean | None = None
    spectrum: Spectrum | None = None

    @property
    def constant(self) -> bool:
        """Whether the samples may be the series of a period: those of a constant scan."""
        return self.turns != 0.0 and not self.moving

    @property
    def known(self) -> Spectrum | None:
        """The series of a constant scan, from which its simulation differs by the effects alone."""
        pressed = self.scene.scan.load >= self.scene.scan.lift_load
        return self.spectrum if pressed and self.constant else None

    @property
    def orders(self) -> tuple[int, ...]:
        """The orders of the channels' time derivatives, rising, also for a finger at rest."""
        return tuple(sorted({ORDERS[channel.quantity] for channel in self.scene.output.channel_list}))

    @property
    def nominal(self) -> Scene:
        """The steady scan at the scene's own speed and load, on which the skin moves with the hand."""
        scan = self.scene.scan.model_copy(
            update={"stroke": None, "trajectory": None, "heading": 0.0, "load": self.load}
        )
        effects = {name: one for name, one in self.scene.effects.items() if effect_called(name).kind != Kind.MOTION}
        return self.scene.model_copy(update={"scan": scan, "effects": FrozenMapping(effects)})

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
    motion: what it tells of the motion of the skin (`MotionEffect.told`), if it moves it.
    """

    effect: Effect
    settings: Any
    reason: str = ""
    motion: Mapping[str, Any] | None = None


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


def groups(scene: Scene, kind: Kind) -> list[tuple[list[tuple[Effect, Any]], list[tuple[Effect, Any]]]]:
    """Return the effects of one kind in groups that replace the same thing: those set, and those on "auto"."""
    found: dict[str, tuple[list[tuple[Effect, Any]], list[tuple[Effect, Any]]]] = {}
    for effect, settings, auto in asked(scene, kind):
        found.setdefault(effect.replaces or effect.name, ([], []))[int(auto)].append((effect, settings))
    return list(found.values())


def unfit(scene: Scene, effect: Effect, *, load_varies: bool, ends_move: bool = False) -> str:
    """Return why `effect`, on "auto", does not fit `scene`, as a sentence, or "".

    load_varies: as of `Request`.
    ends_move: whether an effect moves the ends of the contact with the load.
    """
    if scene.finger.kind not in effect.fingers:
        return f"It is an effect of a {' or a '.join(effect.fingers)}; this finger is a {scene.finger.kind}."
    given = {name: settings for name, settings in scene.effects.items() if settings != AUTO}
    for name, settings in given.items():
        clash = effect_called(name).clash(settings, {effect.name: AUTO})
        if clash is not None:
            return f"{name} does not allow it: {clash[0]}."
    laws = [name for name in given if getattr(effect_called(name), "needs_fixed_ends", False)]
    if load_varies and laws and isinstance(effect, ShapeEffect) and effect.moves_ends:
        return f"{laws[0]} is simulated on a contact whose ends do not move with the load."
    if not isinstance(effect, BalanceEffect):
        return ""
    if load_varies and ends_move and effect.needs_fixed_ends:
        return "It is simulated on a contact whose ends do not move with the load."
    if scene.texture.period > LONGEST_WHOLE:
        return f"It is solved over a whole period, of {LONGEST_WHOLE:g} m at most."
    return ""


def beside(effect: Effect, other: Effect, why: str, change: float | None) -> LeftOut:
    """Return `effect` as left out for `other`, which replaces the same thing; why: it is preferred."""
    reason = f"It replaces {effect.replaces}, as {other.name} does, {why}."
    return LeftOut(effect.name, reason, change)


def require_fixed_ends(scene: Scene) -> None:
    """Raise SceneError if `scene` sets two effects that cannot be combined under a load that varies."""
    refused = refused_by_hand(scene)
    if refused is not None:
        raise refused


def refused_by_hand(scene: Scene) -> SceneError | None:
    """Return the error of two effects of `scene` that cannot be combined under a load that varies, or None."""
    shapes = [
        shape.name
        for shape, _settings, auto in asked(scene, Kind.SHAPE)
        if isinstance(shape, ShapeEffect) and shape.moves_ends and not auto
    ]
    for law, _settings, auto in asked(scene, Kind.BALANCE):
        if shapes and isinstance(law, BalanceEffect) and law.needs_fixed_ends and not auto:
            return moving_ends(shapes[0], law.name)
    return None


def moving_ends(shape: str, law: str) -> SceneError:
    """Return the error of the effects `shape` and `law` under a load that varies."""
    hint = (
        f"{law} remembers what each place of the finger has touched, and with {shape} the ends of the contact move "
        "over these places. Keep the load constant, or leave one of the two out."
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


def unresolved(
    effect: Effect,
    orders: tuple[int, ...],
    change: tuple[float, ...],
    errors: tuple[float, ...],
    known: tuple[float, ...],
    tolerance: float,
) -> LeftOut | None:
    """Return `effect` as left out if its simulation errs by more than the effect changes, otherwise None.

    orders: orders of time derivatives.
    change, errors: of each order, relative to its peak-to-peak.
    known: errors of the simulation without the effect, if there is one: the scene has them anyway.
    """
    place = max(range(len(orders)), key=errors.__getitem__)
    if errors[place] <= max(tolerance, change[place], ALIKE * known[place]):
        return None
    words = (
        f"Its simulation errs by {errors[place]:.2g} of the peak-to-peak of the {QUANTITIES[orders[place]]}, more than "
        f"the {change[place]:.2g} by which it would move it; tolerance {tolerance:.2g}."
    )
    return LeftOut(effect.name, words, change[place])


@dataclass(frozen=True, slots=True)
class Tried:
    """An effect on "auto" that was tried.

    verdict: of `judged`.
    change: of each order.
    result: what the effect makes of the scene.
    """

    verdict: SimulatedEffect | LeftOut
    change: tuple[float, ...]
    result: Any

    @property
    def simulated(self) -> SimulatedEffect:
        """The verdict of an effect that was chosen."""
        assert isinstance(self.verdict, SimulatedEffect)
        return self.verdict


def largest_of(tried: list[Tried]) -> tuple[Tried | None, list[LeftOut]]:
    """Return the one with the largest change of those that replace the same thing, if it matters; and the others."""
    matter = [one for one in tried if isinstance(one.verdict, SimulatedEffect)]
    best = max(matter, key=lambda one: max(one.change), default=None)
    others = []
    for one in tried:
        if isinstance(one.verdict, LeftOut):
            others.append(one.verdict)
        elif best is not None and one is not best:
            why = "which changes the output more"
            others.append(beside(one.verdict.effect, best.simulated.effect, why, max(one.change)))
    return best, others


def outputs_of(scene: Scene) -> list[tuple[OutputEffect[Any], Any]]:
    """Return the effects that add channels to the output, with their settings, in the order of the channels."""
    found = []
    for kind in (Kind.MOTION, Kind.OUTPUT):
        for effect, settings, _auto in asked(scene, kind):
            assert isinstance(effect, OutputEffect)
            found.append((effect, settings))
    return found


def motion_of(scene: Scene, *, by_hand: bool) -> tuple[list[SimulatedEffect], list[LeftOut]]:
    """Return the effects on the motion that are simulated, and those on "auto" that are left out.

    by_hand: whether a hand sets the motion, instead of the scan.
    """
    called, spared = [], []
    for effect, settings, auto in asked(scene, Kind.MOTION):
        assert isinstance(effect, MotionEffect)
        told = effect.told(scene, settings, by_hand=by_hand)
        if auto and effect.mover(scene, AUTO, by_hand=by_hand) is None:
            spared.append(LeftOut(effect.name, told["reason"], None))
        else:
            called.append(SimulatedEffect(effect, settings, told["reason"], told))
    return called, spared


def added_quantities(scene: Scene) -> tuple[str, ...]:
    """Return the quantities of the channels that the effects of `scene` add."""
    return tuple(quantity for effect, settings in outputs_of(scene) for quantity in effect.channels(scene, settings))


def added_where_smooth(scene: Scene) -> int:
    """Return the number of channels that sound on a texture without height too. They come first."""
    return sum(effect.added(settings) for effect, settings in outputs_of(scene) if effect.kind == Kind.MOTION)


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
