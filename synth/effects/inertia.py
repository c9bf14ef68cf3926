"""The finger has a mass and a damper: it overshoots, rings, and leaves the surface where it cannot follow.

Kind    BALANCE: adds the terms m z'' + c z'. See `simulation.table_steps`.
Model   m z'' + c z' = reaction(z, theta) - w. The reaction is read from a table of the same contact. Pressure never
        pulls, so a finger that is thrown off flies with m z'' = -w - c z' until it comes back.
Source  m, c: Hajian & Howe (1997), extension of the finger: 3.5 to 9 g and 2 to 5 N s/m, as quoted by others
        (unverified). k is not from there; it follows from the load (eqs 4-5). Scheme: Gonzalez (1996), discrete
        gradient; for collisions Chatziioannou & van Walstijn (2015).
Limits  One mass. A fingertip has seven modes below 250 Hz (Serhat & Kuchenbecker, 2021), and at small loads a mass, a
        spring and a damper are not enough (Fu & Oliver, 2005).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

from pydantic import Field

from synth.effects.effect import BalanceEffect, Price
from synth.effects.simulation.terms import Terms
from synth.scene.quantity import Dimension
from synth.scene.rules import Quantity
from synth.scene.scene import Scene
from synth.scene.section import Section


class InertiaSettings(Section):
    """Mass and damping of the finger."""

    mass: Annotated[float, Quantity(Dimension.MASS, 1e-6, 1.0)] = Field(
        default=5e-3, description="Mass m that moves with the contact (unverified default, between 3.5 and 9 g)."
    )
    damping: Annotated[float, Quantity(Dimension.DAMPING, 0.0, 1e3)] = Field(
        default=3.0,
        description="Damper c between the finger and the hand (unverified default); with 0 it never stops ringing.",
    )


class Inertia(BalanceEffect):
    """The effect; see the module."""

    name = "inertia"
    summary = "The finger's mass and damper on the contact, with loss of contact and bounce."
    settings = InertiaSettings
    replaces = "the mass of the finger"
    of_comb = False
    price = Price(370.0, 3_200_000)

    def reason(self, scene: Scene, settings: InertiaSettings) -> str:
        """See `Effect`."""
        grams = 1e3 * settings.mass
        return f"The finger moves as a mass of {grams:.4g} g on the contact, damped by {settings.damping:.4g} N s/m."

    def balanced(self, terms: Terms, settings: InertiaSettings) -> Terms:
        """See `BalanceEffect`."""
        return replace(terms, mass=settings.mass, damping=settings.damping)


EFFECT = Inertia()
