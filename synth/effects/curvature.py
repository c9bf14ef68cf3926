"""A round fingertip: the pressure fades towards the ends of the contact instead of stopping at hard edges.

Kind    SHAPE: a parabola is subtracted from the finger, which touches wherever the remaining heights overlap. See
        `contact.curved_contact`.
Model   The height is h(x) - (x - xc)^2 / (2 R). A smooth fingertip would touch over L(w) = L0 (w / w0)^0.3. The skin
        below each place has the stiffness k / L of eqs 4-5 at that length.
Source  Johnson (1985), Contact Mechanics, section 4.3 (elastic foundation), with eqs 4-5 of Fagiani & Barbieri (2016).
Limits  R is the radius of the flattened fingertip on its own foundation. It is not the radius of the free finger (some
        8 mm), which a foundation as thin as the ridges would flatten over 1 mm only.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from synth.effects.effect import Price, ShapeEffect
from synth.scene.quantity import Dimension
from synth.scene.rules import Quantity
from synth.scene.scene import Scene
from synth.scene.section import Section

if TYPE_CHECKING:
    from synth.contact.load_balance import Contact


class CurvatureSettings(Section):
    """Curvature of the fingertip."""

    reference_load: Annotated[float, Quantity(Dimension.LOAD, 1e-3, 1e3)] = Field(
        default=1.0,
        description="Load w0 at which a smooth fingertip would touch over finger.contact_length; it determines "
        "the radius (unverified default).",
    )
    radius: Annotated[float | None, Quantity(Dimension.LENGTH, 1e-3, 1e4)] = Field(
        default=None,
        description="Radius R of the parabola; null: it follows from the reference load.",
    )


class Curvature(ShapeEffect):
    """The effect; see the module."""

    name = "curvature"
    summary = "A round fingertip: the pressure fades towards the ends, and the contact length follows from the load."
    settings = CurvatureSettings
    replaces = "the contact length"
    why_fingers = "A fingertip and a probe are round, and touch more of their length under more load by themselves."
    price = Price(62.0, 4_200_000)

    def reason(self, scene: Scene, settings: CurvatureSettings) -> str:
        """See `Effect`."""
        if settings.radius is not None:
            return (
                f"The fingertip is a parabola of radius {settings.radius:.4g} m. The load sets the length that touches."
            )
        length = 1e3 * scene.finger.contact_length
        return (
            f"The fingertip is round: a smooth one would touch over {length:.4g} mm at "
            f"{settings.reference_load:.4g} N. The pressure fades towards the ends of the contact."
        )

    def shaped(self, contact: Contact, settings: CurvatureSettings) -> Contact:
        """See `ShapeEffect`."""
        from synth.contact.curved_contact import RoundContact

        if not contact.of_one_line:
            from synth.contact.area_contact import CombOnArea
            from synth.contact.area_shapes import RoundCombOnArea

            assert isinstance(contact, CombOnArea)
            return RoundCombOnArea.of(contact, settings.radius, settings.reference_load)
        return RoundContact.of(contact.geometry, contact.stiffness, settings.radius, settings.reference_load)


EFFECT = Curvature()
