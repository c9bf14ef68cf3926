"""docs/promises.md names tests that exist, and has a section for every page that promises something."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

DOCS = Path(__file__).resolve().parent.parent / "docs"
PAGE = (DOCS / "promises.md").read_text(encoding="utf-8")
ROWS = re.findall(r"^\| (?!promise|---)(.+?) \| (.+?) \|$", PAGE, re.MULTILINE)
WITHOUT_PROMISES = {"benchmarks.md", "design.md", "glossary.md", "promises.md"}  # what machines, developers, words are


def test_every_row_names_tests_that_exist(repository: Path) -> None:
    assert len(ROWS) > 100
    for promise, shown_by in ROWS:
        for group in shown_by.split("; "):
            path, names = group.split(": ")
            source = (repository / path.strip("`")).read_text(encoding="utf-8")
            for name in re.findall(r"`(test_\w+)`", names):
                assert re.search(rf"^(async )?def {name}\(", source, re.MULTILINE), (promise, path, name)


@pytest.mark.parametrize("page", sorted({page.name for page in DOCS.glob("*.md")} - WITHOUT_PROMISES))
def test_every_page_has_its_section(page: str) -> None:
    assert f"]({page})" in PAGE
