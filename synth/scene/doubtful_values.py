"""What a careful reader questions in a scene that is allowed: a length, a load or a speed that no finger has.

Stage: 1 (SCENE). A field says what is usual (`Quantity.usual`); its range allows more, since a machine may do more.
Model: a number without a unit is in SI units, and a page that counts in millimetres makes people write 0.6 for 0.6 mm.
    What is beyond the usual is told, with what was probably meant.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from synth.errors import Fault, shown
from synth.scene.rules import Quantity, Rule
from synth.scene.scene import Scene
from synth.scene.section import Section, inner_section, rule_of


def doubts(scene: Scene) -> tuple[str, ...]:
    """Return a sentence for each value of `scene` that is beyond what is usual."""
    return tuple(
        f"{path} is {value:g} {rule.unit}, and more than {rule.show(rule.usual)} is unusual. A number without a unit "
        f"is in {rule.unit}{_meant(value, rule)}."
        for path, value, rule in _quantities(scene, "")
        if abs(value) > rule.usual
    )


def bare_doubts(patch: Mapping[str, object]) -> list[Fault]:
    """Return a fault for each number of a partial scene that has no unit and would be unusual in SI units."""
    return list(_bare(Scene, patch, ""))


def _bare(section: type[Section], given: Mapping[str, object], above: str) -> Iterator[Fault]:
    for name, value in given.items():
        if name not in section.model_fields:
            continue
        inner = inner_section(section, name)
        if inner is not None and isinstance(value, Mapping):
            yield from _bare(inner, value, f"{above}/{name}")
        elif inner is None and isinstance(value, int | float) and not isinstance(value, bool):
            rule = rule_of(section, name)
            if isinstance(rule, Quantity) and rule.usual < abs(value) <= rule.high:
                allowed = f"a number with its unit beyond {rule.show(rule.usual)}"
                hint = f'It would be {value:g} {rule.unit}{_meant(value, rule)}, or "{value:g} {rule.unit}".'
                yield Fault(f"{above}/{name}", shown(value), allowed, hint)


def _meant(value: float, rule: Quantity) -> str:
    """Return what was probably meant, as the end of a sentence, or ""."""
    for unit in rule.dimension.shown_units:
        meant = float(value) * float(rule.dimension.units[unit])
        if unit != rule.unit and rule.low <= meant and abs(meant) <= rule.usual:
            return f': write "{value:g} {unit}" if that was meant'
    return ""


def _quantities(section: Section, above: str) -> Iterator[tuple[str, float, Quantity]]:
    kind = type(section)
    unwritten = ("speed", "load") if getattr(section, "stroke", None) is not None else ()  # they are the stroke's own
    for name in kind.model_fields:
        value = None if name in unwritten else getattr(section, name)
        if isinstance(value, Section):
            yield from _quantities(value, f"{above}{name}.")
        elif isinstance(value, int | float) and inner_section(kind, name) is None:
            rule: Rule = rule_of(kind, name)
            if isinstance(rule, Quantity):
                yield f"{above}{name}", value, rule
