"""Print the table of docs/fidelity.md: `python -m tests.fidelity`."""

from __future__ import annotations

from tests.fidelity.facts import FACTS, FINGERS


def main() -> None:
    """Print a row a fact."""
    print("| fact | source | comb | fingertip |\n| --- | --- | --- | --- |")
    for fact in FACTS:
        cells = []
        for name in FINGERS:
            told, agrees = fact.answer(name)
            cells.append(f"{told}: **{'pass' if agrees else 'fail'}**")
        print(f"| {fact.name} | {fact.source} | {' | '.join(cells)} |")


if __name__ == "__main__":
    main()
