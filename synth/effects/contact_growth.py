"""The contact grows with the load: L = L0 (w / w0)^p about the middle of the contact.

Kind    SHAPE: ridges keep their place on the finger; more or fewer of them touch. See `contact.growing_contact`.
Model   L0 is `finger.contact_length`, the length at the reference load w0. The stiffness k of eqs 4-5 is that of L.
        With p = 1/3 (Hertz) the mean indentation w / k grows as w^(1/2). At a fixed length it grows as w^(3/2).
Source  Physics of a fingertip, general knowledge: p = 1/3 (Hertz), down to 0.15 to 0.25 where the finger stiffens.
Limits  The ends stay hard edges; `curvature` softens them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from synth.effects.effect import Price, ShapeEffect
from synth.scene.quantity import Dimension, show_quantity
from synth.scene.rules import Fields, Quantity, Refusal, refusal
from synth.scene.scene import Scene
from synth.scene.section import Section

if TYPE_CHECKING:
    from synth.contact.load_balance import Contact

LENGTH = Quantity(Dimension.LENGTH, 1e-5, 0.1)


class GrowthSettings(Section):
    """Growth of the contact length with the load."""

    reference_load: Annotated[float, Quantity(Dimension.LOAD, 1e-3, 1e3)] = Field(
        default=1.0, description="Load w0 at which the contact is finger.contact_length long (unverified default)."
    )
    exponent: Annotated[float, Quantity(Dimension.NONE, 0.0, 1.0)] = Field(
        default=1.0 / 3.0, description="Power p in L = L0 (w / w0)^p: 1/3 is Hertz, 0 keeps the length fixed."
    )
    shortest: Annotated[float, LENGTH] = Field(default=1e-5, description="Smallest length of the contact.")
    longest: Annotated[float, LENGTH] = Field(default=0.1, description="Largest length of the contact.")

    @classmethod
    def conflicts(cls, given: Fields) -> list[Refusal]:
        """Refuse a shortest length above the longest."""
        shortest, longest = cls.value_of(given, "shortest"), cls.value_of(given, "longest")
        if shortest is None or longest is None or shortest <= longest:
            return []
        allowed = f"at least the shortest length, {show_quantity(shortest, Dimension.LENGTH)}"
        return [refusal(["longest"], longest, allowed, "Write a longer length, or reduce shortest.")]


class ContactGrowth(ShapeEffect):
    """The effect; see the module."""

    name = "contact_growth"
    summary = "The contact length follows the load, about the middle of the contact."
    settings = GrowthSettings
    replaces = "the contact length"
    moves_ends = True
    why_fingers = "A fingertip and a probe are round, and touch more of their length under more load by themselves."
    price = Price(56.0, 4_200_000)

    def reason(self, scene: Scene, settings: GrowthSettings) -> str:
        """See `Effect`."""
        pressed = max(scene.scan.load, 0.0) / settings.reference_load
        grown = scene.finger.contact_length * pressed**settings.exponent
        length = 1e3 * min(max(grown, settings.shortest), settings.longest)
        return (
            f"The contact length follows the load to the power {settings.exponent:.3g}: "
            f"{show_quantity(float(f'{length:.4g}') / 1e3, Dimension.LENGTH)} at {scene.scan.load:.4g} N."
        )

    def shaped(self, contact: Contact, settings: GrowthSettings) -> Contact:
        """See `ShapeEffect`."""
        from synth.contact.growing_contact import GrowingContact, Growth

        growth = Growth(**settings.document())
        if not contact.of_one_line:
            from synth.contact.area_contact import CombOnArea
            from synth.contact.area_shapes import GrowingCombOnArea

            assert isinstance(contact, CombOnArea)
            return GrowingCombOnArea.of(contact, growth)
        return GrowingContact.of(contact.geometry, contact.stiffness, growth)


EFFECT = ContactGrowth()
