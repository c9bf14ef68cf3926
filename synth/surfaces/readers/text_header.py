"""What the lines above the numbers of a text file state: units, names of columns, sizes, spacing, missing points.

Stage   SURFACES, from files.
Model   A line with as many cells as there are columns names them; a line of units gives their units. A unit stands in
        brackets, after a stroke, or as the last word: "X [mm]", "Length/mm", "Position mm", "z_um". Other lines state
        one value each, as a word of KEYS, a sign, and a number or a unit: "x_unit: mm", "Sampling interval;0.5;um".
Source  Gwyddion user guide, export of raw data as text; SPIP's ASCII format; Esri ASCII raster; the other words are
        this project's choice.
Limits  A unit that is not a length refuses the file, as does a factor of the heights. Other lines are left out.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from math import nan

from synth.surfaces.readers.number_forms import Form, NotANumber
from synth.surfaces.readers.surface_file import refuse_file, unit_named

NUMBER = r"[+-]?(?:[0-9]+(?:[.,][0-9]*)?|[.,][0-9]+)(?:[eE][+-]?[0-9]{1,4})?"
NOT_LENGTHS = re.compile(
    r"(?i:[mµuk]?v|[mµu]?s|sec|seconds?|min|[mµu]?n|deg|degrees?|°|rad|%|counts?|k?hz|[kmg]?pa|°c|a\.?u\.?|arb|gr[ae]y"
    r"|dbv?|g|mm/s|m/s|[um]m/s|um/s)"
)
PIXELS = re.compile(r"(?i:px|pix|pixels?|points?|pts?|samples?|index)")
INDEX = re.compile(
    r"(?i:no|nr|num|number|index|idx|id|i|n|#|№|points?|pts?|point ?(?:no|nr|number|index)|counter|count|samples?|"
    r"rows?|row ?number|lines?|data ?points?|t|time|zeit|temps|timestamp|время|時間|时间)\.?"
)
"""Columns that count the points, in numbers or in seconds."""
ALONG = re.compile(
    r"(?i:x ?[0-9]*|x[ _-].*|x-?(?:axis|coord|pos|value|data).*|lateral.*|pos(?:ition)?\b.*|dist(?:ance)?\b.*|"
    r"len(?:gth)?\b.*|weg\b.*|strecke.*|länge.*|laenge.*|longueur.*|abscissa.*|travel.*|traverse.*|horizontal.*|scan.*|расстояние.*|"
    r"длина.*|距離.*|长度.*|位置.*|délka.*|distanza.*|distancia.*)"
)
ACROSS = re.compile(r"(?i:y ?[0-9]*|y[ _-].*|y-?(?:axis|coord|pos|value).*)")
HEIGHT = re.compile(
    r"(?i:z ?[0-9]*|z[ _-].*|z-?(?:axis|coord|pos|value|data|height).*|.*height.*|altitude.*|elevation.*|.*profile.*|"
    r"h|depth.*|.*höhe.*|.*hoehe.*|tiefe.*|hauteur.*|profil.*|altura.*|topo.*|raw.*|primary.*|roughness.*|amplitude.*|"
    r"высота.*|профиль.*|高さ.*|高度.*|výška.*|altezza.*)"
)
OPTICAL = re.compile(r"(?i:intensity.*|red|green|blue|r|g|b|colou?r.*|quality.*|valid.*|flag.*|confidence.*)")
_STEP = r"(?:pixel ?size|pixel|spacing|pitch|step(?: ?size| ?distance| ?width)?|incr(?:ement)?|resolution|"
_STEP += r"sampl(?:ing|e) ?(?:interval|distance|step|spacing|pitch)|calibration|point ?(?:spacing|distance|pitch)"
_STEP += r"|data ?(?:spacing|interval)|lateral ?resolution|abtastabstand|punktabstand|messpunktabstand)"
_FACTOR = r"(?:z|height)?[ _-]?(?:scale|scaling|scale ?factor|factor|multiplier|height ?scale)"
KEYS = {
    "width": r"(?:Width|x[ _-]?(?:length|size|range)|scan ?size ?x)",
    "height": r"(?:Height|y[ _-]?(?:length|size|range)|scan ?size ?y)",
    "columns": r"(?:ncols|columns|n ?columns|x[ _-]?(?:pixels|points|samples)|number of columns|horizontal)",
    "rows": r"(?:nrows|rows|n ?rows|y[ _-]?(?:pixels|points|samples)|number of (?:rows|lines)|vertical)",
    "step": rf"(?:cell ?size|(?:x ?y|lateral)[ _-]?{_STEP}|{_STEP}(?<!resolution)(?<!calibration))",
    "step x": rf"(?:dx|delta ?x|x[ _-]?{_STEP}|{_STEP}[ _-]?x)",
    "step y": rf"(?:dy|delta ?y|y[ _-]?{_STEP}|{_STEP}[ _-]?y)",
    "unit": r"(?:value ?units?|(?:z|height|vertical|data|amplitude)[ _-]?(?:axis[ _-]?)?units?|units?[ _-]?(?:of )?"
    r"(?:z|heights?|values?))",
    "unit x": r"(?:(?:x|x ?y|lateral|horizontal|length|position|distance|abscissa)[ _-]?(?:axis[ _-]?)?units?|"
    r"units?[ _-]?(?:of )?(?:x|lengths?|positions?))",
    "unit y": r"y[ _-]?(?:axis[ _-]?)?units?",
    "unit of all": r"(?:units?|einheit(?:en)?|unités?|単位|(?:all )?(?:data|values|dimensions) (?:are )?in)",
    "no data": r"(?:no[ _-]?data(?:[ _-]?value)?|missing(?:[ _-]?(?:value|data))?|fill[ _-]?value|_FillValue|"
    r"(?:bad|invalid|void|dummy)(?:[ _-]?(?:value|pixel|point|data))?)",
    "factor": _FACTOR,
    "channel": r"(?:Channel)",
}
_VALUE = rf"\s*(?:[\[(](?P<of_key>[^\])]*)[\])])?\s*(?P<sign>[:=;,\t|]|\bis\b)?\s*(?P<number>{NUMBER})?\s*[;,\t]?\s*"
_VALUE += r"[\[(]?(?P<unit>[^\s;,\t\])]*)"
_BEFORE = r"(?:^|[\s#%;,])"
_BEFORE_UNIT = r"(?:^|[#%;,|])[\s#%!'/*]*"  # "Axis unit" and "x data unit" are not "unit" and "data unit"
STATED = {
    key: re.compile(rf"(?i){_BEFORE_UNIT if key.startswith('unit') else _BEFORE}{words}{_VALUE}")
    for key, words in KEYS.items()
}
OF_OTHER_AXIS = re.compile(r"(?i)\b(?:y|z|time|vertical|height|stylus|cut-?off|wave)[\s_-]*")
UNITS_OF_ROW = re.compile(r"(?i:units?|einheit(?:en)?|unités?|-+)")  # before the units of a row, or for none
OF_TWO = re.compile(r"(?i)\W*units?\s*[:=]\s*([^\s,;]+)\s*[,;]\s*([^\s,;]+)\s*")  # Units: mm, um
BEGINS_AS_NUMBER = re.compile(r"[+-]?[0-9.,]+(?:\s|$)")  # a value, which is no name of a column
_PREFIX = re.compile(r"^[\s#%!'/*;]+")
_BRACKETS = re.compile(r"(.*?)[\s_:,;/]*[\[({<]\s*(?:in\s+)?([^\])}>]*?)\s*[\])}>]\s*")
_LAST_WORD = re.compile(r"(.*?)(?:\s*/\s*|\s+in\s+|[_,:;\s-]\s*)(\S+?)\s*")
_VALUE_WITH_UNIT = re.compile(r".*(?:^|[\s;,])[+-]?[0-9][0-9.,]*[\s;,]+[^\W\d_]+\s*")  # no name of a column


@dataclass(frozen=True, slots=True)
class Column:
    """A column of the numbers.

    name: as the header has it, or "".
    unit: a key of UNITS, "pixel", or None if the header states none.
    of_else: the whole cell, if it states a unit that is not a length; else "".
    """

    name: str = ""
    unit: str | None = None
    of_else: str = ""

    @property
    def role(self) -> str:
        """One of "index", "x", "y", "height", "other" and "", told from the name."""
        roles = (("index", INDEX), ("x", ALONG), ("y", ACROSS), ("height", HEIGHT), ("other", OPTICAL))
        return next((role for role, names in roles if names.fullmatch(self.name.strip())), "")


@dataclass(frozen=True)
class Header:
    """What a header states.

    columns: one for each column of the numbers; empty if the header does not name them.
    values: for each key of KEYS that is stated, the number as text, and a unit or a text.
    lines: number of lines.
    axis: coordinates of the columns of a grid, with nan at the corner; empty if the last line has none.
    """

    columns: tuple[Column, ...] = ()
    values: dict[str, tuple[str, str]] = field(default_factory=dict)
    lines: int = 0
    axis: tuple[float, ...] = ()

    def number(self, key: str) -> float | None:
        """Return the number of `key`, or None if none is stated."""
        text = self.values.get(key, ("", ""))[0].replace(",", ".")
        return float(text) if text else None

    def unit(self, key: str) -> str | None:
        """Return the unit of `key`, a key of UNITS, or None if none is stated."""
        return unit_named(self.values.get(key, ("", ""))[1])


def header_of(lines: list[str], form: Form, columns: int) -> Header:
    """Return what `lines` state. Raises InvalidRequest for heights that are no lengths, and for a factor."""
    total, lines = len(lines), _joined(lines)
    named = _columns(lines, form, columns) or _beside_counts(lines, form, columns)
    values: dict[str, tuple[str, str]] = {}
    for line in lines:
        text = line.replace('"', "").strip()
        for key, pattern in STATED.items():
            match = pattern.search(text)
            if match and key == "step" and OF_OTHER_AXIS.search(text[: match.start() + 1]):
                continue
            if match and key not in values and (found := _value(key, match, text)):
                values[key] = found
        if pair := OF_TWO.fullmatch(text):
            of_x, of_heights = map(unit_named, pair.groups())
            if of_x and of_heights:
                values = {"unit x": ("", of_x), "unit": ("", of_heights)} | values
    _check_factor(values)
    if lines and (alone := unit_named(lines[-1].strip(" []()#"))):
        values.setdefault("unit of all", ("", alone))
    return Header(named, values, total, _axis(lines[-1:], form, columns))


def _joined(lines: list[str]) -> list[str]:
    """Return the lines, with those joined whose quotes hold the end of a line."""
    joined: list[str] = []
    for line in lines:
        if joined and joined[-1].count('"') % 2:
            joined[-1] += f" {line}"
        else:
            joined.append(line)
    return joined


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
    number, unit = match["number"] or "", (match["unit"] or "").split("/")[0] or (match["of_key"] or "")
    if key == "channel":
        named = line[match.end("of_key") if match["of_key"] else match.start("sign") + 1 :].strip()[:80]
        return ("", named) if named else None
    if key.startswith("unit"):
        stated = unit if match["sign"] or unit_named(unit) else ""
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
    if not number or (key.startswith("step") and not float(number.replace(",", ".")) > 0.0):
        return None
    if key in ("columns", "rows") and not number.isdigit():
        return None
    return number, unit if unit_named(unit) else ""


def _check_factor(values: dict[str, tuple[str, str]]) -> None:
    number = values.get("factor", ("1", ""))[0].replace(",", ".")
    if float(number) != 1.0:
        refuse_file(
            f"a header that states a factor of {number}",
            "heights without a factor",
            "Multiply the heights by it if it is for them, and remove the line.",
        )


def _columns(lines: list[str], form: Form, count: int) -> tuple[Column, ...]:
    """Return the columns that the last lines of the header name, or none.

    Of several lines that could be names, the last one with a unit or a known name is taken, else the last one.
    """
    named: list[list[Column]] = []
    units: list[str | None] | None = None
    for line in reversed(lines[-6:]):
        cells = _cells(line, form, count)
        if cells is None or len(re.findall("[:=]", line)) == 1:  # a key with its value
            continue
        found = [_unit_alone(cell) for cell in cells]
        others = [cell for unit, cell in zip(found, cells, strict=True) if cell and not unit]
        if units is None and any(found) and all(UNITS_OF_ROW.fullmatch(cell) for cell in others):
            units = found
        elif any(re.search(r"[^\W\d_]", cell) for cell in cells) and not any(map(BEGINS_AS_NUMBER.match, cells)):
            named.append([_column(cell) for cell in cells])
    if not named:
        return tuple(Column("", unit) for unit in units) if units else ()
    columns = next((row for row in named if any(one.role or one.unit or one.of_else for one in row)), named[0])
    if units:
        columns = [replace(one, unit=unit or one.unit) for one, unit in zip(columns, units, strict=True)]
    return tuple(columns)


def _cells(line: str, form: Form, count: int) -> list[str] | None:
    """Return the cells of a line of names or units, or None if it does not have `count` of them."""
    text = _PREFIX.sub("", line).strip().replace('"', "")
    if count == 1:
        text = text.rstrip(",;| ")
        is_name = len(text) < 60 and not re.search(r"[:=]", text) and not _VALUE_WITH_UNIT.fullmatch(text)
        return [text] if is_name else None
    if line.count(form.separator) == count - 1 and form.separator != " ":
        text = line.replace('"', "")  # an empty first cell counts
    ways: tuple[str, ...] = (re.escape(form.separator) if form.separator != " " else r"\s{2,}|\t",)
    ways += (r"\t", ";", r"\|", ",", r"\s{2,}", r"\s+(?![\[(])", r"[\s,]+(?![\[(])", r"(?<=[\])])\s+(?=[\[(])")
    for way in ways:
        cells = [cell.strip(" '") for cell in re.split(way, text)]
        while len(cells) > count and not cells[-1]:
            cells.pop()
        if len(cells) == count:
            return cells
    pairs = text.split()
    if len(pairs) == 2 * count and all(unit_named(word) for word in pairs[1::2]):
        return [f"{name} [{unit}]" for name, unit in zip(pairs[::2], pairs[1::2], strict=True)]
    return None


def _unit_alone(cell: str) -> str | None:
    """Return the unit of a cell that is nothing else, such as "[mm]"."""
    inner = cell.strip(" []()<>{}")
    return unit_named(inner) or ("pixel" if PIXELS.fullmatch(inner) and inner != cell else None)


def _column(cell: str) -> Column:
    """Return the column that a cell of the header names."""
    match = _BRACKETS.fullmatch(cell)
    if match:
        name, unit = match.groups()
        if unit_named(unit):
            return Column(name, unit_named(unit))
        if PIXELS.fullmatch(unit):
            return Column(name, "pixel")
        is_other = NOT_LENGTHS.fullmatch(unit) or "/" in unit or re.match(r"[x×*]?\s*[0-9]", unit)
        return Column(name, of_else=cell if is_other else "")
    match = _LAST_WORD.fullmatch(cell)
    if match and unit_named(match[2]) and match[1]:
        return Column(match[1], unit_named(match[2]))
    return Column(cell)
