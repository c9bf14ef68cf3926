"""The skin is viscous: it resists fast indentation, relaxes under it, and recovers slowly after release.

Kind    BALANCE: replaces the law of the pressure by one with a memory at every place. See `simulation.terms` and
        `simulation.skin_steps`.
Model   e is the indentation of a place.
        Kelvin and Voigt: p = kappa (e + tau e').
        Three time constants: p = kappa / g0 (g0 e + sum of g_i q_i), q_i' = e' - q_i / tau_i.
        kappa = k / L of eqs 4-5 is the relaxed stiffness, so slow scans are elastic. p is never negative: a place that
        the surface leaves faster than the skin recovers is free, and recovers by itself.
Source  tau = 1.6 ms: a finger is elastic up to some 100 Hz and viscous above (Wiertlewski & Hayward, 2012, tangential
        motion, as quoted by others). 4 ms, 70 ms and 1.4 s: Pawluk & Howe (1999). Their weights are not known: a
        quarter each is an unverified default.
Limits  Linear in the indentation, whereas Pawluk & Howe's elastic force grows exponentially with it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Any, Literal

from pydantic import Field

from synth.effects.effect import BalanceEffect, Price
from synth.effects.simulation.terms import Skin, Terms
from synth.scene.finger_section import KINDS
from synth.scene.quantity import Dimension
from synth.scene.rules import Choice, Fields, Quantity, Refusal, refusal
from synth.scene.scene import Scene
from synth.scene.section import Section, without

SOLIDS = ("kelvin_voigt", "three_time_constants")
TIMES = (4e-3, 70e-3, 1.4)  # s, Pawluk & Howe (1999)
TIME = Quantity(Dimension.TIME, 1e-6, 100.0)
WEIGHT = Quantity(Dimension.NONE, 0.0, 0.33)  # three of the largest weights still leave some relaxed stiffness


class SkinSettings(Section):
    """Viscoelastic law of the skin."""

    model: Annotated[Literal["kelvin_voigt", "three_time_constants"], Choice(SOLIDS)] = Field(
        default="kelvin_voigt", description="A spring in parallel with a damper, or with three relaxing elements."
    )
    time_constant: Annotated[float, TIME] = Field(
        default=1.6e-3,
        description="kelvin_voigt: time constant tau with which an indentation recovers (unverified default).",
    )
    short_time: Annotated[float, TIME] = Field(
        default=TIMES[0], description="three_time_constants: first relaxation time."
    )
    middle_time: Annotated[float, TIME] = Field(
        default=TIMES[1], description="three_time_constants: second relaxation time."
    )
    long_time: Annotated[float, TIME] = Field(
        default=TIMES[2], description="three_time_constants: third relaxation time."
    )
    short_weight: Annotated[float, WEIGHT] = Field(
        default=0.25, description="Part of the instantaneous stiffness that relaxes in short_time (unverified default)."
    )
    middle_weight: Annotated[float, WEIGHT] = Field(
        default=0.25,
        description="Part of the instantaneous stiffness that relaxes in middle_time (unverified default).",
    )
    long_weight: Annotated[float, WEIGHT] = Field(
        default=0.25, description="Part of the instantaneous stiffness that relaxes in long_time (unverified default)."
    )

    @classmethod
    def conflicts(cls, given: Fields) -> list[Refusal]:
        """Refuse settings of the other model."""
        model = cls.value_of(given, "model")
        others = OF_THREE if model == "kelvin_voigt" else OF_ONE if model is not None else ()
        allowed, hint = "null: it belongs to the other model", f'Leave it out, or replace "{model}" with another model.'
        return [refusal([name], given[name], allowed, hint) for name in others if name in given]

    def document(self) -> dict[str, Any]:
        """Return the fields of the chosen model only."""
        return without(super().document(), *(OF_THREE if self.model == "kelvin_voigt" else OF_ONE))


OF_ONE = ("time_constant",)
OF_THREE = tuple(f"{name}_{what}" for what in ("time", "weight") for name in ("short", "middle", "long"))


class ViscousSkin(BalanceEffect):
    """The effect; see the module."""

    name = "viscous_skin"
    summary = "A viscoelastic skin that never pulls, and recovers by itself where the surface has left it."
    settings = SkinSettings
    replaces = "the law of the pressure"
    needs_fixed_ends = True
    fingers = tuple(KINDS)
    price = Price(5600.0, 600_000)

    def reason(self, scene: Scene, settings: SkinSettings) -> str:
        """See `Effect`."""
        if settings.model == "kelvin_voigt":
            return (
                f"The skin is a spring with a parallel damper, of time constant {1e3 * settings.time_constant:.4g} ms."
            )
        times = ", ".join(f"{1e3 * time:.4g}" for time in self._skin(settings).times)
        return f"The skin relaxes with time constants of {times} ms, each for its part of the stiffness."

    def balanced(self, terms: Terms, settings: SkinSettings) -> Terms:
        """See `BalanceEffect`."""
        return replace(terms, skin=self._skin(settings))

    def _skin(self, settings: SkinSettings) -> Skin:
        if settings.model == "kelvin_voigt":
            return Skin((settings.time_constant,))
        times = (settings.short_time, settings.middle_time, settings.long_time)
        return Skin(times, (settings.short_weight, settings.middle_weight, settings.long_weight))


EFFECT = ViscousSkin()
