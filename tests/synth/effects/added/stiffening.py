"""A finger that stiffens with the load.

Kind    SHAPE: another law of the stiffness.
Model   k = (w / w0)^q times that of eqs 4-5.
Source  An example for `test_new_effects`.
Limits  One power at every load.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from synth.contact.stiffness import Stiffness
from synth.effects.effect import Price, ShapeEffect
from synth.scene.finger_section import KINDS
from synth.scene.quantity import Dimension
from synth.scene.rules import Quantity
from synth.scene.scene import Scene
from synth.scene.section import Section

if TYPE_CHECKING:
    from synth.contact.load_balance import Contact


@dataclass(frozen=True, slots=True)
class StiffeningLaw(Stiffness):
    """Eqs 4-5, times (load / reference)^power."""

    power: float = 0.0
    reference: float = 1.0

    @property
    def load_exponent(self) -> float:
        """See `Stiffness`."""
        return (1.5 if self.given is None else 1.0) - self.power

    def stiffness(self, load: float) -> float:
        """See `Stiffness`."""
        return Stiffness.stiffness(self, load) * math.pow(load / self.reference, self.power)

    def indentation(self, load: float) -> float:
        """See `Stiffness`."""
        return Stiffness.indentation(self, load) * math.pow(load / self.reference, -self.power) if load > 0.0 else 0.0


class StiffeningSettings(Section):
    """The law."""

    reference_load: Annotated[float, Quantity(Dimension.LOAD, 1e-3, 1e3)] = Field(
        default=0.1, description="Load w0 at which the stiffness is that of eqs 4-5."
    )
    power: Annotated[float, Quantity(Dimension.NONE, 0.0, 0.5)] = Field(default=0.3, description="Power q of the load.")


class Stiffening(ShapeEffect):
    """The effect; see the module."""

    name = "stiffening"
    summary = "The finger stiffens with the load."
    settings = StiffeningSettings
    replaces = "the law of the stiffness"
    fingers = tuple(KINDS)
    price = Price(8.3, 270_000)

    def reason(self, scene: Scene, settings: StiffeningSettings) -> str:
        """See `Effect`."""
        return f"The stiffness grows with the load to the power {settings.power:.3g}."

    def shaped(self, contact: Contact, settings: StiffeningSettings) -> Contact:
        """See `ShapeEffect`."""
        law = {one.name: getattr(contact.stiffness, one.name) for one in fields(Stiffness)}
        return contact.under(StiffeningLaw(**law, power=settings.power, reference=settings.reference_load))


EFFECT = Stiffening()
