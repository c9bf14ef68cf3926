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
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cache, partial
from itertools import takewhile, zip_longest
from operator import not_
from typing import NoReturn

from synth.surfaces.readers.surface_file import refuse_file

SEPARATORS = {"\t": "tabs", ";": "semicolons", "|": "bars", ",": "commas", " ": "spaces"}
STRONG = ("\t", ";", "|")  # signs that are in no number
WEAK = (",", " ")
_ERRORS = r"#(?:n/a|div/0|value|num|null|nv|wert|ref)!?"  # of spreadsheets
COMMENT = re.compile(rf"(?i)\s*(?:(?!{_ERRORS}(?:[\s;,|]|$))#|%|//|!|[;'][^\W\d_]{{2}})")
FOOTER = re.compile(r"(?i)\x1a|[\W_]*(?:end|eof|eod|eor)\b[^0-9]*")  # \x1a ended the files of MS-DOS
NO_HEIGHT = re.compile(
    r"(?i:nan(?:\([^)]*\))?|bad|[+-]?inf(?:inity)?|n\.?/?a\.?|null|none|void|invalid|missing|masked|no ?data"
    rf"|{_ERRORS}|[+-]?1\.#(?:qnan|snan|ind|inf)0*)|-+|\*+|\?+"
)
TWO_WORDS = re.compile(r"(?i)(?<![^\s;,|])no[ \t]+data(?![^\s;,|])")  # of one missing point, also between spaces
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
BETWEEN_GROUPS = {mark: re.compile(rf"[^0-9{mark}+-]") for mark in ".,"}
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
            cells = ([cell for cell in cells if cell] or [""]) if self.separator == " " else cells
        elif self.separator == " ":
            cells = re.split(r"[ \t]+", TWO_WORDS.sub("nan", line) if "ata" in line.lower() else line)
        else:
            cells = line.split(self.separator)
        if self.empty and not any(cell.strip() for cell in cells[-self.empty :]):
            cells = cells[: -self.empty]
        return [cell.strip() for cell in cells]

    def number(self, cell: str) -> str:
        """Return a cell as Python writes the number; nan for a missing point. Raises NotANumber."""
        is_plain = PLAIN[self.decimal].fullmatch
        if not is_plain(cell):
            cell = cell.strip(" \t'\"=\x1a").translate(SIGNS)
        if is_plain(cell):
            return _as_python_writes(cell, self.decimal)
        if GROUPED[self.decimal].fullmatch(cell):
            return BETWEEN_GROUPS[self.decimal].sub("", cell).replace(",", ".")
        if not cell or NO_HEIGHT.fullmatch(cell):
            return "nan"
        raise NotANumber(cell)

    def row(self, line: str) -> list[str]:
        """Return the numbers of `line`. Raises NotANumber."""
        if not self.quoted and _plain_row(self.separator, self.decimal).fullmatch(line):
            cells = self.cells(_as_python_writes(line, self.decimal))
            return ["nan" if cell[-1:] in "-*?nN" else cell for cell in cells]  # an empty one, too
        return [self.number(cell) for cell in self.cells(line)]

    @property
    def is_plain(self) -> bool:
        """Whether NumPy can read the lines once commas are points."""
        return not self.quoted and not self.empty

    def says(self, columns: int) -> str:
        """Return how the numbers are written, as the end of a sentence."""
        said = f", separated by {SEPARATORS[self.separator]}" if columns > 1 else ""
        return said + (", with decimal commas" if self.decimal == "," else "")


@cache
def _plain_row(separator: str, decimal: str) -> re.Pattern[str]:
    """Return the pattern of a line whose cells need no look at each: plain numbers and the usual missing points.

    Possessive repeats remember no way back, so that a line of a million numbers takes no memory.
    """
    cell = rf"(?:{PLAIN[decimal].pattern}|-++|\*++|\?++|[nN][aA][nN])"
    if separator == " ":
        return re.compile(rf" *+{cell}(?:[ \t]++{cell})*+[ \n]*+")
    return re.compile(rf" *+{cell}?+(?: *+\{separator} *+{cell}?+)*+[ \n]*+")


def _as_python_writes(numbers: str, decimal: str) -> str:
    numbers = numbers.replace("d", "e").replace("D", "e")
    return numbers.replace(",", ".") if decimal == "," else numbers


FORMS = tuple(Form(separator, decimal) for separator in SEPARATORS for decimal in ".,")


def is_numbers(line: str) -> bool:
    """Return whether `line` has numbers only, in one of the forms, and at least one."""
    return any(cell != "nan" for form in FORMS for cell in _reading(form, line) or ())


def is_missing(line: str) -> bool:
    """Return whether `line` has missing points only. Hyphens do not count: they divide header and numbers."""
    cells = re.split(r"[\s;,|]+", TWO_WORDS.sub("nan", line.strip()).rstrip(";,|"))
    return all(NO_HEIGHT.fullmatch(cell) and re.search(r"[^\W\d_]", cell) for cell in cells)


def _reading(form: Form, line: str) -> list[str] | None:
    """Return the numbers of `line` in `form`, or None if it has other cells."""
    if form.separator != " " and form.separator not in line:
        return None
    if '"' in line:
        form = replace(form, quoted=True)
    elif form.separator == form.decimal:
        return None
    try:
        return form.row(line)
    except (NotANumber, csv.Error):
        return None


def _rows(form: Form, sample: list[str]) -> Iterator[list[str]]:
    """Yield the numbers of the lines that can be read in `form`."""
    return (row for row in map(partial(_reading, form), sample) if row is not None)


def form_of(sample: list[str], header: list[str]) -> Form:
    """Return the form of the first lines of numbers. Raises InvalidRequest if they can be read in two ways.

    header: the lines above them.
    """
    any_quotes = any('"' in line for line in sample)
    declared = next((line.strip()[4:5] for line in header if line.strip().lower().startswith("sep=")), "")
    fits: dict[Form, int] = {}  # lines of one length
    for separators in (STRONG, WEAK):
        if declared or max(fits.values(), default=0) < len(sample):
            forms = [form for form in FORMS if form.separator in separators]
            fits |= {form: max(Counter(map(len, _rows(form, sample))).values(), default=0) for form in forms}
    most = max(fits.values())
    if not most:
        refuse_file(f"the line {sample[0].strip()[:60]!r}", "numbers", "Correct the line.")
    found = [replace(form, quoted=any_quotes) for form in fits if fits[form] == most]
    found = [form for form in found if form.separator == declared] or found
    found = [form for form in found if form.separator in STRONG] or found
    different = [form for form in found[1:] if not _agree(found[0], form, sample)]
    chosen = _chosen([found[0], *different], sample, header) if different else found[0]
    if chosen.decimal == "," and chosen.separator != " ":
        _check_groups(sample, chosen)
    if chosen.separator == "," and any(CUT.fullmatch(cell) for line in sample for cell in chosen.cells(line)):
        _refuse_commas(sample[0])
    return replace(chosen, empty=_empty(sample, chosen))


def _agree(one: Form, other: Form, sample: list[str]) -> bool:
    """Return whether the lines have the same numbers in two forms."""
    pairs = zip_longest(_rows(one, sample), _rows(other, sample), fillvalue=())
    return all(a == b or _values(a) == _values(b) for a, b in pairs)


def _values(row: Iterable[str]) -> list[float | None]:
    return [None if cell == "nan" else float(cell) for cell in row]


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
    rows = (form.cells(line) for line in sample if not FOOTER.fullmatch(line.strip()))
    return min(len(list(takewhile(not_, row[:0:-1]))) for row in rows)
