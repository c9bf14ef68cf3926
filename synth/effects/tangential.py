"""The horizontal force on the finger: of the slopes that it is driven over, and of friction. A channel of its own.

Kind    OUTPUT: adds the channel `tangential_force`, in newtons, behind those of the scene.
Model   F = F_s + tanh(u / u0) Q. F_s: the pressure on the slopes of the texture, without a mean over a period; Q: the
        integral of mu p0 (p / p0)^g over the area, mu w for g = 1 (Coulomb). Both are those of the same pressure as z:
        responses over phase and load (`contact.forces`), or, where z is simulated, what the simulation presses with.
        At a reversal friction passes through nothing within the speeds u0, so that it does not click.
Source  slope force: derived from eq. 1 of Fagiani & Barbieri (2016), see `contact.forces`. mu about 0.5 on dry skin,
        not depending on the pressure: Derler & Gerhardt (2012). g: Wandersman et al. (2011), q = beta p^g, with 0.8 to
        0.9 as general knowledge. p0 and u0 are unverified defaults.
Limits  friction does not bend the skin back on z, and does not stick. With a simulation g must be 1.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from synth.effects.effect import OutputEffect, Price
from synth.scene.quantity import Dimension
from synth.scene.rules import Quantity
from synth.scene.scene import Scene
from synth.scene.section import Section

if TYPE_CHECKING:
    from synth.plan.preparation import Preparation
    from synth.response.response_cache import ResponseCache
    from synth.voice.tangential_force import TangentialStage

QUANTITY = "tangential_force"
BALANCES = ("adhesion", "inertia", "viscous_skin")


class TangentialSettings(Section):
    """Friction, and the full scale of the channel."""

    friction_coefficient: Annotated[float, Quantity(Dimension.NONE, 0.0, 10.0)] = Field(
        default=0.5, description="Coefficient of friction mu; 0 leaves the force of the slopes alone."
    )
    pressure_exponent: Annotated[float, Quantity(Dimension.NONE, 0.5, 1.5)] = Field(
        default=1.0, description="Power g of the pressure that friction follows; 1 is Coulomb's, skin has 0.8 to 0.9."
    )
    reference_pressure: Annotated[float, Quantity(Dimension.PRESSURE, 1.0, 1e9)] = Field(
        default=1e4, description="Pressure p0 at which friction is mu times the pressure (unverified default)."
    )
    reversal_speed: Annotated[float, Quantity(Dimension.SPEED, 1e-6, 1.0)] = Field(
        default=1e-3, description="Speed u0 within which friction changes its direction (unverified default)."
    )
    full_scale: Annotated[float | None, Quantity(Dimension.LOAD, 1e-12, 1e6)] = Field(
        default=None, description="Force that becomes 1.0 in the audio; by default the steady peak becomes 0.8."
    )


class Tangential(OutputEffect["Preparation"]):
    """The effect; see the module."""

    name = "tangential"
    summary = "The horizontal force of slopes and friction, as a channel of its own."
    settings = TangentialSettings
    without_auto = "It adds a channel and changes none, so there is nothing to judge it by: write {} or leave it out."
    units: Mapping[str, str] = MappingProxyType({QUANTITY: "N"})
    price = Price(20.0, 280_000)

    def clash(self, settings: TangentialSettings, others: Mapping[str, Any]) -> tuple[str, str] | None:
        """Refuse friction that is not Coulomb's where the pressure is not at hand place by place."""
        simulated = [name for name in BALANCES if name in others]
        if settings.pressure_exponent == 1.0 or not simulated:
            return None
        hint = f'Write a pressure_exponent of 1, or leave "{simulated[0]}" out: it is simulated without the pressure of'
        return f"pressure_exponent 1 beside {simulated[0]}", f"{hint} each place, which another exponent asks for."

    def reason(self, scene: Scene, settings: TangentialSettings) -> str:
        """See `Effect`."""
        law = f"friction {settings.friction_coefficient:.4g} times the pressure"
        if settings.pressure_exponent != 1.0:
            law += f" to the power {settings.pressure_exponent:.4g}"
        return f"The force on the slopes of the texture, and {law}, as a channel of its own."

    def channels(self, settings: TangentialSettings) -> tuple[str, ...]:
        """See `OutputEffect`."""
        return (QUANTITY,)

    def scales(self, settings: TangentialSettings) -> tuple[float | None, ...]:
        """See `OutputEffect`."""
        return (settings.full_scale,)

    def scaled(self, settings: TangentialSettings, full_scale: tuple[float | None, ...]) -> TangentialSettings:
        """See `OutputEffect`."""
        return settings.model_copy(update={"full_scale": full_scale[0]})

    def prepare(self, solved: Preparation, settings: TangentialSettings, cache: ResponseCache) -> TangentialStage:
        """See `OutputEffect`."""
        from synth.voice.tangential_force import TangentialStage

        return TangentialStage.of(solved, settings, cache)


EFFECT = Tangential()
