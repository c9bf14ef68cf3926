"""Find values that a scene allows but that are unusual: a length, a load or a speed beyond those of fingers.

Stage: 1 (SCENE). `Quantity.usual` is the largest usual magnitude of a field. The field's range is wider, because a
    machine can exceed the values of a finger.
Model: a number without a unit is in SI units. Users who think in millimetres write 0.6 where they mean 0.6 mm. An
    unusual value causes a warning that proposes the value that was probably meant.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TypeGuard

from synth.errors import Fault, shown
from synth.scene.rules import Quantity
from synth.scene.scene import Scene
from synth.scene.section import Section, inner_section, rule_of, without
from synth.scene.texture_registry import kinds


def doubts(scene: Scene) -> tuple[str, ...]:
    """Return a warning for each value of `scene` that is unusual, except a period that follows from other fields."""
    own = kinds()[scene.texture.kind].names
    return tuple(
        f"{'.'.join(path)} is {value:g} {rule.unit}, and more than {rule.show(rule.usual)} is unusual. A number "
        f"without a unit is in {rule.unit}{_meant(value, rule)}."
        for path, value, rule in _numbers(Scene, dict(scene))
        if abs(value) > rule.usual and not (path == ("texture", "period") and "period" not in own)
    )


def bare_doubts(patch: Mapping[str, object]) -> list[Fault]:
    """Return a fault for each number of a partial scene that has no unit and would be unusual in SI units."""
    return [
        Fault(
            f"/{'/'.join(path)}",
            shown(value),
            f"a number with its unit beyond {rule.show(rule.usual)}",
            f'It would be {value:g} {rule.unit}{_meant(value, rule)}, or "{value:g} {rule.unit}".',
        )
        for path, value, rule in _numbers(Scene, patch)
        if rule.usual < abs(value) <= rule.high
    ]


def _numbers(
    section: type[Section], given: Mapping[str, object], *above: str
) -> Iterator[tuple[tuple[str, ...], float, Quantity]]:
    """Yield path, value and rule of each number in `given`, which holds fields of `section`."""
    for name, value in given.items():
        inner = inner_section(section, name) if name in section.model_fields else None
        if isinstance(value, Section):
            fields = dict(value)  # with a stroke, the scan's speed and load repeat those of the stroke
            value = fields if fields.get("stroke") is None else without(fields, "speed", "load")
        if inner is not None and isinstance(value, Mapping):
            yield from _numbers(inner, value, *above, name)
        elif inner is None and name in section.model_fields and _is_number(value):
            rule = rule_of(section, name)
            if isinstance(rule, Quantity):
                yield (*above, name), value, rule


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _meant(value: float, rule: Quantity) -> str:
    """Return the value that was probably meant, as the end of a sentence, or ""."""
    for unit in rule.dimension.shown_units:
        meant = float(value) * float(rule.dimension.units[unit])
        if unit != rule.unit and rule.low <= meant and abs(meant) <= rule.usual:
            return f': write "{value:g} {unit}" if that was meant'
    return ""
