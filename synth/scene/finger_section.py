"""The finger section of a scene: which finger, its ridges, its shape and its elasticity.

Stage: 1 (SCENE). Every field is declared once: its type with its rule, its default in SI, and a sentence on its
    meaning. A kind of finger refuses the fields of other kinds, which are then None.
Model: `comb` is the finger of Fagiani & Barbieri 2016: equal straight ridges over a length with hard ends. `fingertip`
    is an area of curved, unequal ridges on a round finger (`contact.fingertip`). `probe` is a smooth round tip, such as
    that of a stylus. Eq. 3 converts a roughness Ra to an amplitude. After reading, a scene holds only the amplitude.
Source: the mean ridge period of a fingertip, 0.46 mm (0.4 to 0.5 mm), and heights of 0.05 to 0.15 mm from valley to
    crest are general knowledge. The spreads and the tip radius are unverified defaults. 3 GPa is that of acrylic glass.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Any

from pydantic import Field

from synth.scene.quantity import Dimension
from synth.scene.rules import Choice, Fields, Quantity, Refusal, refusal
from synth.scene.section import Section, without
from synth.scene.texture_section import (
    LARGEST_ROUGHNESS,
    MODULUS,
    POISSON_RATIO,
    amplitude_of,
    amplitude_twice,
)

# A value above `usual` causes a warning. Ridges of fingers are 0.05 to 0.15 mm high and 0.5 mm apart, and a fingertip
# touches over 4 to 16 mm (general knowledge, rounded up).
RIDGE_AMPLITUDE = Quantity(Dimension.LENGTH, 0.0, 1e-3, usual=0.2e-3)
RIDGE_ROUGHNESS = Quantity(Dimension.LENGTH, 0.0, LARGEST_ROUGHNESS, usual=0.127e-3)
CONTACT = Quantity(Dimension.LENGTH, 1e-5, 0.1, usual=0.03)
STIFFNESS = Quantity(Dimension.STIFFNESS, 1.0, 1e9)  # 1 N indents by 1 m to 1 nm; the default scene has 3.3e5 N/m
SPREAD = Quantity(Dimension.NONE, 0.0, 0.5)  # a larger spread would fold ridges over their neighbours
PATTERNS = ("loop", "whorl", "straight")

RIDGES = ("ridge_period", "ridge_amplitude", "roughness")
TIP = ("tip_radius",)
PRINT = ("contact_width", "pattern", "spacing_spread", "direction_spread", "height_spread", "seed")
EVERY = ("kind", "contact_length", "youngs_modulus", "poisson_ratio", "stiffness")


@dataclass(frozen=True, slots=True)
class FingerKind:
    """What the engine needs to know about a kind of finger. `contact.scene_contact` makes its contact.

    summary: what it is, in words.
    fields: its fields. Without `ridge_amplitude` it has no ridges; without `contact_length` it is `tip_radius` long.
    defaults: defaults that differ from those of the fields.
    straight: whether it touches along a line, over `contact_length` at every load, and may cancel lines of a texture.
    round: whether its direction changes nothing.
    of_area: whether its heights vary across, so that it is solved over an area on every texture.
    """

    summary: str
    fields: tuple[str, ...]
    defaults: Fields = field(default_factory=dict)
    straight: bool = False
    round: bool = False
    of_area: bool = False


_FINGERTIP: Fields = {
    "ridge_period": 0.46e-3,
    "pattern": "loop",
    "spacing_spread": 0.3,
    "direction_spread": 0.3,
    "height_spread": 0.3,
    "seed": 0,
}
_PROBE: Fields = {"tip_radius": 1e-3, "youngs_modulus": 3e9, "poisson_ratio": 0.37}

KINDS = {
    "comb": FingerKind("the finger of the paper", (*EVERY, *RIDGES), straight=True),
    "fingertip": FingerKind("curved unequal ridges, round", (*EVERY, *RIDGES, *PRINT), _FINGERTIP, of_area=True),
    "probe": FingerKind("a smooth tip", ("kind", *TIP, "youngs_modulus", "poisson_ratio"), _PROBE, round=True),
}
"""Every kind of finger."""

STRAIGHT = tuple(name for name, kind in KINDS.items() if kind.straight)
"""Kinds whose length an effect of kind SHAPE may set."""


class Finger(Section):
    """The finger: its ridges on an elastic skin."""

    kind: Annotated[str, Choice(tuple(KINDS))] = Field(
        default="comb", description="; ".join(f"{name}: {kind.summary}" for name, kind in KINDS.items()) + "."
    )
    ridge_period: Annotated[float, Quantity(Dimension.LENGTH, 1e-5, 1e-2, usual=2e-3)] = Field(
        default=0.5e-3,
        description="Distance from one ridge of the fingerprint to the next (lambda1 of eq. 2). Of a fingertip the "
        "mean, 0.46 mm by default.",
    )
    ridge_amplitude: Annotated[float, RIDGE_AMPLITUDE] = Field(
        default=40e-6, description="Half the height of the ridges from valley to crest (a1 of eq. 2)."
    )
    roughness: Annotated[float | None, RIDGE_ROUGHNESS] = Field(
        default=None, description="Mean arithmetic roughness Ra of the ridges, instead of ridge_amplitude (eq. 3)."
    )
    contact_length: Annotated[float, CONTACT] = Field(
        default=0.01,
        description="Length of the contact along the direction of scanning (L of eq. 1). Of a fingertip that at 1 N.",
    )
    contact_width: Annotated[float | None, CONTACT] = Field(
        default=None,
        description="fingertip: width of the contact across the scan at 1 N; null: as long as contact_length.",
    )
    pattern: Annotated[str | None, Choice(PATTERNS)] = Field(
        default=None, description='fingertip: course of the ridges; "loop" by default.'
    )
    spacing_spread: Annotated[float | None, SPREAD] = Field(
        default=None, description="fingertip: standard deviation of the ridge spacing over its mean; 0.3 by default."
    )
    direction_spread: Annotated[float | None, SPREAD] = Field(
        default=None, description="fingertip: standard deviation of the ridge direction in radians; 0.3 by default."
    )
    height_spread: Annotated[float | None, SPREAD] = Field(
        default=None, description="fingertip: standard deviation of the ridge height over its mean; 0.3 by default."
    )
    seed: Annotated[int | None, Quantity(Dimension.NONE, 0, 1_000_000, whole=True)] = Field(
        default=None, description="fingertip: seed of the print; the same seed gives the same print. 0 by default."
    )
    tip_radius: Annotated[float | None, Quantity(Dimension.LENGTH, 1e-5, 0.1, usual=0.02)] = Field(
        default=None, description="probe: radius of the tip; 1 mm by default."
    )
    youngs_modulus: Annotated[float, MODULUS] = Field(
        default=101.2e3, description="Young's modulus of the skin (E1 of eq. 4). Of a probe, 3 GPa by default."
    )
    poisson_ratio: Annotated[float, POISSON_RATIO] = Field(
        default=0.5, description="Poisson's ratio of the skin (nu1 of eq. 4). Of a probe, 0.37 by default."
    )
    stiffness: Annotated[float | None, STIFFNESS] = Field(
        default=None,
        description="Stiffness k of the contact. It replaces eqs 4-5; the moduli then have no effect.",
    )

    @classmethod
    def completed(cls, given: Fields) -> Fields:
        """Add the defaults of the kind."""
        kind = given.get("kind", "comb")
        return {**KINDS[kind].defaults, **given} if isinstance(kind, str) and kind in KINDS else given

    @classmethod
    def conflicts(cls, given: Fields) -> list[Refusal]:
        """Refuse fields of other kinds, and an amplitude given twice."""
        kind = given.get("kind", "comb")
        if not isinstance(kind, str) or kind not in KINDS:
            return []
        found = [_foreign(given, name, kind) for name in given if name not in KINDS[kind].fields]
        return found + amplitude_twice(given, "ridge_amplitude")

    @classmethod
    def needs(cls, name: str) -> dict[str, list[str]]:
        """Return the kinds that have the field, where not every kind has it."""
        owners = [kind for kind, one in KINDS.items() if name in one.fields]
        return {} if len(owners) == len(KINDS) else {"finger.kind": owners}

    def derived(self) -> Fields:
        """Return the amplitude of a given roughness, or of a finger without ridges, and the length of a tip."""
        fields = self.traits.fields
        found: Fields = {} if "contact_length" in fields else {"contact_length": self.tip_radius}
        if "ridge_amplitude" not in fields:
            return found | {"ridge_amplitude": 0.0}
        if self.roughness is None:
            return found
        return found | {"ridge_amplitude": amplitude_of(self.roughness), "roughness": None}

    @property
    def traits(self) -> FingerKind:
        """The declaration of its kind."""
        return KINDS[self.kind]

    @property
    def width(self) -> float:
        """Width of the contact of a fingertip at 1 N, m."""
        return self.contact_length if self.contact_width is None else self.contact_width

    def document(self) -> dict[str, Any]:
        """Return the fields of its kind, without the kind "comb", the roughness, or a stiffness or width of None."""
        gone = [name for name in type(self).model_fields if name not in self.traits.fields]
        gone += ["roughness", *(name for name in ("stiffness", "contact_width") if getattr(self, name) is None)]
        return without(super().document(), *gone, *(("kind",) if self.kind == "comb" else ()))


def _foreign(given: Fields, name: str, kind: str) -> Refusal:
    owners = " or ".join(f'"{owner}"' for owner, one in KINDS.items() if name in one.fields)
    hint = f"Leave it out. It is a field of kind {owners}: write finger.kind too."
    return refusal([name], given[name], f'the fields of kind "{kind}": {", ".join(KINDS[kind].fields)}', hint)
