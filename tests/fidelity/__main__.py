"""Print a table of docs/fidelity.md: `python -m tests.fidelity [facts, friction, halfspace, levels, prints, ...]`."""

from __future__ import annotations

import argparse
from collections.abc import Iterator

from tests.fidelity import friction, half_space, levels, prints, skin
from tests.fidelity.facts import FACTS, FINGERS


def facts() -> Iterator[str]:
    """Yield one row per fact."""
    yield "| fact | source | comb | fingertip |"
    yield "| --- | --- | --- | --- |"
    for fact in FACTS:
        cells = []
        for name in FINGERS:
            told, agrees = fact.answer(name)
            cells.append(f"{told}: **{'pass' if agrees else 'fail'}**")
        yield f"| {fact.name} | {fact.source} | {' | '.join(cells)} |"


TABLES = {
    "facts": facts,
    "friction": friction.table,
    "halfspace": half_space.table,
    "levels": levels.table,
    "prints": prints.table,
    "skin": skin.table,
    "steps": prints.steps,
}


def main() -> None:
    """Print the table that the command names, row by row."""
    parser = argparse.ArgumentParser(prog="python -m tests.fidelity", description="print a table of docs/fidelity.md")
    parser.add_argument("table", nargs="?", choices=TABLES, default="facts")
    for line in TABLES[parser.parse_args().table]():
        print(line, flush=True)


if __name__ == "__main__":
    main()
