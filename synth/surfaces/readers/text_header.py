"""What the lines above the numbers of a text file state: units, names of columns, sizes, spacing, missing points.

Stage   SURFACES, from files.
Model   A line with as many cells as there are columns names them; a line of units gives their units. A unit stands in
        brackets, after a stroke, or as the last word: "X [mm]", "Length/mm", "Position mm", "z_um". Other lines state
        one value each, as a word of KEYS, a sign, and a number or a unit: "x_unit: mm", "Sampling interval;0.5;um".
Source  Gwyddion user guide, export of raw data as text; SPIP's ASCII format; Esri ASCII raster; the other words are
        this project's choice.
Limits  A unit that is not a length refuses the file (`column_names`), as does a factor of the heights
        (`header_factors`), and a value that is stated in two ways. Other lines are left out.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from math import nan

from synth.surfaces.readers.column_names import (
    BRACKET,
    NOT_LENGTHS,
    VALUE,
    Column,
    column_of,
    is_other_unit,
    unit_alone,
    units_beside_names,
)
from synth.surfaces.readers.header_factors import check_statements
from synth.surfaces.readers.number_forms import Form, NotANumber
from synth.surfaces.readers.surface_file import UNITS, refuse_file, unit_named

NUMBER = r"[+-]?(?:[0-9]+(?:[.,][0-9]*)?|[.,][0-9]+)(?:[eE][+-]?[0-9]{1,4})?"
_STEP = r"(?:pixel ?size|pixel|spacing|pitch|step(?: ?size| ?distance| ?width)?|incr(?:ement)?|resolution|"
_STEP += r"sampl(?:ing|e) ?(?:interval|distance|step|spacing|pitch)|calibration|point ?(?:spacing|distance|pitch)"
_STEP += r"|data ?(?:spacing|interval)|lateral ?resolution|abtastabstand|punktabstand|messpunktabstand)"
KEYS = {
    "width": r"(?:Width|x[ _-]?(?:length|size|range)|scan ?size ?x)",
    "height": r"(?:Height|y[ _-]?(?:length|size|range)|scan ?size ?y)",
    "columns": r"(?:ncols|columns|n ?columns|x[ _-]?(?:pixels|points|samples)|number of columns|horizontal)",
    "rows": r"(?:nrows|rows|n ?rows|y[ _-]?(?:pixels|points|samples)|number of (?:rows|lines)|vertical)",
    "step": rf"(?:cell ?size|(?:x ?y|lateral)[ _-]?{_STEP}|{_STEP}(?<!resolution)(?<!calibration))",
    "step x": rf"(?:dx|delta[ _]?x|x[ _-]?{_STEP}|{_STEP}[ _-]?x)",
    "step y": rf"(?:dy|delta[ _]?y|y[ _-]?{_STEP}|{_STEP}[ _-]?y)",
    "unit": r"(?:value ?units?|(?:z|height|vertical|data|amplitude)[ _-]?(?:axis[ _-]?)?units?|units?[ _-]?(?:of )?"
    r"(?:z|heights?|values?)|z[ _-]?(?:axis|achse))",
    "unit x": r"(?:(?:x|x ?y|lateral|horizontal|length|position|distance|abscissa)[ _-]?(?:axis[ _-]?)?units?"
    r"(?:[ _-]?labels?)?|"
    r"units?[ _-]?(?:of )?(?:x|lengths?|positions?)|x[ _-]?(?:axis|achse))",
    "unit y": r"(?:y[ _-]?(?:axis[ _-]?)?units?(?:[ _-]?labels?)?|y[ _-]?(?:axis|achse))",
    "unit of all": r"(?:units?|einheit(?:en)?|unités?|単位|(?:all )?(?:data|values|dimensions) (?:are )?in)",
    "no data": r"(?:no[ _-]?data(?:[ _-]?value)?|missing(?:[ _-]?(?:value|data|points?))?|fill[ _-]?value|_FillValue|"
    r"(?:bad|invalid|void|dummy|undefined|masked|blank(?:ed)?|lost|null|error|drop-?outs?|nan|outliers?|saturated|"
    r"unmeasured|not measured)(?:[ _-]?(?:values?|pixels?|points?|data|codes?|marks?))?|fehl\w*|ungültig\w*|leerwert|"
    r"(?:valeurs? )?manquante?s?|dato perso|sin datos)",
    "channel": r"(?:Channel)",
}
_VALUE = r"\s*(?:[\[(](?P<of_key>[^\])]*)[\])])?\s*(?P<sign>[:=;,\t|]|\b(?:is|are|as)\b)?\s*"
_VALUE += rf"(?P<number>{NUMBER})?\s*[;,\t]?\s*"
_VALUE += r"[\[(]?(?P<unit>[^\s;,\t\])]*)"
_BEFORE = r"(?:^|[\s#%;,])"
_BEFORE_UNIT = r"(?:^|[#%;,|])[\s#%!'/*]*"  # "Axis unit" and "x data unit" are not "unit" and "data unit"
STATED = {
    key: re.compile(rf"(?i){_BEFORE_UNIT if key.startswith('unit') else _BEFORE}{words}{_VALUE}")
    for key, words in KEYS.items()
}
ALONG_X = re.compile(
    r"(?i)(?:.*[.:=;,|\t])?[\W\d_]*(?:(?:measur\w*|nominal|mean|average|the|data|grid|points?|sampl\w*)\s*){0,3}"
)
"""Words before the name of a step that leave it the one along x; "Line spacing" and "Z resolution" are others."""
PITCH = re.compile(r"(?i)\W*pitch\b")
SPECIMEN = re.compile(
    r"(?i)\b(?:specimens?|gratings?|standards?|arte?facts?|threads?|screws?|grooves?|gears?|teeth|ridges?)\b"
)
IS_TIME = re.compile(r"(?i)\W*x[ _-]?dimension(?:\W+time)+\W*")  # of LabVIEW
SIGNS = re.compile(r"[#%!'/*]{4,}")  # a line of them takes long to search
COUNTED = re.compile(
    r"(?i)(?:pixels?|points?|values|data|drop-?outs?|outliers|missing|lost|fehlend\w*|fehlstellen)\s*[:=;,\t|]?\s*[0-9]+$"
)
LEAST_MARK = 99.0  # "Missing points: 12" counts them; "Missing points: 9999" marks them
SURE_SEPARATORS = (r"\t", ";", ",", r"\|")
FULL_WIDTH = str.maketrans("\uff08\uff09\uff3b\uff3d\uff5b\uff5d\uff1a\uff0f\uff1d", "()[]{}:/=")
UNITS_OF_ROW = re.compile(r"(?i:units?|einheit(?:en)?|unités?|-+)")  # before the units of a row, or for none
OF_TWO = re.compile(r"(?i)\W*units?\s*[:=]\s*([^\s,;]+)\s*[,;]\s*([^\s,;]+)\s*")  # Units: mm, um
LINES_OF_NAMES = 12  # last lines of a header that can name the columns
BEGINS_AS_NUMBER = re.compile(
    r"[+-]?[0-9.,]+(?:[:/][0-9.,]+)*(?:[eE][+-]?[0-9]+)?(?:\s|$)"
)  # a value, which is no name of a column
INCH = "\u2033"
_QUOTED = re.compile(r'(^[\s#%!/*]*|[\t;,|]\s*|(?<=")\s+)"((?:[^"]|"")*)"(?=\s*(?:[\t;,|]|$)|\s+")')
_OPEN_QUOTE = re.compile(r'(?:^|[\t;,|])\s*"[^"]*$')  # the cell ends in the next line
_WAYS = (r"\t", ";", r"\|", r"\s{2,}", ",", r"(?<=[\])}>])\s*,?\s+")
_PREFIX = re.compile(r"^[\s#%!'/*;]+")
_VALUE_WITH_UNIT = re.compile(r".*(?:^|[\s;,])[+-]?[0-9][0-9.,]*[\s;,]+[^\W\d_]+\s*")  # no name of a column


@dataclass(frozen=True)
class Header:
    """What a header states.

    columns: one for each column of the numbers; empty if the header does not name them.
    values: for each key of KEYS that is stated, the number as text, and a unit or a text.
    lines: number of lines.
    axis: coordinates of the columns of a grid, with nan at the corner; empty if the last line has none.
    corner: words of the corner above the coordinates of the rows, or "".
    """

    columns: tuple[Column, ...] = ()
    values: dict[str, tuple[str, str]] = field(default_factory=dict)
    lines: int = 0
    axis: tuple[float, ...] = ()
    corner: str = ""

    def number(self, key: str) -> float | None:
        """Return the number of `key`, or None if none is stated."""
        text = self.values.get(key, ("", ""))[0].replace(",", ".")
        return float(text) if text else None

    def unit(self, key: str) -> str | None:
        """Return the unit of `key`, a key of UNITS, or None if none is stated."""
        return unit_named(self.values.get(key, ("", ""))[1])


def header_of(lines: list[str], form: Form, columns: int) -> Header:
    """Return what `lines` state. Raises InvalidRequest for heights that are no lengths, and for a factor."""
    total, lines = len(lines), [_inch_signs(line) for line in _joined([line.translate(FULL_WIDTH) for line in lines])]
    check_statements(lines)
    is_upwards = any(re.match(r"(?i)\s*yll(?:corner|center)\b", line) for line in lines)
    named = _columns(lines, form, columns) or _beside_counts(lines, form, columns)
    if not any(one.unit for one in named):
        _check_count(lines, columns)
    values: dict[str, tuple[str, str]] = {}
    for line in lines:
        text = SIGNS.sub("#", line.replace('"', "").strip())
        for key, pattern in STATED.items():
            for match in pattern.finditer(text):
                if key == "step" and not ALONG_X.fullmatch(text[: match.start()]):
                    continue
                if key == "step" and PITCH.match(match[0]) and SPECIMEN.search(text):
                    continue
                if found := _value(key, match, text):
                    _check_same(key, values.setdefault(key, found), found)
                    break
        if pair := OF_TWO.fullmatch(text):
            of_x, of_heights = map(unit_named, pair.groups())
            if of_x and of_heights:
                values = {"unit x": ("", of_x), "unit": ("", of_heights)} | values
    if lines and (alone := unit_named(lines[-1].strip(" []()#"))):
        values.setdefault("unit of all", ("", alone))
    _add_units_of_words(values, lines, named)
    if is_upwards:
        values["upwards"] = ("", "")
    if any(map(IS_TIME.fullmatch, lines)):
        values = {key: value for key, value in values.items() if not key.startswith("step")}
        named = tuple(replace(one, name="Time") if one.role == "x" else one for one in named)
    axis = _axis(lines[-1:], form, columns)
    if axis:
        named = ()
    return Header(named, values, total, axis, form.cells(lines[-1])[0] if axis else "")


def _add_units_of_words(values: dict[str, tuple[str, str]], lines: list[str], named: tuple[Column, ...]) -> None:
    """Add the units of names such as "Height [nm]" anywhere in a header whose columns and keys have none.

    Such a name stands in a label, far above the numbers, or beside more names than there are columns.
    """
    for role, unit in units_beside_names(lines):
        key = {"height": "unit", "x": "unit x"}.get(role, "unit y")
        if any(one.role == role and one.unit for one in named) or "unit of all" in values:
            continue
        _check_same(key, values.setdefault(key, ("", unit)), ("", unit))


def _check_same(key: str, first: tuple[str, str], other: tuple[str, str]) -> None:
    """Refuse a value that the header states twice, in two ways. Numbers without units may be of other things."""
    numbers = [
        float(one[0].replace(",", ".")) * UNITS.get(unit_named(one[1]) or "", 1.0) for one in (first, other) if one[0]
    ]
    units = {UNITS.get(unit_named(one[1]) or "") for one in (first, other)}
    differs = len(numbers) == 2 and None not in units and abs(numbers[0] - numbers[1]) > 1e-6 * abs(numbers[0])
    if differs or (key.startswith("unit") and len(units) > 1):
        stated = " and ".join(f"{number} {unit}".strip() for number, unit in (first, other))
        refuse_file(f"a header that states {key} twice: {stated}", "one value", "Remove the one that is wrong.")


def _joined(lines: list[str]) -> list[str]:
    """Return the lines, with those joined whose quotes hold the end of a line."""
    joined: list[str] = []
    for line in lines:
        if joined and _OPEN_QUOTE.search(joined[-1]):
            joined[-1] += f" {line}"
        else:
            joined.append(line)
    return joined


def _inch_signs(line: str) -> str:
    """Return a line whose quotation marks are those round cells; any other is the sign of inches, U+2033."""
    marked = _QUOTED.sub(lambda match: f"{match[1]}\0{match[2].replace(chr(34) * 2, INCH)}\0", line)
    return marked.replace('"', INCH).replace("\0", '"')


def _check_count(lines: list[str], count: int) -> None:
    """Refuse a line that names more columns than there are, two of them with units: which is which is not known."""
    for line in lines[-LINES_OF_NAMES:]:
        text = _PREFIX.sub("", line).replace('"', "")
        cells = next((cells for way in _WAYS if len(cells := re.split(way, text)) > 1), [])
        columns = [column_of(cell.strip()) for cell in cells if not re.search(r"[:=]\s*[+-]?[0-9]", cell)]
        named = [one for one in columns if one.unit or one.of_else or one.role not in ("", "other")]
        if len(named) > count and len(units_beside_names([line])) > 1:
            found = f"{len(named)} names of columns, {text[:60]!r}, above {count} columns of numbers"
            found = found.replace("1 columns", "one column") if count == 1 else found
            refuse_file(found, "a name for each column", "Correct the line of names, or remove it and give the units.")


def _beside_counts(lines: list[str], form: Form, count: int) -> tuple[Column, ...]:
    """Return the columns if all but the first have names with units: R writes no name above the numbers of rows."""
    named = _columns(lines[-1:], form, count - 1) if count > 2 else ()
    return (Column("number"), *named) if named and all(one.unit for one in named) else ()


def _axis(last: list[str], form: Form, count: int) -> tuple[float, ...]:
    """Return the coordinates in the last line of the header, below a corner with words such as "y/x"."""
    cells = form.cells(last[0]) if last and count > 2 else []
    try:
        return (nan, *(float(form.number(cell)) for cell in cells[1:])) if len(cells) == count else ()
    except NotANumber:
        return ()


def _value(key: str, match: re.Match[str], line: str) -> tuple[str, str] | None:
    """Return the number and the unit that `line` states for `key`, or None if it states none."""
    number, unit = (match["number"] or "").rstrip(".,"), (match["unit"] or "").split("/")[0] or (match["of_key"] or "")
    if key == "channel":
        named = line[match.end("of_key") if match["of_key"] else match.start("sign") + 1 :].strip()[:80]
        return ("", named) if named else None
    if key.startswith("unit"):
        stated = unit if match["sign"] or "\t" in match[0] or unit_named(unit) else ""
        stated = stated or (match["of_key"] or "")
        if not stated or number:
            return None
        if (
            key == "unit of all"
            and len(set(filter(None, map(unit_named, re.split(r"[\s;,/|]+", line[match.start("unit") :]))))) > 1
        ):
            return None  # a row of units
        if unit_named(stated) is None and NOT_LENGTHS.fullmatch(stated):
            refuse_file(f"{match[0].strip()[:60]!r}", "a unit of length", "Export heights, in um.")
        return ("", stated) if unit_named(stated) else None
    of_else = key.startswith("step") and unit_named(unit) is None and NOT_LENGTHS.fullmatch(unit)
    if not number or of_else or (key.startswith("step") and not float(number.replace(",", ".")) > 0.0):
        return None
    if key in ("columns", "rows") and not number.isdigit():
        return None
    if key == "no data" and abs(float(number.replace(",", "."))) < LEAST_MARK and COUNTED.search(match[0]):
        return None
    return number, unit if unit_named(unit) else ""


def _columns(lines: list[str], form: Form, count: int) -> tuple[Column, ...]:
    """Return the columns that the last lines of the header name, or none.

    Of several lines that could be names, the last one with units is taken, else the last one with a known name.
    """
    named: list[list[Column]] = []
    units: list[str | None] | None = None
    for line in reversed(lines[-LINES_OF_NAMES:]):
        cells = _cells(line, form, count)
        if cells is None:
            continue
        if _is_value(line) and not all(BRACKET.search(cell) or column_of(cell).unit for cell in cells):
            continue
        found = [unit_alone(cell) for cell in cells]
        others = [cell for unit, cell in zip(found, cells, strict=True) if cell and not unit]
        of_else = {cell for cell in others if is_other_unit(cell)}
        if units is None and any(found) and all(UNITS_OF_ROW.fullmatch(cell) or cell in of_else for cell in others):
            units = [unit or (cell if cell in of_else else None) for unit, cell in zip(found, cells, strict=True)]
        elif any(re.search(r"[^\W\d_]", cell) for cell in cells) and not any(map(BEGINS_AS_NUMBER.match, cells)):
            columns = [column_of(cell) for cell in cells]
            if not any(one.unit and UNITS_OF_ROW.fullmatch(one.name) for one in columns):  # "X unit [um]" is a key
                named.append(columns)
    if not named:
        return tuple(_with_unit(Column(), unit) for unit in units) if units else ()
    chosen = max(named, key=_is_named)
    if units:
        chosen = [_with_unit(one, unit) for one, unit in zip(chosen, units, strict=True)]
    return tuple(chosen)


def _is_value(line: str) -> bool:
    """Return whether a line is a key with its value."""
    return len(re.findall("[:=]", BRACKET.sub("", line))) == 1


def _is_named(columns: list[Column]) -> int:
    """Return 2 if columns have units and a name that is known, 1 if they have one of these, else 0."""
    has_unit = any(one.unit or one.of_else for one in columns)
    return has_unit + any(one.role for one in columns)


def _with_unit(column: Column, unit: str | None) -> Column:
    """Return a column with its unit of the row of units. Refuses another one in its name."""
    if unit and is_other_unit(unit):
        return column if column.role == "index" else replace(column, of_else=f"{column.name} [{unit}]".strip())
    if unit and column.unit and UNITS.get(unit) != UNITS.get(column.unit):
        found = f"a column {column.name!r} in {column.unit}, above a row of units with {unit}"
        refuse_file(found, "one unit for each column", "Remove the unit that is wrong.")
    return replace(column, unit=unit or column.unit)


def _cells(line: str, form: Form, count: int) -> list[str] | None:
    """Return the cells of a line of names or units, or None if it does not have `count` of them."""
    if '"' in line and len(quoted := replace(form, quoted=True).cells(line.lstrip("#%! "))) == count > 1:
        return quoted
    text = _PREFIX.sub("", line).strip().replace('"', "")
    if count == 1:
        text = text.rstrip(",;| ")
        named = column_of(text)
        has_value = bool(VALUE.search(text) or _VALUE_WITH_UNIT.fullmatch(text))
        has_value |= bool(named.of_else and re.search("[0-9]", text))
        is_value = has_value and not named.unit and not named.role
        is_name = len(text) < 60 and not re.search(r"[:=]", BRACKET.sub("", text)) and not is_value
        return [text] if is_name else None
    if line.count(form.separator) == count - 1 and form.separator != " ":
        text = line.replace('"', "")  # an empty first cell counts
    ways: tuple[str, ...] = (re.escape(form.separator) if form.separator != " " else r"\s{2,}|\t",)
    ways += (r"\t", ";", r"\|", ",", r"\s{2,}", r"\s+(?![\[({<])", r"[\s,]+(?![\[({<])", r"(?<=[\])])\s+(?=[\[(])")
    for way in ways:
        cells = [cell.strip(" '") for cell in re.split(way, text)]
        while len(cells) > count and not cells[-1]:
            cells.pop()
        if len(cells) == count + 1 and way in SURE_SEPARATORS and _has_one_more(cells):
            cells.pop()
        if len(cells) == count:
            return cells
    pairs = re.split(r"[\s,;]+", text)
    if len(pairs) == 2 * count and all(unit_named(word) for word in pairs[1::2]):
        return [f"{name} [{unit}]" for name, unit in zip(pairs[::2], pairs[1::2], strict=True)]
    return None


def _has_one_more(cells: list[str]) -> bool:
    """Return whether the last name has no column: LabVIEW names a comment, whose cells may be absent."""
    *columns, last = map(column_of, cells)
    is_unit = last.unit or unit_alone(cells[-1])
    is_named = any(one.unit or one.of_else or one.role for one in columns)
    return not is_unit and last.role in ("", "other") and is_named
