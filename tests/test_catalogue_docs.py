"""docs/catalogue.md cannot drift: its tables are those of the catalogue, and its words on trust are the catalogue's."""

from __future__ import annotations

from docs.figures import area_statistics
from docs.figures.catalogue import LETTERS, MARK, PAGE, tables
from synth.scene.catalogue import TRUST


def test_the_tables_are_those_of_the_catalogue() -> None:
    made = PAGE.read_text("utf-8").partition(MARK)[2]
    assert made == tables(), "run python -m docs.figures.catalogue"


def test_the_statistics_are_those_of_the_areas() -> None:
    page = PAGE.read_text("utf-8").partition(area_statistics.BEGIN)[2]
    made = page.partition(area_statistics.END)[0]
    assert made == area_statistics.table(), "run python -m docs.figures.area_statistics"


def test_the_page_explains_every_letter() -> None:
    page = PAGE.read_text("utf-8")
    assert set(LETTERS) == set(TRUST)
    assert all(f"| {letter} | {word} | {TRUST[word]} |" in page for word, letter in LETTERS.items())


def test_the_entry_of_the_page_is_one_of_the_catalogue() -> None:
    shown = PAGE.read_text("utf-8").partition("```toml\n")[2].partition("```")[0]
    assert shown in (PAGE.parent.parent / "synth/scene/textures/textiles.toml").read_text("utf-8")
