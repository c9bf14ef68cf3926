"""Surfaces attract each other: the finger is pulled in, held, and released.

Kind    BALANCE: replaces the law of the pressure. See `simulation.table_steps`.
Model   p(d) = (k / L) max(d, 0) - s L clip(1 + d / d0, 0, 1), with d = h - z, is the force per length of contact (N/m).
        The attraction s (Pa) acts in full where the surfaces touch, and falls linearly to zero at a gap of d0. It acts
        over ridges of the length L of eq. 4.
        The balance has more than one root, so z follows the path to the nearest stable one. On the way down the finger
        is pulled in. On the way up it is released at a smaller load, which may be a pull.
Source  The law is of the kind of Derjaguin, Mueller & Toporov (1975), with a linear end, so that no place is released
        abruptly. The work of adhesion is s d0 / 2. Stress and reach are unverified defaults; together they give
        12.5 mJ/m^2.
Limits  No meniscus, and no wetting over time. A finger that has let go is held just out of reach until the load
        presses again.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

from pydantic import Field

from synth.effects.effect import BalanceEffect, Price
from synth.effects.simulation.terms import Adhesion, Terms
from synth.scene.finger_section import KINDS
from synth.scene.quantity import Dimension
from synth.scene.rules import Quantity
from synth.scene.scene import Scene
from synth.scene.section import Section

LARGEST_PULL = 100.0  # N: largest pull that a scene may set; by default the largest is 0.5 N


class AdhesionSettings(Section):
    """Attraction between the surfaces."""

    stress: Annotated[float, Quantity(Dimension.PRESSURE, 1.0, 1e7)] = Field(
        default=5e3, description="Attraction s between surfaces that touch (unverified default)."
    )
    reach: Annotated[float, Quantity(Dimension.LENGTH, 1e-9, 1e-3)] = Field(
        default=5e-6, description="Gap d0 at which the attraction vanishes (unverified default)."
    )


class AdhesionEffect(BalanceEffect):
    """The effect; see the module."""

    name = "adhesion"
    summary = "Surfaces attract each other: pull-in, pull-off, and loads below 0 N that pull."
    settings = AdhesionSettings
    replaces = "the law of the pressure"
    fingers = tuple(KINDS)
    lowest_load = -LARGEST_PULL
    price = Price(510.0, 8_500_000)

    def reason(self, scene: Scene, settings: AdhesionSettings) -> str:
        """See `Effect`."""
        law = f"Surfaces attract each other with {settings.stress:.4g} Pa up to a gap of {1e6 * settings.reach:.4g} um"
        finger = scene.finger
        if finger.traits.round:  # its area follows the load
            return f"{law}."
        return f"{law}: {settings.stress * finger.contact_length * finger.width:.3g} N where the whole contact touches."

    def balanced(self, terms: Terms, settings: AdhesionSettings) -> Terms:
        """See `BalanceEffect`."""
        return replace(terms, adhesion=Adhesion(settings.stress, settings.reach))


EFFECT = AdhesionEffect()
