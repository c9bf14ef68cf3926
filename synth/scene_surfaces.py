"""The two surfaces of a scene: the finger and the texture under it.

Stage: 1 (SCENE). Every field is declared once: its type with its rule, its default in SI, a sentence that says what it
means.
Model: eq. 3 of Fagiani & Barbieri 2016 turns a roughness Ra into an amplitude, a = (pi / 2) Ra. A scene that has been
read holds the amplitude alone.
Limits: the ranges of the moduli and the phase are this project's choice: wide enough for any finger and any sample,
narrow enough that a slipped unit is noticed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import Field

from synth.quantity import Dimension
from synth.scene_rules import Choice, Fields, Quantity, Refusal, Rule, refusal
from synth.scene_section import Section, without
from synth.textures import catalogue_names, lookup

KINDS = ("sinusoid",)
"""Texture kinds that are computed; `texture.kind` also takes the names of the catalogue."""

AMPLITUDE = Quantity(Dimension.LENGTH, 0.0, 1e-3)
ROUGHNESS = Quantity(Dimension.LENGTH, 0.0, 0.636e-3)  # the amplitude range by eq. 3, rounded down
MODULUS = Quantity(Dimension.PRESSURE, 1e3, 1e12)  # softer than any skin layer, to about diamond
POISSON_RATIO = Quantity(Dimension.NONE, 0.0, 0.5)  # 0.5 is incompressible, the largest an isotropic solid can have


def amplitude_of(roughness: float) -> float:
    """Return the amplitude in m of a cosine whose mean arithmetic roughness Ra is `roughness` in m (eq. 3)."""
    return 0.5 * math.pi * roughness


class Finger(Section):
    """The fingertip: a row of ridges, a cosine along the contact, and the skin's elasticity."""

    ridge_period: Annotated[float, Quantity(Dimension.LENGTH, 1e-5, 1e-2)] = Field(
        default=0.5e-3, description="Distance from one ridge of the fingerprint to the next (lambda1 of eq. 2)."
    )
    ridge_amplitude: Annotated[float, AMPLITUDE] = Field(
        default=40e-6, description="Half the height of the ridges from valley to crest (a1 of eq. 2)."
    )
    roughness: Annotated[float | None, ROUGHNESS] = Field(
        default=None, description="Mean arithmetic roughness Ra of the ridges, instead of ridge_amplitude (eq. 3)."
    )
    contact_length: Annotated[float, Quantity(Dimension.LENGTH, 1e-5, 0.1)] = Field(
        default=0.01, description="Length of the contact along the direction of scanning (L of eq. 1)."
    )
    youngs_modulus: Annotated[float, MODULUS] = Field(
        default=101.2e3, description="Young's modulus of the skin (E1 of eq. 4)."
    )
    poisson_ratio: Annotated[float, POISSON_RATIO] = Field(
        default=0.5, description="Poisson's ratio of the skin (nu1 of eq. 4)."
    )

    @classmethod
    def conflicts(cls, given: Fields) -> list[Refusal]:
        """Refuse an amplitude given twice."""
        return _amplitude_twice(given, "ridge_amplitude")

    def derived(self) -> Fields:
        """Return the amplitude if it was given as a roughness."""
        return {} if self.roughness is None else {"ridge_amplitude": amplitude_of(self.roughness), "roughness": None}

    def document(self) -> dict[str, Any]:
        """Return the section with the amplitude alone."""
        return without(super().document(), "roughness")


@dataclass(frozen=True)
class TextureKind(Rule):
    """A kind of texture, or the name of a texture in the catalogue, which fills in the fields that are not given."""

    @property
    def allowed(self) -> str:
        """The kinds and the catalogue's names."""
        return self._names.allowed

    def read(self, value: object) -> str:
        """Return the kind; names of the catalogue have been replaced by then."""
        return self._names.read(value)

    def schema(self) -> dict[str, Any]:
        """Return the kinds and the names."""
        return self._names.schema()

    @property
    def _names(self) -> Choice:
        return Choice((*KINDS, *catalogue_names()))


class Texture(Section):
    """The sample under the finger: one sinusoid, rigid or elastic."""

    kind: Annotated[str, TextureKind()] = Field(
        default="sinusoid", description="Form of the surface, or a name of the catalogue for the fields not given here."
    )
    period: Annotated[float, Quantity(Dimension.LENGTH, 1e-6, 1.0)] = Field(
        default=0.8e-3, description="Distance from one crest of the texture to the next (lambda2 of eq. 2)."
    )
    amplitude: Annotated[float, AMPLITUDE] = Field(
        default=20e-6, description="Half the height of the texture from valley to crest (a2 of eq. 2)."
    )
    roughness: Annotated[float | None, ROUGHNESS] = Field(
        default=None, description="Mean arithmetic roughness Ra of the texture, instead of amplitude (eq. 3)."
    )
    phase: Annotated[float, Quantity(Dimension.ANGLE, -1000.0, 1000.0)] = Field(
        default=math.sqrt(2.0), description="Phase of the texture at position 0 (phi of eq. 2)."
    )
    youngs_modulus: Annotated[float | None, MODULUS] = Field(
        default=None, description="Young's modulus of the sample (E2 of eq. 4); the default is a rigid sample."
    )
    poisson_ratio: Annotated[float, POISSON_RATIO] = Field(
        default=0.5,
        description="Poisson's ratio of the sample (nu2 of eq. 4); it changes nothing if the sample is rigid.",
    )

    @classmethod
    def completed(cls, given: Fields) -> Fields:
        """Replace a name of the catalogue by its texture; what is given here beside the name stays."""
        name = given.get("kind")
        if not isinstance(name, str) or name not in catalogue_names():
            return given
        named: Fields = dict(lookup(name).document["texture"])
        if "amplitude" in given or "roughness" in given:
            named = without(named, "amplitude", "roughness")
        return {**named, **without(given, "kind")}

    @classmethod
    def conflicts(cls, given: Fields) -> list[Refusal]:
        """Refuse an amplitude given twice."""
        return _amplitude_twice(given, "amplitude")

    def derived(self) -> Fields:
        """Return the amplitude if it was given as a roughness."""
        return {} if self.roughness is None else {"amplitude": amplitude_of(self.roughness), "roughness": None}

    def document(self) -> dict[str, Any]:
        """Return the section with the amplitude alone."""
        return without(super().document(), "roughness")


def _amplitude_twice(given: Mapping[str, object], amplitude: str) -> list[Refusal]:
    if amplitude not in given or "roughness" not in given:
        return []
    hint = f"Leave one out; they are two ways to write the same, {amplitude} = pi / 2 times roughness."
    return [refusal(["roughness"], given["roughness"], f"{amplitude} or roughness, not both", hint)]
