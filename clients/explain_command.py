"""`ridgewave explain SCENE`: the plan of a scene, as tables or as JSON."""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Mapping
from typing import Any

from clients.outcome import DONE, print_json
from clients.scene_argument import read_scene
from clients.tables import print_table
from synth import explain


def run(arguments: argparse.Namespace) -> int:
    """Carry out the command; raises AskedWrong, CannotRender, OSError."""
    document = explain(read_scene(arguments)).document()
    if arguments.json:
        print_json(document)
    else:
        print_plan(document)
    return DONE


def print_plan(document: Mapping[str, Any]) -> None:
    """Print a plan's document (design: `explain`) for a person to read."""
    _print_items("Simulated, in order", document["simulated"], ("name", "reason"))
    _print_items("Left out", document["left_out"], ("name", "reason", "effect_on_output"))
    print_table("Contact response", ("what", "value"), _pairs(document["response"]))
    print_table("Estimated error, of peak to peak", ("quantity", "error"), _pairs(document["estimated_error"]))
    print_table("Cost", ("what", "value"), _pairs(document["cost"]))
    for warning in document["warnings"]:
        print(f"Warning: {warning}")


def _print_items(title: str, items: list[dict[str, Any]], columns: tuple[str, ...]) -> None:
    """Print one row an item; what an item says beyond `columns` stands in a last column."""
    if not items:
        print(f"{title}: nothing\n")
        return
    more = any(set(item) - set(columns) for item in items)
    rows = []
    for item in items:
        rest = "; ".join(f"{name}: {text}" for name, text in _pairs(item) if name not in columns)
        rows.append([_text(item.get(column)) for column in columns] + ([rest] if more else []))
    print_table(title, [column.replace("_", " ") for column in columns] + (["more"] if more else []), rows)


def _pairs(value: object, name: str = "") -> Iterator[tuple[str, str]]:
    """Yield the leaves of `value` with their dotted names."""
    if isinstance(value, Mapping):
        for key, inner in value.items():
            yield from _pairs(inner, f"{name}.{key}" if name else str(key))
    elif isinstance(value, list) and any(isinstance(inner, Mapping) for inner in value):
        for index, inner in enumerate(value):
            yield from _pairs(inner, f"{name}[{index}]")
    else:
        yield name, _text(value)


def _text(value: object) -> str:
    if value is None:
        return "-"
    if isinstance(value, float):
        return f"{value:.4g}"
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)
