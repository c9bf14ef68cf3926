"""The horizontal force on the finger, from the slopes of the texture and from friction, as one or two more channels.

Kind    OUTPUT: adds `tangential_force`, the component along x of the surface, and with the components "xy" also
        `tangential_force_y`, that along y, in newtons, after the channels of the scene.
Model   F = F_s + tanh(|u| / u0) Q u / |u|, where u is the velocity of the surface under the finger.
        F_s is the force of the pressure on the slopes of the texture. On an elastic contact its mean over a period is
        zero.
        Q is friction, the integral of mu p0 (p / p0)^g over the area. For g = 1 (Coulomb) it is mu w.
        Both follow from the pressure that balances z. They are read from responses over phase and load
        (`contact.forces`) or, where z is simulated, from the simulation.
        At a reversal friction changes sign gradually, between the speeds -u0 and u0, so that it does not click.
Source  Slope force: derived from eq. 1 of Fagiani & Barbieri (2016), see `contact.forces`. mu of about 0.5 on dry skin,
        independent of the pressure: Derler & Gerhardt (2012). g: Wandersman et al. (2011), q = beta p^g; 0.8 to 0.9 is
        general knowledge. p0 and u0 are unverified defaults.
Limits  Friction does not act back on z through the skin, and does not stick. With a simulation g must be 1.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field

from synth.effects.effect import BalanceEffect, OutputEffect, Price
from synth.scene.effects_section import declaration
from synth.scene.finger_section import KINDS
from synth.scene.quantity import Dimension
from synth.scene.rules import Choice, Quantity
from synth.scene.scene import Scene
from synth.scene.section import Section

if TYPE_CHECKING:
    from synth.plan.preparation import Preparation
    from synth.response_cache import ResponseCache
    from synth.voice.tangential_force import TangentialStage

QUANTITIES = "tangential_force", "tangential_force_y"
COMPONENTS = "x", "xy"


class TangentialSettings(Section):
    """Friction, the components, and their full scale."""

    components: Annotated[Literal["x", "xy"], Choice(COMPONENTS)] = Field(
        default="x", description="Components of the force along x and y of the surface, a channel each."
    )
    friction_coefficient: Annotated[float, Quantity(Dimension.NONE, 0.0, 10.0)] = Field(
        default=0.5, description="Coefficient of friction mu; with 0 only the force of the slopes remains."
    )
    pressure_exponent: Annotated[float, Quantity(Dimension.NONE, 0.5, 1.5)] = Field(
        default=1.0,
        description="Power g of the pressure in the law of friction: 1 is Coulomb's law, skin has 0.8 to 0.9.",
    )
    reference_pressure: Annotated[float, Quantity(Dimension.PRESSURE, 1.0, 1e9)] = Field(
        default=1e4, description="Pressure p0 at which friction is mu times the pressure (unverified default)."
    )
    reversal_speed: Annotated[float, Quantity(Dimension.SPEED, 1e-6, 1.0)] = Field(
        default=1e-3, description="Speed u0 within which friction changes direction (unverified default)."
    )
    full_scale: Annotated[float | None, Quantity(Dimension.LOAD, 1e-12, 1e6)] = Field(
        default=None,
        description="Force that a sample of 1.0 stands for; null: the steady peak becomes 0.8, and of a file of a "
        "stroke, a recording or a path, the peak of its own motion.",
    )

    @property
    def count(self) -> int:
        """Number of components."""
        return len(self.components)


class Tangential(OutputEffect["Preparation"]):
    """The effect; see the module."""

    name = "tangential"
    has_table = True
    fingers = tuple(KINDS)
    summary = "The horizontal force of slopes and friction, as an additional channel."
    settings = TangentialSettings
    without_auto = (
        'It adds a channel and changes no other, so "auto" has no difference to measure. Write {} or leave it out.'
    )
    units: Mapping[str, str] = MappingProxyType(dict.fromkeys(QUANTITIES, "N"))
    price = Price(210.0, 8_000_000)

    def clash(self, settings: TangentialSettings, others: Mapping[str, Any]) -> tuple[str, str] | None:
        """Refuse an exponent other than 1 with a simulation, which does not keep the pressure of each place."""
        simulated = sorted(name for name in others if isinstance(declaration(name), BalanceEffect))
        if settings.pressure_exponent == 1.0 or not simulated:
            return None
        hint = (
            f'Write a pressure_exponent of 1, or leave "{simulated[0]}" out: its simulation does not keep the pressure'
        )
        return f"pressure_exponent 1 with {simulated[0]}", f"{hint} of each place, which other exponents require."

    def reason(self, scene: Scene, settings: TangentialSettings) -> str:
        """See `Effect`."""
        law = f"friction of {settings.friction_coefficient:.4g} times the pressure"
        if settings.pressure_exponent != 1.0:
            law += f" to the power {settings.pressure_exponent:.4g}"
        return f"The force on the slopes of the texture, plus {law}, is an additional channel."

    def channels(self, scene: Scene, settings: TangentialSettings) -> tuple[str, ...]:
        """See `OutputEffect`."""
        return QUANTITIES[: settings.count]

    def reads_across(self, settings: TangentialSettings) -> bool:
        """See `OutputEffect`."""
        return settings.count > 1

    def scales(self, settings: TangentialSettings) -> tuple[float | None, ...]:
        """See `OutputEffect`."""
        return (settings.full_scale,) * settings.count

    def scaled(self, settings: TangentialSettings, full_scale: tuple[float | None, ...]) -> TangentialSettings:
        """See `OutputEffect`."""
        return settings.model_copy(update={"full_scale": full_scale[0]})

    def prepare(self, solved: Preparation, settings: TangentialSettings, cache: ResponseCache) -> TangentialStage:
        """See `OutputEffect`."""
        from synth.voice.tangential_force import TangentialStage

        return TangentialStage.of(solved, settings, cache)


EFFECT = Tangential()
