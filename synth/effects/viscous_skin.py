"""The skin is viscous: it resists fast indentation, relaxes under it, and comes back slowly where it is left.

Kind    BALANCE: another law of the pressure, with a memory at every place. See `simulation.skin` and `skin_steps`.
Model   Kelvin and Voigt: p = kappa (e + tau e'). Three time constants: p = kappa / g0 (g0 e + sum of g_i q_i), q_i' =
        e' - q_i / tau_i. kappa = k / L of eqs 4-5 is the relaxed stiffness, so slow scans are elastic. p is never
        negative: a place that the surface leaves faster than it comes back is free, and recovers by itself.
Source  tau = 1.6 ms: a finger is elastic up to some 100 Hz and viscous above (Wiertlewski & Hayward, 2012, tangential,
        told by others). 4 ms, 70 ms and 1.4 s: Pawluk & Howe (1999); their weights are not known: a quarter each is an
        unverified default.
Limits  linear in the indentation; Pawluk & Howe's elastic force grows exponentially with it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Any, Literal

from pydantic import Field

from synth.effects.effect import BalanceEffect, Price
from synth.effects.simulation.terms import Skin, Terms
from synth.scene.quantity import Dimension
from synth.scene.rules import Choice, Fields, Quantity, Refusal, refusal
from synth.scene.scene import Scene
from synth.scene.section import Section, without

SOLIDS = ("kelvin_voigt", "three_time_constants")
TIMES = (4e-3, 70e-3, 1.4)  # s, Pawluk & Howe (1999)
TIME = Quantity(Dimension.TIME, 1e-6, 100.0)
WEIGHT = Quantity(Dimension.NONE, 0.0, 0.33)  # three of them leave some of the stiffness to rest on


class SkinSettings(Section):
    """The law of the skin."""

    model: Annotated[Literal["kelvin_voigt", "three_time_constants"], Choice(SOLIDS)] = Field(
        default="kelvin_voigt", description="A spring beside a damper, or a spring and three relaxing elements."
    )
    time_constant: Annotated[float, TIME] = Field(
        default=1.6e-3, description="Of kelvin_voigt: time tau in which an indentation comes back (unverified default)."
    )
    short_time: Annotated[float, TIME] = Field(default=TIMES[0], description="Of three_time_constants: the first.")
    middle_time: Annotated[float, TIME] = Field(default=TIMES[1], description="Of three_time_constants: the second.")
    long_time: Annotated[float, TIME] = Field(default=TIMES[2], description="Of three_time_constants: the third.")
    short_weight: Annotated[float, WEIGHT] = Field(
        default=0.25, description="Part of the stiffness at once that relaxes in short_time (unverified default)."
    )
    middle_weight: Annotated[float, WEIGHT] = Field(
        default=0.25, description="Part of the stiffness at once that relaxes in middle_time (unverified default)."
    )
    long_weight: Annotated[float, WEIGHT] = Field(
        default=0.25, description="Part of the stiffness at once that relaxes in long_time (unverified default)."
    )

    @classmethod
    def conflicts(cls, given: Fields) -> list[Refusal]:
        """Refuse what belongs to the other model."""
        model = cls.value_of(given, "model")
        others = OF_THREE if model == "kelvin_voigt" else OF_ONE if model is not None else ()
        allowed, hint = "null: it is of the other model", f'Leave it out, or write another model than "{model}".'
        return [refusal([name], given[name], allowed, hint) for name in others if name in given]

    def document(self) -> dict[str, Any]:
        """Return the fields of the model alone."""
        return without(super().document(), *(OF_THREE if self.model == "kelvin_voigt" else OF_ONE))


OF_ONE = ("time_constant",)
OF_THREE = tuple(f"{name}_{what}" for what in ("time", "weight") for name in ("short", "middle", "long"))


class ViscousSkin(BalanceEffect):
    """The effect; see the module."""

    name = "viscous_skin"
    summary = "A viscoelastic skin that never pulls, and recovers freely where the surface has left it."
    settings = SkinSettings
    replaces = "the law of the pressure"
    price = Price(5200.0, 250_000)

    def reason(self, scene: Scene, settings: SkinSettings) -> str:
        """See `Effect`."""
        if settings.model == "kelvin_voigt":
            return f"The skin is a spring beside a damper, {1e3 * settings.time_constant:.4g} ms to come back in."
        times = ", ".join(f"{1e3 * time:.4g}" for time in self._skin(settings).times)
        return f"The skin relaxes in {times} ms, each element with its part of the stiffness."

    def balanced(self, terms: Terms, settings: SkinSettings) -> Terms:
        """See `BalanceEffect`."""
        return replace(terms, skin=self._skin(settings))

    def _skin(self, settings: SkinSettings) -> Skin:
        if settings.model == "kelvin_voigt":
            return Skin((settings.time_constant,))
        times = (settings.short_time, settings.middle_time, settings.long_time)
        return Skin(times, (settings.short_weight, settings.middle_weight, settings.long_weight))


EFFECT = ViscousSkin()
