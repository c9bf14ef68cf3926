"""One axis of a study: a field of the scene, or a dimensionless group, and its values.

Stage   STUDY, read by `spec`.
Model   An axis is written as a list of values, or as a range {"from", "to", "count", "spacing"}: count values from one
        end to the other, both included, at equal steps or, with the spacing "log", at equal ratios. Text has its unit.
        In a study of samples an axis is a range without a count. Fields that change together are an axis over their
        section, such as `texture`, whose values are objects.
Limits  Numbers and text with units are not mixed in one axis, since a bare number would be in SI beside millimetres.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydantic_core import PydanticCustomError

from synth.arrays import Array
from synth.contact.groups import NAMES
from synth.errors import Fault, SceneError, shown
from synth.scene.array_values import is_array
from synth.scene.effects_section import declaration, effect_names
from synth.scene.quantity import Dimension
from synth.scene.rules import Quantity, words_of
from synth.scene.scene import Scene
from synth.scene.section import Section, inner_section, rule_of
from synth.scene.text import pointer

GROUPS, SECTION = "groups", "an object with fields of the section"
OF_GROUP = {
    "ridges": "finger.contact_length", "period_ratio": "texture.period", "amplitude_ratio": "texture.amplitude",
    "load": "scan.load",
}  # fmt: skip
GROUP = Quantity(Dimension.NONE, 1e-12, 1e12)
RANGE = ("from", "to", "count", "spacing")
SPACINGS = ("linear", "log")
MOST_VALUES = 1 << 20


@dataclass(frozen=True, slots=True)
class Axis:
    """A field and its values.

    name: dotted field, or "groups." and the name of a group.
    values: SI numbers, words or objects, in order; of a study of samples both ends of the range.
    unit: SI; "" for a ratio or words.
    log: whether a range is divided at equal ratios.
    """

    name: str
    values: tuple[Any, ...]
    unit: str
    log: bool = False

    @property
    def of_group(self) -> bool:
        """Whether it is a group of eq. 7."""
        return self.name.startswith(f"{GROUPS}.")

    @property
    def fields(self) -> set[str]:
        """Fields of the scene that it sets, those of a group included."""
        if self.of_group:
            return {OF_GROUP[self.name.partition(".")[2]]}
        inner = {name for value in self.values if isinstance(value, dict) for name in value}
        return {f"{self.name}.{name}" for name in inner} or {self.name}

    def at(self, part: Array) -> Array:
        """Return the values at `part` of the way from one end of its range to the other, 0 to 1."""
        low, high = self.values
        return np.asarray(low * (high / low) ** part if self.log else low + (high - low) * part)


def label(value: Any) -> Any:
    """Return a value as it labels a scene: an object as JSON."""
    return json.dumps(value, sort_keys=True) if isinstance(value, dict) else value


def read_axis(name: str, written: object, *, sampled: bool) -> Axis:
    """Return the axis `name` as a spec writes it. Raises SceneError with pointers into the spec.

    sampled: whether a range without a count is needed, for samples between its ends.
    """
    rule = _rule(name)
    if isinstance(written, Mapping):
        return _range(name, written, rule, sampled=sampled)
    listed = written.tolist() if is_array(written) else written  # type: ignore[attr-defined]
    if sampled or not isinstance(listed, list | tuple):
        allowed = 'a range {"from", "to"}' if sampled else 'a list of values, or a range {"from", "to", "count"}'
        raise _refused(name, written, allowed, 'Write {"from": "0.1 mm", "to": "10 mm", "spacing": "log"}.')
    if not 1 <= len(listed) <= MOST_VALUES:
        raise _refused(name, listed, f"1 to {MOST_VALUES} values", "Write at least one value.")
    _not_mixed(name, listed)
    values = tuple(_read(name, one, rule, number) for number, one in enumerate(listed))
    return Axis(name, values, rule.unit if isinstance(rule, Quantity) else "")


def _rule(name: str) -> Any:
    """Return the rule of a dotted field or of a group. Raises SceneError for an unknown one."""
    first, *rest = name.split(".")
    if first == GROUPS:
        if len(rest) == 1 and rest[0] in NAMES:
            return GROUP
        raise _refused(name, name, f"one of {', '.join(f'{GROUPS}.{one}' for one in NAMES)}", "Check the name.")
    section: type[Section] | None = Scene
    for number, part in enumerate(name.split(".")):
        if number == 1 and first == "effects":
            section = declaration(part).settings if part in effect_names() else None
            continue
        if section is None or part not in section.model_fields:
            break
        inner = inner_section(section, part)
        if inner is None and part != "effects":
            if number == len(rest):
                return rule_of(section, part)
            break
        if number == len(rest):
            return SECTION
        section = inner
    hint = "Write a field of a scene (docs/scene.md), such as texture.period, or a group, such as groups.period_ratio."
    raise _refused(name, name, "a field that holds one value, or a section", hint)


def _range(name: str, written: Mapping[Any, Any], rule: Any, *, sampled: bool) -> Axis:
    """Return the axis of a range."""
    unknown = [one for one in written if one not in RANGE]
    if unknown:
        raise _refused(f"{name}/{unknown[0]}", written[unknown[0]], f"only {', '.join(RANGE)}", "Check the spelling.")
    if not isinstance(rule, Quantity):
        raise _refused(name, written, "a list of values", "A range is for numbers.")
    spacing = written.get("spacing", "linear")
    if spacing not in SPACINGS:
        raise _refused(f"{name}/spacing", spacing, " or ".join(SPACINGS), 'Leave it out for "linear".')
    ends = [written.get("from"), written.get("to")]
    _not_mixed(name, ends)
    low, high = (_read(f"{name}/{key}", one, rule) for key, one in zip(("from", "to"), ends, strict=True))
    if not low < high:
        raise _refused(name, f"{ends[0]} to {ends[1]}", "a range from a smaller value to a larger one", "It is empty.")
    if spacing == "log" and low <= 0.0:
        raise _refused(f"{name}/from", ends[0], "above 0 where the spacing is log", "Write a small value, or linear.")
    count = written.get("count")
    axis = Axis(name, (low, high), rule.unit, spacing == "log")
    if sampled:
        if count is not None:
            raise _refused(f"{name}/count", count, "no count", "The number of samples is that of `sample`.")
        return axis
    if not isinstance(count, int) or isinstance(count, bool) or not 2 <= count <= MOST_VALUES:
        raise _refused(f"{name}/count", count, f"a whole number from 2 to {MOST_VALUES}", "Write how many values.")
    values = axis.at(np.arange(count) / (count - 1))
    if rule.whole:
        values = np.unique(np.round(values)).astype(int)
    return Axis(name, (low, *values[1:-1].tolist(), high), rule.unit, spacing == "log")


def _not_mixed(name: str, values: Any) -> None:
    """Refuse bare numbers beside text with units."""
    kinds = {isinstance(one, str) for one in values if isinstance(one, str | int | float) and not isinstance(one, bool)}
    if len(kinds) == 2 and any(isinstance(one, str) and one[:1].isdigit() for one in values):
        hint = "Write every value with its unit, or every value as a number in SI."
        raise _refused(name, values, "values that are all text with units, or all numbers", hint)


def _read(name: str, value: object, rule: Any, number: int | None = None) -> Any:
    """Return a number in SI; words and switches as they are, since a scene checks them with the rest of its section."""
    where = name if number is None else f"{name}/{number}"
    if rule == SECTION:
        if isinstance(value, Mapping) and value:
            return dict(value)
        raise _refused(where, value, SECTION, 'Write {"period": "0.4 mm", "amplitude": "5 um"}.')
    if not isinstance(rule, Quantity):
        if isinstance(value, str | bool | int | float):
            return value
        raise _refused(where, value, rule.allowed, "Write a word or a number.")
    try:
        return rule.read(value)
    except PydanticCustomError as error:
        raise _refused(where, value, **words_of(error)) from None


def _refused(where: str, value: object, allowed: str, hint: str) -> SceneError:
    name, *rest = where.split("/")
    return SceneError([Fault("/axes" + pointer(name, *rest), shown(value), allowed, hint)])
