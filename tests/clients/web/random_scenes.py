"""Scenes drawn from the JSON Schema of a scene, and what the schema has: for tests of the form and of links.

Limits: a drawn scene fits the schema, not what the schema cannot say (a stroke that has no room for its turns).
"""

from __future__ import annotations

import math
import random
from collections.abc import Iterator, Mapping
from typing import Any

from synth.scene.scene import scene_schema

Document = dict[str, Any]
Field = tuple[str, ...]


def options(node: Mapping[str, Any]) -> list[Document]:
    """Return what a node of the schema may be."""
    return list(node.get("anyOf", [node]))


def fields(node: Mapping[str, Any] | None = None, path: Field = ()) -> Iterator[tuple[Field, Mapping[str, Any]]]:
    """Yield each field of the schema below the sections, with its path; what lists hold has none."""
    for option in options(scene_schema() if node is None else node):
        for name, part in option.get("properties", {}).items():
            if path:
                yield (*path, name), part
            yield from fields(part, (*path, name))


def near_default(node: Mapping[str, Any]) -> float | None:
    """Return a number that the field takes beside the defaults of all others; None where it takes no number."""
    number = next((option for option in options(node) if option.get("type") in ("number", "integer")), None)
    if number is None:
        return None
    low, high, default = number["minimum"], number["maximum"], node["default"]
    if isinstance(default, int | float) and default:
        return round(default * 0.9) if number["type"] == "integer" else float(f"{default * 0.9:.3g}")
    return float(f"{math.sqrt(low * high) if low > 0 else high / 1000:.3g}")


DISPLACED = (
    ("roughness", "amplitude"),
    ("roughness", "ridge_amplitude"),
    ("ramp", "edge_radius"),
    ("rms_height", "rms_slope"),
)
"""A field of finger or texture, and the one that it displaces."""


def drawn_scene(draw: random.Random) -> Document:
    """Return a scene with some fields of the schema given, no two of which displace each other."""
    scene: Document = {}
    for name, section in scene_schema()["properties"].items():
        value = _drawn(section, draw)
        if isinstance(value, dict) and value:
            scene[name] = value
    for one, other in DISPLACED:
        for section in ("finger", "texture"):
            if one in scene.get(section, {}):
                scene[section].pop(other, None)
    scan, output = scene.get("scan", {}), scene.get("output", {})
    kept = draw.choice([("speed", "load"), ("stroke",), ("trajectory",)])
    for other in {"speed", "load", "stroke", "trajectory"} - set(kept):
        scan.pop(other, None)
    if "channels" in output:
        output.pop("quantity", None), output.pop("full_scale", None)
    return {name: section for name, section in scene.items() if section}


def _choices(node: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Return the forms of a field that a value is drawn of: neither null nor a text."""
    return [option for option in options(node) if option.get("type") not in ("null", "string")]


def _drawn(node: Mapping[str, Any], draw: random.Random) -> Any:
    option = draw.choice(_choices(node))
    if "enum" in option:
        return draw.choice(option["enum"])
    if "const" in option:
        return option["const"]
    if option["type"] == "object":
        names = [name for name, part in option["properties"].items() if _choices(part) and draw.random() < 0.4]
        return {name: _drawn(option["properties"][name], draw) for name in names}
    if option["type"] == "array":
        if "prefixItems" in option["items"]:
            return [[0.01 * index, 0.001 * index, draw.random()] for index in range(draw.randint(4, 9))]
        return [_drawn(option["items"], draw) for _ in range(draw.randint(1, 3))]
    low, high = option["minimum"], option["maximum"]
    value = low * (high / low) ** draw.random() if low > 0 else draw.uniform(low, high)
    return round(value) if option["type"] == "integer" else value
