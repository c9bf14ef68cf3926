"""The example scenes: each can be rendered, and docs/examples/README.md has the source of every value."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from synth import open_voice
from synth.scene.merge import merge_patch
from synth.scene.quantity import Dimension, parse_quantity
from synth.scene.scene import Scene, parse_scene, parse_scene_text, scene_document
from synth.scene.text import object_from_text
from synth.scene.texture_registry import kinds
from synth.surfaces import profile_of
from synth.surfaces.height_field import HeightField
from tests.few import thorough

EXAMPLES = Path(__file__).resolve().parents[3] / "docs" / "examples"
FILES = sorted(EXAMPLES.glob("*.json"))
SMALL = {"finger": {"contact_length": "2.5 mm"}, "accuracy": {"tolerance": 0.03}}
"""A finger over an area takes a thirtieth of the time."""
TRUST = {"read", "computed", "usual", "chosen"}

each_file = pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)


def example(name: str) -> Scene:
    return parse_scene_text((EXAMPLES / f"{name}.json").read_bytes())


def rows_of(name: str) -> dict[str, tuple[str, str, str]]:
    """Return field -> (value, source, trust) of the table under the heading `name` in the README."""
    text = (EXAMPLES / "README.md").read_text(encoding="utf-8")
    part = re.search(rf"^## {re.escape(name)}$(.*?)(?=^## |\Z)", text, re.DOTALL | re.MULTILINE)
    assert part is not None, f"README.md has no heading for {name}"
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in part[1].splitlines() if line[:1] == "|"]
    assert cells[0] == ["field", "value", "source", "trust"]
    return {field: (value, source, trust) for field, value, source, trust in cells[2:]}


def leaves(value: Any, above: str = "") -> dict[str, str]:
    """Return dotted field -> the value as the README writes it."""
    if isinstance(value, dict):
        found: dict[str, str] = {}
        for name, item in value.items():
            found |= leaves(item, f"{above}.{name}" if above else name)
        return found
    if above == "scan.trajectory":
        return {above: f"{len(value)} points"}
    if value and isinstance(value, list) and isinstance(value[0], list):
        return {above: "; ".join(", ".join(row) for row in value)}
    return {above: ", ".join(value) if isinstance(value, list) else str(value)}


def test_there_are_enough_examples() -> None:
    assert len(FILES) >= 6
    named = re.findall(r"^## (.*\.json)$", (EXAMPLES / "README.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert sorted(named) == [path.name for path in FILES]


@each_file
def test_an_example_is_a_scene_that_reads_back(path: Path) -> None:
    scene = parse_scene_text(path.read_bytes())
    assert parse_scene(scene_document(scene)) == scene


@each_file
@pytest.mark.parametrize("changes", [SMALL, thorough({})], ids=["small over an area", "as it is"])
def test_an_example_renders(path: Path, changes: dict[str, Any]) -> None:
    document = object_from_text(path.read_bytes())
    if isinstance(profile_of(parse_scene(document)), HeightField):
        document = merge_patch(document, changes)
    values = open_voice(parse_scene(document)).render(2400)
    assert np.all(np.isfinite(values))
    assert np.ptp(values) > 0.0


def test_every_kind_of_texture_has_an_example() -> None:
    assert {parse_scene_text(path.read_bytes()).texture.kind for path in FILES} == set(kinds())


@each_file
def test_the_readme_has_a_line_for_every_value_with_its_source_and_trust(path: Path) -> None:
    rows = rows_of(path.name)
    assert {field: value for field, (value, _, _) in rows.items()} == leaves(object_from_text(path.read_bytes()))
    for field, (_, source, trust) in rows.items():
        assert trust in TRUST, field
        assert source or trust == "chosen", f"{field} has no source and does not say that it was chosen"


def test_the_finger_of_the_paper_has_the_measured_modulus_of_skin() -> None:
    scene = example("paper-finger")
    assert (scene.finger.youngs_modulus, scene.finger.poisson_ratio) == (101200.0, 0.5)
    assert scene.texture.phase == math.sqrt(2.0)
    assert scene.texture.youngs_modulus is None


def test_the_laboratory_gratings_differ_in_speed_alone() -> None:
    speeds = {"40 mm/s": 40, "80 mm/s": 80, "120 mm/s": 120}
    scenes = {text: example(f"lab-grating-{number}mm-s") for text, number in speeds.items()}
    assert {text: scene.scan.speed for text, scene in scenes.items()} == {
        text: parse_quantity(text, Dimension.SPEED) for text in speeds
    }
    documents = [scene_document(scene) for scene in scenes.values()]
    for document in documents:
        del document["scan"]["speed"]
    assert documents[0] == documents[1] == documents[2]


def test_the_light_and_the_heavy_touch_are_the_ends_of_the_useful_loads() -> None:
    assert (example("feather-light").scan.load, example("heavy-touch").scan.load) == (0.05, 1.8)


def test_the_recorded_style_stroke_is_the_curve_that_the_readme_gives() -> None:
    scan = example("recorded-style-stroke").scan
    assert scan.trajectory is not None

    def smooth(x: float) -> float:
        kept = min(max(x, 0.0), 1.0)
        return kept * kept * (3.0 - 2.0 * kept)

    for t, position, load in scan.trajectory:
        s = min(max((t - 0.15) / 1.3, 0.0), 1.0)
        assert position == pytest.approx(0.15 * (10 * s**3 - 15 * s**4 + 6 * s**5), abs=0.51e-6)
        touch = smooth(t / 0.15) * smooth((1.6 - t) / 0.15)
        assert load == pytest.approx(0.5 * touch * (1.0 + 0.1 * math.sin(2.0 * math.pi * 2.0 * t)), abs=0.51e-4)
    assert scan.trajectory[0][2] == scan.trajectory[-1][2] == 0.0
    assert 0.106 <= scan.speed <= 0.228
