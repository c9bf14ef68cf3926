"""The tables of docs/catalogue.md, from the catalogue itself: `python -m docs.figures.catalogue`.

The page has them after the line MARK. A test makes them again and compares.
"""

from __future__ import annotations

from itertools import groupby
from pathlib import Path

from synth.scene.catalogue import TRUST, CatalogueEntry, catalogue

PAGE = Path(__file__).resolve().parent.parent / "catalogue.md"
MARK = "<!-- from here on made by: python -m docs.figures.catalogue -->\n"
LETTERS = {"read": "r", "computed": "c", "usual": "u", "unverified default": "d"}
HEAD = "| name | what it is | numbers | everyday scan |\n| --- | --- | --- | --- |\n"


def tables() -> str:
    """Return the tables, a group after the other, and the sources that were read."""
    made = []
    for group, entries in groupby(catalogue(), lambda entry: entry.group):
        made.append(f"\n## {group}\n\n{HEAD}" + "".join(map(row, entries)))
    return "".join(made) + "\n## Sources\n\n" + "".join(f"- {source}\n" for source in sources())


def row(entry: CatalogueEntry) -> str:
    """Return the line of an entry."""
    texture, scan = entry.everyday["texture"], entry.everyday["scan"]
    fields = {name: value for name, value in texture.items() if name != "kind"}
    numbers = f"{texture['kind']}: {numbers_of(entry, 'texture', fields)}"
    for name, effect in entry.everyday.get("effects", {}).items():
        numbers += f"; {name}: {numbers_of(entry, f'effects.{name}', effect)}"
    what = f"{entry.title}. {entry.note}".strip() if entry.note else entry.title
    return f"| `{entry.name}` | {what} | {numbers} | {scan['speed']}, {scan['load']} |\n"


def numbers_of(entry: CatalogueEntry, section: str, fields: dict[str, object]) -> str:
    """Return the fields of a section with the letter of their trust."""
    letters = {name: LETTERS[trust_of(entry.sources[f"{section}.{name}"])] for name in fields}
    return ", ".join(f"{name} {shown(value)} ({letters[name]})" for name, value in fields.items())


def shown(value: object) -> str:
    """Return a value as a scene writes it; the items of a list with spaces between them."""
    return " ".join(map(str, value)) if isinstance(value, list) else str(value)


def trust_of(source: str) -> str:
    """Return the word of TRUST with which `source` begins."""
    return next(word for word in TRUST if source.split(":")[0] == word)


def sources() -> list[str]:
    """Return every source that was read, once, in alphabetical order."""
    texts = {source for entry in catalogue() for source in entry.sources.values()}
    return sorted(text.removeprefix("read: ") for text in texts if text.startswith("read: "))


def main() -> None:
    """Write the tables into the page."""
    words = PAGE.read_text("utf-8").partition(MARK)[0]
    PAGE.write_text(words + MARK + tables(), "utf-8")


if __name__ == "__main__":
    main()
