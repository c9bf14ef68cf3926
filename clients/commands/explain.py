"""`ridgewave explain SCENE`: prints the plan of a scene, as tables or as JSON."""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Mapping
from typing import Any

from clients.command_line.exit_codes import DONE
from clients.command_line.printing import print_json, print_table
from clients.command_line.progress import Waiting
from clients.command_line.scene_argument import read_scene
from synth import explain
from synth.scene.effects_section import declaration
from synth.scene.rules import Quantity
from synth.scene.section import rule_of

ENDINGS = {"_hz": " (Hz)", "_db": " (dB)", "_seconds": " (s)", "_bytes": " (bytes)", "_m": " (m)"}
"""Endings of field names that give a unit, and the text shown instead."""
SIZES = ((1e9, "GB"), (1e6, "MB"), (1e3, "kB"))


def run(arguments: argparse.Namespace) -> int:
    """Carry out the command; raises InvalidRequest, CannotRender, OSError."""
    scene = read_scene(arguments)
    with Waiting("solving the contact", arguments.progress):
        document = explain(scene).document()
    if arguments.json:
        print_json(document)
    else:
        print_plan(document)
    return DONE


def print_plan(document: Mapping[str, Any]) -> None:
    """Print the document of a plan as tables."""
    _print_simulated(document["simulated"])
    _print_left_out(document["left_out"])
    _print_mapping("Contact response", document["response"])
    _print_mapping("Estimated error, of peak to peak", document["estimated_error"], ("quantity", "error"))
    _print_mapping("Cost", document["cost"])
    for warning in document["warnings"]:
        print(f"Warning: {warning}")


def _print_simulated(items: list[dict[str, Any]]) -> None:
    """Print a row for each simulated part; effects also have their settings and price."""
    title = "Simulated, in order"
    if not items:
        print(f"{title}: nothing\n")
    elif any("settings" in item for item in items):
        columns = ("name", "reason", "settings", "price, alone")
        print_table(title, columns, [(item["name"], item["reason"], _settings(item), _price(item)) for item in items])
    else:
        print_table(title, ("name", "reason"), [(item["name"], item["reason"]) for item in items])


def _print_left_out(items: list[dict[str, Any]]) -> None:
    if not items:
        print("Left out: nothing\n")
        return
    groups: dict[tuple[str, str], list[str]] = {}
    for item in items:
        groups.setdefault((item["reason"], _text(item["effect_on_output"])), []).append(item["name"])
    rows = [(", ".join(names), reason, effect) for (reason, effect), names in groups.items()]
    print_table("Left out", ("name", "reason", "effect on output"), rows)


def _settings(item: Mapping[str, Any]) -> str:
    """Return the settings of an effect, one per line, with units."""
    if "settings" not in item:
        return ""
    section = declaration(item["name"]).settings
    lines = []
    for name, value in item["settings"].items():
        rule = rule_of(section, name)
        short = float(f"{value:.4g}") if isinstance(value, float) else value
        shown = rule.show(short) if isinstance(rule, Quantity) and value is not None else _text(value)
        lines.append(f"{_words(name)} {shown}")
    return "\n".join(lines)


def _price(item: Mapping[str, Any]) -> str:
    if "price" not in item:
        return ""
    price = item["price"]
    return f"{price['ns_per_frame']:.4g} ns per frame\n{_size(price['memory_bytes'])}"


def _size(count: int) -> str:
    for size, unit in SIZES:
        if count >= size:
            return f"{count / size:.3g} {unit}"
    return f"{count} bytes"


def _print_mapping(title: str, values: Mapping[str, Any], columns: tuple[str, str] = ("what", "value")) -> None:
    """Print the plain values of a mapping under `columns`, then a table for each nested mapping or list."""
    print_table(title, columns, [(_words(name), _text(value)) for name, value in values.items() if _is_plain(value)])
    for name, value in values.items():
        if isinstance(value, Mapping):
            _print_mapping(_words(name).capitalize(), dict(_leaves(value)))
        elif not _is_plain(value):
            _print_list(_words(name).capitalize(), value)


def _print_list(title: str, items: list[Mapping[str, Any]]) -> None:
    """Print a row for each mapping of a list; all have the same fields."""
    names = list(items[0])
    print_table(title, [_words(name) for name in names], [[_text(item[name]) for name in names] for item in items])


def _is_plain(value: object) -> bool:
    return not isinstance(value, Mapping) and not (
        isinstance(value, list) and any(isinstance(inner, Mapping) for inner in value)
    )


def _leaves(values: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the leaves of `values`, named with the names of the mappings that hold them."""
    for name, value in values.items():
        if isinstance(value, Mapping):
            yield from _leaves(value, f"{above}{name}: ")
        else:
            yield f"{above}{name}", value


def _words(name: str) -> str:
    """Return the name of a field as words, with the unit in brackets."""
    for ending, unit in ENDINGS.items():
        if name.endswith(ending):
            return name.removesuffix(ending).replace("_", " ") + unit
    return name.replace("_", " ")


def _text(value: object) -> str:
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.0f}" if 1e4 <= abs(value) < 1e9 else f"{value:.4g}"
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)
