"""Facts of the literature beside the output, and the page that lists them."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.fidelity import levels, prints
from tests.fidelity.facts import FACTS, FINGERS, Fact
from tests.fidelity.friction import FRICTION_FACTS, FrictionFact
from tests.fidelity.skin import SKIN_FACTS, table

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "fidelity.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", FINGERS)
@pytest.mark.parametrize("fact", FACTS, ids=lambda fact: fact.name[:60])
def test_the_model_agrees_with_a_fact_where_the_page_says_so(fact: Fact, name: str) -> None:
    told, agrees = fact.answer(name)
    verdict = "pass" if name in fact.agrees else "fail"
    assert agrees == (name in fact.agrees), told
    (row,) = [line for line in PAGE.splitlines() if line.startswith(f"| {fact.name} | {fact.source} |")]
    cell = row.split(" | ")[2 + list(FINGERS).index(name)].strip("| ")
    assert cell.endswith(f"**{verdict}**")


def test_the_levels_of_the_page_are_what_the_command_prints() -> None:
    for row in levels.table():
        assert row in PAGE


@pytest.mark.parametrize("name", FINGERS)
@pytest.mark.parametrize("fact", SKIN_FACTS[1:4], ids=lambda fact: fact.name)
def test_the_skin_feels_what_the_page_says(fact: Fact, name: str) -> None:
    told, agrees = fact.answer(name)
    (row,) = [line for line in PAGE.splitlines() if line.startswith(f"| {fact.name} | {fact.source} |")]
    assert agrees == (name in fact.agrees), told
    assert f"{told}: **{'pass' if agrees else 'fail'}**" in row


@pytest.mark.parametrize("fact", FRICTION_FACTS, ids=lambda fact: fact.name)
def test_friction_is_what_the_page_says(fact: FrictionFact) -> None:
    told, agrees = fact.answer()
    assert agrees == fact.agrees, told
    assert f"| {fact.name} | {fact.source} | {told}: **{'pass' if agrees else 'fail'}** |" in PAGE


@pytest.mark.thorough
def test_what_the_skin_feels_is_what_the_command_prints() -> None:
    for row in table():
        assert row in PAGE


@pytest.mark.thorough
def test_the_default_print_of_the_page_is_what_the_command_prints() -> None:
    assert prints.row({}) in PAGE


@pytest.mark.thorough
def test_the_steps_of_the_period_on_the_page_are_what_the_command_prints() -> None:
    for row in prints.steps():
        assert row in PAGE
