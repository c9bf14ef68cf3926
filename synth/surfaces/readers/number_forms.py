"""How the numbers of a text file are written: separator, decimal sign, quotes, groups of thousands, missing points.

Stage   SURFACES, from files.
Model   Every form is tried on the first lines: five separators times two decimal signs. A form fits if each cell is a
        number or a missing point and the lines have the same number of cells. If forms that fit differ in the numbers,
        tabs, semicolons and bars go before commas and spaces; then a comma separates if numbers have points, if a space
        follows it, or if the names above the numbers are separated by commas. Else the file is refused.
        A number may have quotes, a sign, an exponent with E or D, and groups of three digits that are separated by the
        other mark, an apostrophe or a narrow space.
Limits  A group of thousands that could be a decimal number, as in 1,234 beside tabs, is refused.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NoReturn

from synth.surfaces.readers.surface_file import refuse_file

SEPARATORS = {"\t": "tabs", ";": "semicolons", "|": "bars", ",": "commas", " ": "spaces"}
STRONG = ("\t", ";", "|")  # signs that are in no number
COMMENT = re.compile(r"\s*(?:#|%|//|!|[;'][^\W\d_]{2})")
FOOTER = re.compile(r"(?i)\x1a|[\W_]*(?:end|eof|eod|eor)\b[^0-9]*")  # \x1a ended the files of MS-DOS
NO_HEIGHT = re.compile(
    r"(?i:nan(?:\([^)]*\))?|bad|[+-]?inf(?:inity)?|n\.?/?a\.?|null|none|void|invalid|missing|masked|no ?data"
    r"|#(?:n/a|div/0|value|num|null|nv|wert|ref)!?|[+-]?1\.#(?:qnan|snan|ind|inf)0*)|-+|\*+|\?+"
)
_EXPONENT = r"(?:[eEdD][+-]?[0-9]{1,4})?"
PLAIN = {
    ".": re.compile(rf"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+){_EXPONENT}"),
    ",": re.compile(rf"[+-]?(?:[0-9]+(?:,[0-9]+)?|,[0-9]+){_EXPONENT}"),
}
_GROUPS = "'\u2019\x92\u00a0\u202f\u2009 "
GROUPED = {
    mark: re.compile(
        rf"[+-]?[1-9][0-9]{{0,2}}(?:(?:\{other}[0-9]{{3}})+\{mark}[0-9]+|(?:\{other}[0-9]{{3}}){{2,}}"
        rf"|(?:[{_GROUPS}][0-9]{{3}})+(?:\{mark}[0-9]+)?)"
    )
    for mark, other in ((".", ","), (",", "."))
}
CUT = re.compile(r"0[0-9]+")  # 05 is the end of 1,05, and no number
COULD_BE_GROUPS = re.compile(r"[+-]?[1-9][0-9]{0,2}(?:[.,][0-9]{3})+")
SIGNS = str.maketrans({"\u2212": "-", "\u2012": "-", "\u2013": "-", "\x96": "-", "\ufeff": None})
"""Signs that stand for a minus; \\x96 and, above, \\x92 are those of Windows 1252, read as Latin-1."""


ONE_NAME = re.compile(r"[^,;|\t\[(]*[\[(][^\])]*[\])]\s*")  # of one column, with its unit


class NotANumber(ValueError):
    """A cell that is no number. Its text is the cell."""


@dataclass(frozen=True, slots=True)
class Form:
    """How the numbers are written.

    separator: a key of SEPARATORS.
    decimal: "." or ",".
    quoted: whether cells may have quotes.
    empty: number of cells at the end of each line that are empty in every line.
    """

    separator: str
    decimal: str
    quoted: bool = False
    empty: int = 0

    def cells(self, line: str) -> list[str]:
        """Return the cells of `line` as they are written, without their quotes."""
        line = line.strip(" \r\n\ufeff")
        if self.quoted:
            cells = next(csv.reader([line], delimiter=self.separator, skipinitialspace=True), [""])
            cells = [cell for cell in cells if cell] if self.separator == " " else cells
        elif self.separator == " ":
            cells = re.split(r"[ \t]+", line)
        else:
            cells = line.split(self.separator)
        if self.empty and not any(cell.strip() for cell in cells[-self.empty :]):
            cells = cells[: -self.empty]
        return [cell.strip() for cell in cells]

    def number(self, cell: str) -> str:
        """Return a cell as Python writes the number; nan for a missing point. Raises NotANumber."""
        cell = cell.strip(" \t'\"=\x1a").translate(SIGNS)
        if not cell or NO_HEIGHT.fullmatch(cell):
            return "nan"
        if PLAIN[self.decimal].fullmatch(cell):
            return cell.replace(",", ".").replace("d", "e").replace("D", "e")
        if GROUPED[self.decimal].fullmatch(cell):
            return re.sub(rf"[^0-9{re.escape(self.decimal)}+-]", "", cell).replace(",", ".")
        raise NotANumber(cell)

    def row(self, line: str) -> list[str]:
        """Return the numbers of `line`. Raises NotANumber."""
        return [self.number(cell) for cell in self.cells(line)]

    @property
    def is_plain(self) -> bool:
        """Whether NumPy can read the lines once commas are points."""
        return not self.quoted and not self.empty

    def says(self, columns: int) -> str:
        """Return how the numbers are written, as the end of a sentence."""
        said = f", separated by {SEPARATORS[self.separator]}" if columns > 1 else ""
        return said + (", with decimal commas" if self.decimal == "," else "")


FORMS = tuple(Form(separator, decimal) for separator in SEPARATORS for decimal in ".,")


def is_numbers(line: str) -> bool:
    """Return whether `line` has numbers only, in one of the forms, and at least one."""
    return any(any(cell != "nan" for cell in row) for _, row in _readings(line))


def is_missing(line: str) -> bool:
    """Return whether `line` has missing points only. Hyphens do not count: they divide header and numbers."""
    return bool(re.fullmatch(r"(?i)nan(?:[\s;,|]+nan)*[;,|]?", line.strip()))


def _readings(line: str) -> Iterator[tuple[Form, list[str]]]:
    """Yield the forms in which `line` has numbers only, with the numbers."""
    for form in FORMS:
        if form.separator != " " and form.separator not in line:
            continue
        if '"' in line:
            form = replace(form, quoted=True)
        elif form.separator == form.decimal:
            continue
        try:
            yield form, form.row(line)
        except (NotANumber, csv.Error):
            continue


def form_of(sample: list[str], header: list[str]) -> Form:
    """Return the form of the first lines of numbers. Raises InvalidRequest if they can be read in two ways.

    header: the lines above them.
    """
    fits: Counter[Form] = Counter()
    tables: dict[Form, list[tuple[str, ...]]] = {}
    any_quotes = any('"' in line for line in sample)
    for line in sample:
        for form, row in _readings(line):
            form = replace(form, quoted=any_quotes)
            tables.setdefault(form, []).append(tuple(row))
            fits[form] += 1
    for form, table in tables.items():  # lines of another length speak against a form
        fits[form] = Counter(map(len, table)).most_common(1)[0][1]
    most = max(fits.values(), default=0)
    if not most:
        refuse_file(f"the line {sample[0].strip()[:60]!r}", "numbers", "Correct the line.")
    found = [form for form in FORMS if fits[replace(form, quoted=any_quotes)] == most]
    found = [replace(form, quoted=any_quotes) for form in found]
    declared = next((line.strip()[4:5] for line in header if line.strip().lower().startswith("sep=")), "")
    found = [form for form in found if form.separator == declared] or found
    found = [form for form in found if form.separator in STRONG] or found
    different = [form for form in found if _values(tables[form]) != _values(tables[found[0]])]
    chosen = _chosen([found[0], *different], sample, header) if different else found[0]
    if chosen.decimal == "," and chosen.separator != " ":
        _check_groups(sample, chosen)
    if chosen.separator == "," and any(CUT.fullmatch(cell) for line in sample for cell in chosen.cells(line)):
        _refuse_commas(sample[0])
    return replace(chosen, empty=_empty(sample, chosen))


def _values(table: list[tuple[str, ...]]) -> list[tuple[float | None, ...]]:
    return [tuple(None if cell == "nan" else float(cell) for cell in row) for row in table]


def _chosen(found: list[Form], sample: list[str], header: list[str]) -> Form:
    """Return which of the forms that fit is meant."""
    by_comma = [form for form in found if form.separator == ","]
    others = [form for form in found if form.separator != ","]
    text = "\n".join(sample)
    if by_comma and others:
        columns = len(by_comma[0].cells(sample[0]))
        names = header[-1] if header and not header[-1].lower().startswith("sep=") else ""
        if "." in text or re.search(r",[ ]", text) or (names and columns == names.count(",") + 1):
            return by_comma[0]
        if ONE_NAME.fullmatch(names):
            return others[0]
    _refuse_commas(sample[0])


def _refuse_commas(line: str) -> NoReturn:
    refuse_file(
        f"lines such as {line.strip()[:40]!r}, with a comma for the point or between two columns",
        "numbers that can be read in one way",
        "Write 1.5 with a point, or 1;5 for two columns.",
    )


def _check_groups(sample: list[str], form: Form) -> None:
    """Refuse numbers such as 1,234 if no other number shows that the comma is decimal."""
    with_comma = [cell for line in sample for cell in form.cells(line) if "," in cell]
    if with_comma and all(COULD_BE_GROUPS.fullmatch(cell) for cell in with_comma):
        refuse_ambiguous(with_comma[0])


def refuse_ambiguous(cell: str) -> NoReturn:
    """Raise InvalidRequest for a number that is 1.234 or 1234."""
    refuse_file(
        f"the number {cell[:40]!r}, which has a decimal sign or a separator of thousands",
        "numbers that can be read in one way",
        "Export the numbers without separators of thousands, and with a decimal point.",
    )


def _empty(sample: list[str], form: Form) -> int:
    """Return how many cells at the end of every line are empty."""
    if form.separator == " ":
        return 0
    rows = [form.cells(line) for line in sample if not FOOTER.fullmatch(line.strip())]
    shortest = min(map(len, rows))
    count = 0
    while count < shortest - 1 and not any(row[-1 - count] for row in rows):
        count += 1
    return count
