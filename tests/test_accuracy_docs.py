"""docs/accuracy.md cannot drift: its commands parse and make the figures above them, its tables have every field."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

import pytest

from clients.accuracy_command import COLUMNS
from clients.parser import parse
from clients.scene_argument import read_scene
from synth.contact.full_contact import full_contact
from synth.contact.geometry import Geometry
from synth.contact.stiffness import Stiffness
from synth.scene.scene import Scene, parse_scene, scene_document
from tests.accuracy_case import document
from tests.readme_blocks import code_blocks

ROOT = Path(__file__).resolve().parents[1]
PAGE = (ROOT / "docs" / "accuracy.md").read_text("utf-8")
FIGURES = sorted(path.name for path in (ROOT / "docs" / "figures").glob("accuracy-*"))


def commands() -> dict[str, Scene]:
    """Return folder -> scene of every command of the pages that draws a figure."""
    found: dict[str, Scene] = {}
    for page in (PAGE, (ROOT / "README.md").read_text("utf-8")):
        for block in code_blocks(page):
            for line in block.text.splitlines():
                if line.startswith("ridgewave accuracy "):
                    arguments = parse(shlex.split(line)[1:])
                    scene = read_scene(arguments)
                    if arguments.output is not None:
                        assert found.setdefault(arguments.output, scene) == scene
    return found


def scene_of(name: str) -> Scene:
    return commands()[f"docs/figures/{name}"]


def rows(first: str) -> list[list[str]]:
    """Return the cells of the table whose first line is `first`."""
    lines = PAGE.partition(f"{first}\n")[2].partition("\n\n")[0].splitlines()[1:]
    return [[cell.strip() for cell in line.strip("|").split(" | ")] for line in lines]


@pytest.fixture(autouse=True)
def _in_the_checkout(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)


def test_every_figure_has_its_command_and_every_command_its_figure() -> None:
    assert sorted(commands()) == [f"docs/figures/{name}" for name in FIGURES]
    assert len(FIGURES) == 4


@pytest.mark.parametrize("name", FIGURES)
def test_a_figure_stands_above_the_command_that_made_it(name: str) -> None:
    shown = PAGE.index(f"](figures/{name}/accuracy.svg)")
    made = PAGE.index(f"-o docs/figures/{name}\n")
    assert shown < made and "![" not in PAGE[shown:made]


@pytest.mark.parametrize("name", FIGURES)
def test_the_numbers_of_a_figure_are_of_the_commands_scene(name: str) -> None:
    folder = ROOT / "docs" / "figures" / name
    kept = json.loads((folder / "accuracy.json").read_text("utf-8"))
    assert kept["scene"] == json.loads(json.dumps(scene_document(scene_of(name))))
    assert kept.keys() == document().keys()
    assert f"What accuracy costs: {kept['quantity']}" in (folder / "accuracy.svg").read_text("utf-8")


def test_the_scenes_are_what_the_page_calls_them() -> None:
    default, locked = scene_of("accuracy-default"), scene_of("accuracy-locked")
    assert default == parse_scene({"output": {"bandwidth": "full"}})
    assert locked.texture.period == locked.finger.ridge_period
    assert scene_of("accuracy-light").scan.load == 0.001
    full = scene_of("accuracy-full-contact")
    for scene, is_full in ((default, False), (full, True)):
        closed = full_contact(Geometry.of_scene(scene), Stiffness.of_scene(scene), scene.scan.load)
        assert (closed is not None) is is_full


def test_every_field_of_the_document_has_its_line() -> None:
    assert [row[0].strip("`") for row in rows("| field | meaning |")] == list(document())


def test_every_field_of_a_method_has_its_line_and_its_column() -> None:
    found = rows("| field | column | meaning |")
    assert [row[0].strip("`") for row in found] == list(document()["methods"][0])
    named = {row[1] for row in found}
    assert {" ".join(column.split()) for column in COLUMNS if column} <= named


def test_the_claims_about_the_default_scene_are_those_of_its_numbers() -> None:
    kept = json.loads((ROOT / "docs" / "figures" / "accuracy-default" / "accuracy.json").read_text("utf-8"))
    rows = {row["method"]: row for row in kept["methods"]}
    solved = {
        tuple(map(int, re.findall(r"\d+", name))): row
        for name, row in rows.items()
        if row["family"] == "baseline" and "tabled" not in name
    }
    told = PAGE[PAGE.index("### The default scene") : PAGE.index("### Locked")].replace("\n", " ")
    assert solved[1600, 1]["max_error"] == pytest.approx(0.05, rel=0.05)
    times = solved[1600, 1]["seconds_per_second"] / rows["exact solver, oversampling 1"]["seconds_per_second"]
    (claimed,) = (int(number) for number in re.findall(r"(\d+) times less", told))
    assert times == pytest.approx(claimed, rel=0.1)
    points, count = min(
        (size for size, row in solved.items() if row["max_error"] <= 1e-3),
        key=lambda size: solved[size]["seconds_per_second"],
    )
    assert f"{points} points a ridge and {count} solutions a frame" in told
    tabled = rows[f"trapezoid and brentq, {points} points a ridge, tabled, 4096 phases"]
    assert tabled["max_error"] <= 1e-3
    assert f"pays {tabled['setup_seconds']:.0f} s for 1e-3" in told
    assert f"once more, {kept['process_seconds']:.1f} s" in told


def test_the_readme_shows_the_first_figure_and_its_command() -> None:
    readme = (ROOT / "README.md").read_text("utf-8")
    section = re.search(r"^## What accuracy costs$(.*?)^## ", readme, re.M | re.S)
    assert section is not None
    assert "(docs/figures/accuracy-default/accuracy.svg)" in section[1]
    assert (
        "ridgewave accuracy grating-800um-40um --set output.bandwidth=full -o docs/figures/accuracy-default"
        in section[1]
    )
    assert "(docs/accuracy.md)" in section[1]
