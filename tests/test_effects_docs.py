"""docs/effects.md cannot drift: settings, examples, figures, costs and the new effect of its end are those of the code.

Also: every effect has a pair of sounds to listen to.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from synth.scene.effects_section import declaration, effect_names
from synth.scene.scene import parse_scene
from synth.scene.section import plain, rule_of
from tests.listen.cases import CASES, PAIRS
from tests.readme_blocks import code_blocks

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
PAGE = (DOCS / "effects.md").read_text("utf-8")
BENCHMARKS = (DOCS / "benchmarks.md").read_text("utf-8")
SETTINGS = [(name, field) for name in effect_names() for field in declaration(name).settings.model_fields]


def section(title: str) -> str:
    """Return the part of the page under a heading."""
    return PAGE.partition(f"\n## {title}\n")[2].partition("\n## ")[0]


def rows() -> dict[str, list[str]]:
    """Return field -> [meaning, unit, default, range, source] of every table of settings on the page."""
    found: dict[str, list[str]] = {}
    for line in PAGE.splitlines():
        named = re.match(r"\| `effects\.([a-z_.]+)` \|", line)
        if named:
            assert named[1] not in found, f"{named[1]} has two lines"
            found[named[1]] = [cell.strip() for cell in line.strip().strip("|").split("|")[1:]]
    return found


@pytest.mark.parametrize(("name", "field"), SETTINGS)
def test_a_setting_has_a_line_with_its_unit_default_range_and_source(name: str, field: str) -> None:
    settings = declaration(name).settings
    rule, default = rule_of(settings, field), plain(settings.model_fields[field].default)
    meaning, unit, shown, allowed, source = rows()[f"{name}.{field}"]
    assert meaning and source
    shown_default = "null" if default is None else default if isinstance(default, str) else rule.show(default)
    assert (unit, shown, allowed) == (rule.unit, shown_default, rule.allowed)
    unverified = "unverified default" in (settings.model_fields[field].description or "")
    assert unverified == source.startswith("unverified default")


def test_the_page_has_no_line_for_a_setting_that_does_not_exist() -> None:
    assert set(rows()) == {f"{name}.{field}" for name, field in SETTINGS}


@pytest.mark.parametrize("name", effect_names())
def test_an_effect_has_a_section_with_an_example_its_figure_the_command_and_its_limits(name: str) -> None:
    text = section(name)
    examples = [json.loads(block.text) for block in code_blocks(text) if block.language == "json"]
    assert len(examples) == 1 and name in parse_scene(examples[0]).effects
    shown = text.index(f"](figures/effect-{name}.svg)")
    assert text.index("python -m docs.figures.effects\n") > shown
    assert "\nLimits: " in text and "How far to trust it:" in " ".join(text.split())
    assert all((DOCS / "figures" / f"effect-{name}.{kind}").exists() for kind in ("svg", "png"))


def test_the_scene_page_names_every_effect() -> None:
    section = (DOCS / "scene.md").read_text("utf-8").partition("\n## effects\n")[2].partition("\n## ")[0]
    assert re.findall(r'^\| "([a-z_]+)" \|', section, re.M) == list(effect_names())


@pytest.mark.parametrize("block", [block for block in code_blocks(PAGE) if block.language == "json"])
def test_every_block_of_json_is_a_scene(block: Any) -> None:
    parse_scene(json.loads(block.text))


def test_what_the_page_says_is_refused_together_is_what_replaces_the_same_thing() -> None:
    lines = re.finditer(r"^\| (the [a-z ]+) \| `(\w+)` and `(\w+)` \|", PAGE, re.M)
    told = {line[1]: {line[2], line[3]} for line in lines}
    replaced: dict[str, set[str]] = {}
    for name in effect_names():
        replaced.setdefault(declaration(name).replaces, set()).add(name)
    assert told == {thing: names for thing, names in replaced.items() if thing and len(names) > 1}


def measured() -> dict[str, list[float]]:
    """Return title -> ns a frame in blocks of 480 and of 16384, kB, ms of set-up, as docs/benchmarks.md has them."""
    lines: dict[str, list[float]] = {}
    for line in BENCHMARKS.splitlines():
        found = re.match(r"(\w+, alone|all, \w+ \+ \w+) +([\d.]+) +[\d.]+ (?:ns/frame|kB|ms) ", line)
        if found:
            lines.setdefault(found[1], []).append(float(found[2]))
    return lines


def rounded(number: float) -> str:
    """Return a number with two digits, as people write it."""
    return f"{float(f'{number:.2g}'):g}"


def test_the_table_of_costs_is_what_was_measured() -> None:
    found = re.findall(r"^\| `?([a-z_+` ]+?)`? \| ([\d.]+) \| ([\d.]+) \| ([\d.]+) kB \| ([\d.]+) ms \|", PAGE, re.M)
    wanted = []
    for title, (live, _file, memory, setup) in measured().items():
        name = title.removesuffix(", alone").removeprefix("all, ").replace(" + ", "` + `")
        wanted.append((name, rounded(live), rounded(1e9 / 48000 / live), rounded(memory), rounded(setup)))
    assert found == wanted
    assert [row[0] for row in found[: len(effect_names())]] == list(effect_names())


@pytest.mark.parametrize("name", effect_names())
def test_a_price_is_what_was_measured_once(name: str) -> None:
    live, _file, memory, _setup = measured()[f"{name}, alone"]
    price: Any = declaration(name)
    assert rounded(price.price.ns_per_frame) == rounded(live)
    assert rounded(price.price.memory_bytes) == rounded(1e3 * memory)


@pytest.mark.parametrize("name", effect_names())
def test_an_effect_has_a_pair_of_sounds_of_one_full_scale(name: str) -> None:
    (pair,) = [pair for pair in PAIRS if pair.effect == name]
    before, after = (parse_scene(case.scene) for case in pair.cases())
    assert not before.effects and set(after.effects) == {name}
    assert before == after.model_copy(update={"effects": before.effects})
    assert before.output.full_scale is not None
    assert {f"{name}-before", f"{name}-after"} <= {case.name for case in CASES}


def test_a_figure_is_drawn_as_it_is_shown(tmp_path: Path) -> None:
    """Twice the same bytes; and, but for ids and what another matplotlib rounds otherwise, the figure of the page."""
    matplotlib = pytest.importorskip("matplotlib", reason="figures need the extra `plots`: pip install '.[plots]'")
    from clients.figure_look import LOOK, saved
    from docs.figures.effects import FIGURES

    assert set(FIGURES) == set(effect_names())
    for name in ("first", "second"):
        with matplotlib.rc_context(LOOK):
            saved(FIGURES["tangential"](), tmp_path, name)
    first, second = ((tmp_path / f"{name}.svg").read_bytes() for name in ("first", "second"))
    assert first == second
    shown = (DOCS / "figures" / "effect-tangential.svg").read_text("utf-8")
    assert curves_of(first.decode()) == pytest.approx(curves_of(shown), abs=0.05)


def curves_of(svg: str) -> list[float]:
    """Return the places (points) along the longest paths of a figure, those of its curves."""
    paths = sorted(re.findall(r'<path d="([^"]*)" clip-path', svg), key=len)[-3:]
    return [float(number) for path in paths for number in re.findall(r"-?\d+\.?\d*", path)]


NEW_EFFECT = """
import sys
import synth.effects
synth.effects.__path__.append(sys.argv[1])
from synth import explain, open_voice, parse_scene
from synth.scene.effects_section import effect_names
from synth.errors import SceneError
from synth.scene.scene import scene_schema

