"""The contact moves a small mass that hangs on the pulp of the finger, a spring and a damper to the bone.

Kind    BALANCE: adds the terms m z'' + c z' + k_p (z - z_w). See `simulation.table_steps` and `simulation.pulp`.
Model   m z'' + c z' + k_p (z - z_w) = reaction(z, theta) - w. z_w is the mean of the quasi-static z over a period at
        the load w, so the mean force of the pulp is the load. The reaction is read from a table of the same contact, or
        summed over points where the ends of the contact move with the load (`contact_growth`).
        Pressure never pulls, so a contact that is thrown off flies until the pulp brings it back.
Source  m, c, k_p: Wiertlewski & Hayward (2012), J. Biomech. 45: a fingertip is elastic up to some 100 Hz and viscous
        above; 0.1 to 0.2 g, 0.8 to 2.4 N s/m and 0.5 to 2 kN/m are general knowledge about it (unverified), measured
        along the skin. The defaults are the mass and damper in these ranges that leave no resonance on the stiffness of
        the default contact: 2 % at 1.4 kHz. With 5 g, 3 N s/m and no spring, the effect is a whole finger on its
        contact: Hajian & Howe (1997), 3.5 to 9 g and 2 to 5 N s/m, as quoted by others (unverified); it rings at 425
        Hz. The stiffness of the contact follows from the load (eqs 4-5). Scheme: Gonzalez (1996), discrete gradient;
        for collisions Chatziioannou & van Walstijn (2015).
Limits  One mass and a linear pulp. The elastic force of a real pulp grows exponentially with indentation and relaxes
        (Pawluk & Howe, 1999). A fingertip has seven modes below 250 Hz (Serhat & Kuchenbecker, 2021), and at small
        loads a mass, a spring and a damper are not enough (Fu & Oliver, 2005). The bone follows the load, and does not
        move with the texture.
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


class InertiaSettings(Section):
    """Mass, damper and spring of the pulp."""

    mass: Annotated[float, Quantity(Dimension.MASS, 1e-6, 1.0)] = Field(
        default=1e-4, description="Mass m that moves with the contact (unverified default, 0.1 to 0.2 g)."
    )
    damping: Annotated[float, Quantity(Dimension.DAMPING, 0.0, 1e3)] = Field(
        default=2.4,
        description="Damper c of the pulp (unverified default, 0.8 to 2.4 N s/m); with 0 it never stops ringing.",
    )
    stiffness: Annotated[float, Quantity(Dimension.STIFFNESS, 0.0, 1e6)] = Field(
        default=1e3,
        description="Spring k_p of the pulp (unverified default, 0.5 to 2 kN/m); 0: none, a free finger.",
    )


class Inertia(BalanceEffect):
    """The effect; see the module."""

    name = "inertia"
    summary = "A mass on the pulp, a spring and a damper, moved by the contact, with loss of contact and bounce."
    settings = InertiaSettings
    replaces = "the mass of the finger"
    fingers = tuple(KINDS)
    price = Price(460.0, 4_500_000)

    def reason(self, scene: Scene, settings: InertiaSettings) -> str:
        """See `Effect`."""
        held = f" and held by a pulp of {settings.stiffness:.4g} N/m" if settings.stiffness > 0.0 else ""
        moved = f"The contact moves a mass of {1e3 * settings.mass:.4g} g"
        return f"{moved}, damped by {settings.damping:.4g} N s/m{held}."

    def balanced(self, terms: Terms, settings: InertiaSettings) -> Terms:
        """See `BalanceEffect`."""
        damping, pulp = terms.damping + settings.damping, terms.pulp + settings.stiffness
        return replace(terms, mass=settings.mass, damping=damping, pulp=pulp)


EFFECT = Inertia()
