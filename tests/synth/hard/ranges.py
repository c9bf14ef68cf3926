"""The ends of the range of every numeric field of a scene, read from the scene itself: a new field joins by itself."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from synth.scene.finger_section import PRINT, TIP
from synth.scene.output_section import FULL_SCALE_RANGES, FullScale
from synth.scene.rules import Quantity, QuantityOrName, Rule
from synth.scene.scan_section import LINE
from synth.scene.scene import Scene
from synth.scene.section import Section, inner_section, rule_of
from synth.scene.texture_registry import SHARED, special_fields
from tests.synth.scene.scene_cases import nested

COMBINED = ("not both", "room for turns", "at most 1.6 length / speed", "at most half the duration")
"""What the refusals say of fields that are each in range, but not together."""

COMPANY: dict[str, dict[str, Any]] = {
    "scan.stroke.turn_time": {"scan": {"stroke": {"length": 10.0}}},
    "output.fade": {"output": {"duration": 120.0}},
}
"""What makes room for the high end of a field."""


@dataclass(frozen=True)
class Field:
    """A numeric field: its dotted path, the rule of its numbers, and, of a full scale, the quantity it is of."""

    path: str
    rule: Quantity
    quantity: str = ""

    @property
    def name(self) -> str:
        """The path, told apart by the quantity."""
        return f"{self.path} of {self.quantity}" if self.quantity else self.path

    @property
    def pointer(self) -> str:
        """The RFC 6901 pointer of the field."""
        return "/" + self.path.replace(".", "/")

    @property
    def ends(self) -> tuple[float, float]:
        """Both ends of the range, in SI."""
        return (int(self.rule.low), int(self.rule.high)) if self.rule.whole else (self.rule.low, self.rule.high)

    @property
    def company(self) -> dict[str, Any]:
        """Return what else a scene must hold where the field is at its high end."""
        return COMPANY.get(self.path, {})

    def displaces(self, other: Field) -> bool:
        """Return whether the field and `other` cannot be given together."""
        amplitudes = {"finger.ridge_amplitude", "texture.amplitude"}
        for one, two in ((self, other), (other, self)):
            section = one.path.partition(".")[0]
            if one.path == f"{section}.roughness" and two.path in amplitudes and two.path.startswith(section):
                return True
            if one.path in ("scan.speed", "scan.load") and two.path.startswith("scan.stroke."):
                return True
        return False

    def document(self, value: Any) -> dict[str, Any]:
        """Return the document in which the field is `value`."""
        if not self.quantity:
            return nested(self.path, value)
        return {"output": {"channels": None, "quantity": self.quantity, "full_scale": value}}


def rules(section: type[Section] = Scene, above: str = "") -> Iterator[tuple[str, Rule]]:
    """Yield the dotted path and the rule of every field of a section, those of the sections inside it too."""
    for name in section.model_fields:
        inner = inner_section(section, name)
        if inner is None:
            yield above + name, rule_of(section, name)
        else:
            yield from rules(inner, f"{above}{name}.")


OF_ONE_KIND = {
    *(f"texture.{name}" for name in special_fields() if name not in SHARED),
    *(f"finger.{name}" for name in (*PRINT, *TIP)),
    "texture.spacing",
    "texture.period_across",
    *(f"scan.{name}" for name in LINE),
}
"""Fields that only some kinds of texture or finger have: tests/synth/surfaces/test_texture_fields.py,
tests/synth/scene/test_finger_kinds.py and tests/synth/scene/test_area_scan.py have their ends."""


def numeric_fields() -> list[Field]:
    """Return every numeric field of a scene, less those of one kind of texture or finger."""
    found = []
    for path, rule in rules():
        if path in OF_ONE_KIND:
            continue
        if isinstance(rule, FullScale):
            found += [Field(path, rule_of_one, quantity) for quantity, rule_of_one in FULL_SCALE_RANGES.items()]
        elif isinstance(rule, Quantity | QuantityOrName):
            found.append(Field(path, rule.quantity if isinstance(rule, QuantityOrName) else rule))
    return found


FIELDS = numeric_fields()


def inside(field: Field, part: float) -> float:
    """Return the value at `part` (0 to 1) of the range: evenly on a logarithmic scale where it has one sign."""
    low, high = field.ends
    smallest = low or 1e-6 * high
    value = low + part * (high - low) if low < 0.0 else math.exp(math.log(smallest) + part * math.log(high / smallest))
    return round(value) if field.rule.whole else min(max(value, low), high)
