"""docs/accuracy.md cannot drift: its commands parse and make the figures above them, its tables have every field."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

import pytest

from clients.accuracy_report.printed_table import COLUMNS
from clients.command_line.parser import parse
from clients.command_line.scene_argument import read_scene
from synth.contact.geometry import Geometry
from synth.contact.load_balance import full_contact
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
    assert len(FIGURES) == 6


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


def errors(name: str) -> dict[str, float]:
    """Return method -> largest error of a figure."""
    kept = json.loads((ROOT / "docs" / "figures" / name / "accuracy.json").read_text("utf-8"))
    return {row["method"]: row["max_error"] for row in kept["methods"]}


def test_the_claims_about_the_default_scene_are_those_of_its_numbers() -> None:
    kept = json.loads((ROOT / "docs" / "figures" / "accuracy-default" / "accuracy.json").read_text("utf-8"))
    rows = {row["method"]: row for row in kept["methods"]}
    found = errors("accuracy-default")
    assert found["exact solver, oversampling 1"] == pytest.approx(0.05, rel=0.1)
    assert found["exact solver, oversampling 8"] <= 1e-3 < found["exact solver, oversampling 4"]
    slow, quick = rows["trapezoid and brentq, 800 points a ridge, oversampling 4"], rows["exact solver, oversampling 4"]
    assert slow["max_error"] == pytest.approx(0.01, rel=0.5)
    assert 100.0 < slow["seconds_per_second"] / quick["seconds_per_second"] < 1000.0
    tabled = rows["trapezoid and brentq, 1600 points a ridge, tabled, 4096 phases"]
    assert tabled["max_error"] == pytest.approx(3e-3, rel=0.2) and 1.0 < tabled["setup_seconds"] < 20.0
    assert found["sum of harmonics, 2048 phases"] <= 1e-3 < found["sum of harmonics, 1024 phases"]
    assert rows["sum of harmonics, 2048 phases"]["setup_seconds"] == pytest.approx(0.01, rel=1.0)
    assert found["sum of harmonics, 65536 phases"] <= 2e-7
    assert kept["chosen"] == "sum of harmonics, 4096 phases" and 1.0 < kept["process_seconds"] < 2.5
    assert found["response table, to a 2000th"] > 0.5


def test_the_claims_about_the_other_scenes_are_those_of_their_numbers() -> None:
    locked, light, full = (errors(f"accuracy-{name}") for name in ("locked", "light", "full-contact"))
    assert locked["sum of harmonics, 32 phases"] <= 1e-3 and locked["sum of harmonics, 64 phases"] <= 4e-8
    assert light["sum of harmonics, 512 phases"] == pytest.approx(0.06, rel=0.1)
    assert errors("accuracy-default")["sum of harmonics, 512 phases"] == pytest.approx(0.04, rel=0.1)
    assert "sum of harmonics, 8192 phases" in light
    assert max(full["sum of harmonics, 8 phases"], full["exact solver, oversampling 1"]) <= 3e-8
    assert full["trapezoid and brentq, 50 points a ridge, oversampling 1"] <= 1e-3


def test_the_claims_about_the_stroke_are_those_of_its_numbers() -> None:
    kept = json.loads((ROOT / "docs" / "figures" / "accuracy-stroke" / "accuracy.json").read_text("utf-8"))
    rows = {row["method"]: row for row in kept["methods"]}
    solved = "solved along the motion, {} steps a second"
    assert rows[solved.format(3000)]["max_error"] == pytest.approx(5e-3, rel=0.2)
    assert rows[solved.format(12000)]["max_error"] == pytest.approx(1e-4, rel=0.3)
    assert rows[solved.format(12000)]["seconds_per_second"] == pytest.approx(0.7, rel=0.3)
    few = rows["series read along the motion, 256 phases"]
    assert few["max_error"] == pytest.approx(2e-4, rel=0.2) and few["seconds_per_second"] == pytest.approx(
        2e-3, rel=0.3
    )
    assert rows[kept["chosen"]]["setup_seconds"] > 1.0 and int(kept["chosen"].split()[-2]) >= 4096
    (points,) = (row for name, row in rows.items() if "8 points a ridge" in name)
    assert points["max_error"] == pytest.approx(0.25, rel=0.2)
    assert points["seconds_per_second"] == pytest.approx(20.0, rel=0.3)


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
