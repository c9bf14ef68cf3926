"""A damper beside the finger, whether another effect gives it a mass or not.

Kind    BALANCE: adds c z', and a light mass where there is none.
Model   See `simulation.terms`.
Source  An example for `test_new_effects`. Its name comes before that of `inertia`, which acts on its terms.
Limits  Linear.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

from pydantic import Field

from synth.effects.effect import BalanceEffect, Price
from synth.effects.simulation.terms import Terms
from synth.scene.finger_section import KINDS
from synth.scene.quantity import Dimension
from synth.scene.rules import Quantity
from synth.scene.scene import Scene
from synth.scene.section import Section

MASS = 1e-4  # kg


class DamperSettings(Section):
    """The damper."""

    damping: Annotated[float, Quantity(Dimension.DAMPING, 1e-3, 1e3)] = Field(default=3.0, description="Damper c.")


class Damper(BalanceEffect):
    """The effect; see the module."""

    name = "damper"
    summary = "A damper beside the finger."
    settings = DamperSettings
    replaces = "the damper beside the finger"
    fingers = tuple(KINDS)
    price = Price(800.0, 3_200_000)

    def reason(self, scene: Scene, settings: DamperSettings) -> str:
        """See `Effect`."""
        return f"The finger is damped by {settings.damping:.4g} N s/m."

    def balanced(self, terms: Terms, settings: DamperSettings) -> Terms:
        """See `BalanceEffect`."""
        return replace(terms, mass=terms.mass or MASS, damping=terms.damping + settings.damping)


EFFECT = Damper()
