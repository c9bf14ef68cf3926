"""The texture section of a scene.

Stage: 1 (SCENE). Every field is declared once: its type with its rule, its default in SI, and a sentence on its
    meaning. Fields that belong to one kind of texture are declared with the kind (`texture_registry`).
Model: eq. 3 of Fagiani & Barbieri 2016 converts a roughness Ra to an amplitude, a = (pi / 2) Ra. After reading, a scene
holds only the amplitude.
Limits: this project chose the ranges of the moduli and the phase. They are wide enough for any finger and any sample,
and narrow enough that a wrong unit is noticed.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field, create_model

from synth.scene.catalogue import catalogue_kinds, catalogue_names, lookup
from synth.scene.quantity import Dimension
from synth.scene.rules import Choice, Fields, Quantity, Refusal, Rule, refusal, refused
from synth.scene.section import Section, without
from synth.scene.texture_registry import (
    SPACING,
    STEEPEST,
    USUAL_SPACING,
    Kind,
    kinds,
    kinds_with,
    special_fields,
)

# A value above `usual` causes a warning. The coarsest texture of the catalogue has a period of 20 mm.
AMPLITUDE = Quantity(Dimension.LENGTH, 0.0, 1e-3, usual=0.5e-3)
LARGEST_ROUGHNESS = 0.636e-3  # m: the amplitude range by eq. 3, rounded down
ROUGHNESS = Quantity(Dimension.LENGTH, 0.0, LARGEST_ROUGHNESS, usual=0.318e-3)
MODULUS = Quantity(Dimension.PRESSURE, 1e3, 1e12)  # from softer than any skin layer to about diamond
POISSON_RATIO = Quantity(Dimension.NONE, 0.0, 0.5)  # 0.5 is incompressible, the largest value of an isotropic solid


HIGHEST = 2e-3
"""m. Largest height of a texture from valley to crest: twice the largest amplitude."""


WIDER = 1e-6
"""Relative excess that is allowed when a profile is checked. A profile's computed bounds can slightly exceed its true
extremes."""


class Address(Rule):
    """The address of heights that this process knows (`surfaces.surface_data`)."""

    allowed = "64 hexadecimal digits"

    def read(self, value: object) -> str:
        """Return the address."""
        if isinstance(value, str) and re.fullmatch("[0-9a-f]{64}", value):
            return value
        raise refused(self.allowed, "Import a surface; the answer has its address.")

    def schema(self) -> dict[str, Any]:
        """Return the schema of an address."""
        return {"anyOf": [{"type": "string", "pattern": "^[0-9a-f]{64}$"}]}


def amplitude_of(roughness: float) -> float:
    """Return the amplitude (m) of a cosine whose mean arithmetic roughness Ra is `roughness` (m), by eq. 3."""
    return 0.5 * math.pi * roughness


def with_named(owners: Sequence[str]) -> list[str]:
    """Return the kinds `owners`, and the catalogue names of textures of these kinds: values of `texture.kind`."""
    return [*owners, *(name for name, kind in catalogue_kinds().items() if kind in owners)]


class TextureFields(Section):
    """The sample under the finger: its form and its elasticity."""

    kind: Annotated[str, Choice(tuple(kinds()), catalogue_names(), "a name from the catalogue")] = Field(
        default="sinusoid",
        description="Form of the surface, or the name of a texture, which sets the fields not given here.",
    )
    period: Annotated[float, Quantity(Dimension.LENGTH, 1e-6, 1.0, usual=0.05)] = Field(
        default=0.8e-3,
        description="Distance after which the texture repeats (lambda2 of eq. 2). Of a rough one, 20 mm by default.",
    )
    period_across: Annotated[float | None, Quantity(Dimension.LENGTH, 1e-6, 1.0, usual=0.05)] = Field(
        default=None, description="rough_area, weave: the period across the scan; null: the period along it."
    )
    amplitude: Annotated[float, AMPLITUDE] = Field(
        default=20e-6, description="sinusoid: half the height of the texture from valley to crest (a2 of eq. 2)."
    )
    roughness: Annotated[float | None, ROUGHNESS] = Field(
        default=None, description="sinusoid: mean arithmetic roughness Ra, instead of amplitude (eq. 3)."
    )
    spacing: Annotated[float | None, SPACING] = Field(
        default=USUAL_SPACING, description="profile, heightmap: distance between neighbouring heights."
    )
    surface: Annotated[str | None, Address()] = Field(
        default=None, description="profile, heightmap: instead of heights, the address of an imported surface."
    )
    ends: Annotated[str | None, Choice(("join", "mirror"))] = Field(
        default=None,
        description="profile, heightmap: join: the last height connects to the first (default of a profile); "
        "mirror: the surface continues as its mirror image (default of a heightmap).",
    )
    phase: Annotated[float, Quantity(Dimension.ANGLE, -1000.0, 1000.0)] = Field(
        default=math.sqrt(2.0), description="Phase of the texture at position 0 (phi of eq. 2)."
    )
    youngs_modulus: Annotated[float | None, MODULUS] = Field(
        default=None, description="Young's modulus of the sample (E2 of eq. 4). The default is a rigid sample."
    )
    poisson_ratio: Annotated[float, POISSON_RATIO] = Field(
        default=0.5,
        description="Poisson's ratio of the sample (nu2 of eq. 4). It has no effect if the sample is rigid.",
    )

    @classmethod
    def completed(cls, given: Fields) -> Fields:
        """Replace a catalogue name by its texture, and add defaults that are specific to the kind.

        Other given fields override those of the catalogue.
        """
        name = given.get("kind")
        if not isinstance(name, str):
            return given
        if name in kinds():
            return {**kinds()[name].defaults, **given}
        if name not in catalogue_names():
            return given
        named: Fields = dict(lookup(name).document["texture"])
        kind = kinds()[str(named["kind"])]
        for pair in kind.pairs:
            if any(field in given for field in pair):
                named = without(named, *pair)
        return {**kind.defaults, **named, **without(given, "kind")}

    @classmethod
    def conflicts(cls, given: Fields) -> list[Refusal]:
        """Refuse fields of other kinds, an amplitude given twice, and a surface that is too steep or too high."""
        name = given.get("kind", "sinusoid")
        if not isinstance(name, str) or name not in kinds():
            return []
        kind = kinds()[name]
        found = [
            _foreign(given, field, name) for field in given if field in special_fields() and field not in kind.names
        ]
        found += amplitude_twice(given, "amplitude") if "amplitude" in kind.shared else []
        values = {field: cls.value_of(given, field) for field in ("phase", *kind.names)}
        if any(field in given and value is None for field, value in values.items()):
            return found
        between = kind.refusals(values, given)
        return found + (between or _beyond(kind, kind.make(values), given))

    @classmethod
    def needs(cls, name: str) -> dict[str, list[str]]:
        """Return the kinds and the catalogue names that have the field, where not every kind has it."""
        owners = kinds_with(name)
        return {"texture.kind": with_named(owners)} if name in special_fields() and len(owners) < len(kinds()) else {}

    def derived(self) -> Fields:
        """Return the amplitude of a given roughness. For kinds other than a sinusoid, return period and amplitude.

        That amplitude is the one of the equivalent sinusoid.
        """
        kind = kinds()[self.kind]
        found: Fields = {name: None for name in special_fields() if name not in kind.names}
        if "amplitude" in kind.shared:
            return found | (
                {} if self.roughness is None else {"amplitude": amplitude_of(self.roughness), "roughness": None}
            )
        profile = kind.make(self.values())
        found |= {first: None for first, second in kind.pairs if getattr(self, second) is not None}
        return found | {"period": profile.period, "amplitude": profile.equivalent().amplitude}

    def values(self) -> dict[str, Any]:
        """Return the phase and the fields of the kind, from which its profile is made."""
        return {name: getattr(self, name) for name in ("phase", *kinds()[self.kind].names)}

    def document(self) -> dict[str, Any]:
        """Return the section with only the fields of its kind, and without the roughness."""
        names = kinds()[self.kind].names
        foreign = [name for name in special_fields() if name not in names]
        return kinds()[self.kind].written(without(super().document(), "roughness", "file", *foreign), self.values())


if TYPE_CHECKING:

    class Texture(TextureFields):
        """The sample under the finger, with the fields of every kind. A field that its kind does not have is None.

        period: length after which the texture repeats, m, for every kind.
        amplitude: amplitude of the sinusoid with the same Rq and rms slope, m, for every kind.
        """

else:
    _OF_KINDS = [kind.fields for kind in reversed(kinds().values()) if kind.fields is not Section]
    Texture = create_model(
        "Texture",
        __base__=(*_OF_KINDS, TextureFields),  # pydantic orders the fields in the reverse of this order
        __module__=__name__,
        __doc__=TextureFields.__doc__,
    )


def _foreign(given: Fields, field: str, name: str) -> Refusal:
    owners = " or ".join(f'"{kind}"' for kind in kinds_with(field))
    allowed = f'the fields of kind "{name}": {", ".join(kinds()[name].names)}'
    return refusal([field], given[field], allowed, f"Leave it out. It is a field of {owners}.")


def _beyond(kind: Kind, profile: Any, given: Fields) -> list[Refusal]:
    """Refuse a surface that is too steep or too high."""
    if not kind.steep:
        return []
    low, high = profile.extent
    field = next((other for one, other in kind.pairs if one == kind.steep and other in given), kind.steep)
    where, written = [field], given.get(field)
    if not high - low <= HIGHEST * (1.0 + WIDER):
        hint = f"From valley to crest it is {high - low:.4g} m. Write smaller heights."
        return [refusal(where, written, f"a surface {HIGHEST:g} m high at most", hint)]
    if not profile.slope_bound <= STEEPEST * (1.0 + WIDER):
        hint = f"Its steepest slope is {profile.slope_bound:.4g}. Write smaller heights or greater lengths."
        return [refusal(where, written, f"slopes of {STEEPEST:g} at most", hint)]
    return []


def amplitude_twice(given: Mapping[str, object], amplitude: str) -> list[Refusal]:
    """Refuse a roughness beside an `amplitude`."""
    if amplitude not in given or "roughness" not in given:
        return []
    hint = f"Leave one out. They are two ways to write one value: {amplitude} = pi / 2 times roughness."
    return [refusal(["roughness"], given["roughness"], f"{amplitude} or roughness, not both", hint)]