quick = {"output": {"quantity": "displacement", "sample_rate": 8000}, "accuracy": {"tolerance": 1e-2}}
assert "damper" in effect_names()
assert "damper" in str(scene_schema())
plain, damped = (open_voice(parse_scene(quick | {"effects": chosen})) for chosen in ({}, {"damper": {"damping": 200}}))
assert damped.render(800).std() * damped.full_scale[0] < 0.9 * plain.render(800).std() * plain.full_scale[0]
(part,) = [part for part in damped.plan.document()["simulated"] if part["name"] == "damper"]
assert part["settings"] == {"damping": 200.0}
assert part["reason"] == "The hand damps the finger by 200 N s/m."
assert part["price"] == {"ns_per_frame": 330.0, "memory_bytes": 6_000_000}
open_voice(parse_scene(quick | {"effects": {"damper": "auto", "tangential": {}, "contact_growth": {}}})).render(10)
try:
    parse_scene({"effects": {"damper": {}, "inertia": {}}})
except SceneError as error:
    assert "the mass of the finger" in str(error)
else:
    raise AssertionError("damper and inertia replace the same thing")
"""


def test_the_registry_takes_the_pages_new_effect_without_a_change_elsewhere(tmp_path: Path) -> None:
    (block,) = [block for block in code_blocks(PAGE) if block.mark == "the example"]
    (tmp_path / "damper.py").write_text(block.text, "utf-8")
    command = [sys.executable, "-c", NEW_EFFECT, str(tmp_path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
