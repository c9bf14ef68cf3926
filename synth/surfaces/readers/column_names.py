"""The names of columns: what each column is, and the unit that its name states.

Stage   SURFACES, from files.
Model   A unit in brackets decides: "X [mm]". Without brackets the unit is the last word of the name, or of its part
        before a comma: "Length/mm", "Position mm", "z_um". A unit behind a number is a value, and not the unit of the
        column: "Z (um), cutoff 0.8 mm".
        What remains may number a name ("Z1", "Line 3"), state a setting ("cut-off 0.8 mm"), and have words. A sign, an
        operator or a number beyond these refuses the column: "-Z", "Z/50", "Z 1E-3 mm". A word that is not known
        beside a name of heights has to be confirmed by the user: "Height reduction", "Z (um, scaled)".
Source  This project's choice of words.
Limits  What stands in square brackets and is no unit of length refuses the column, as do other units, a factor, an
        inversion, two different units, and angles in place of lengths. A alone is ampere.
        A name of unknown words alone is read by its place in the table, with a note (`text_layout`).
"""

from __future__ import annotations

import re
import unicodedata
from dataclasses import dataclass

from synth.surfaces.readers.surface_file import UNITS, unit_named

NOT_LENGTHS = re.compile(
    r"(?i:[mµuk]?v|[mµu]?s|sec|seconds?|min|[mµunk]?n|n[ .·*]?m|deg|degrees?|grad|°|rad|%|counts?|k?hz|[kmg]?pa|°?c|°?k"
    r"|a\.?u\.?|arb|gr[ae]y|dbv?|g|mm/s|m/s|[um]m/s|[mµunp]?a|volts?|millivolts?|amperes?|amps?|newtons?|bar|psi|mol|lsb"
    r"|adc|adu|dn|digits?|bits?|ohms?|watts?|w|j|celsius|fahrenheit|kelvin|hours?|hertz|pascal)|[MGT]m|[nmµup]M"
)
OTHER_LENGTHS = re.compile(r"(?i:ft|feet|foot|dm|yd)")  # which nobody measures a surface in
PIXELS = re.compile(r"(?i:px|pix|pixels?|points?|pts?|samples?|index)")
INDEX = re.compile(
    r"(?i:no|nr|num|number|index|idx|id|i|n|#|№|points?|pts?|point ?(?:no|nr|number|index)|counter|count|samples?|"
    r"rows?|row ?number|lines?|data ?points?|t|time|zeit|temps|timestamp|время|時間|时间)\.?"
)
"""Columns that count the points, in numbers or in seconds."""
ROW = re.compile(r"(?i:(?:rows?|lines?|zeile|ligne|i|iy|y)(?:[ _-]?(?:no|nr|num(?:ber)?|index|idx|px|pix|pixel)\.?)?)")
COLUMN = re.compile(
    r"(?i:(?:cols?|columns?|spalte|colonne|j|ix|x)(?:[ _-]?(?:no|nr|num(?:ber)?|index|idx|px|pix|pixel)\.?)?)"
)
"""Columns that number the places of a grid; x and y alone are lengths."""
ANGLE = re.compile(
    r"(?i:theta|phi|alpha|angles?|winkel|azimuth|rotation|longitude|lon|lng|latitude|lat|bearing|"
    r"heading|grad)(?:[ _-].*)?"
)
ALONG = re.compile(
    r"(?i:x ?[0-9]*|x[ _-].*|x-?(?:axis|coord|pos|value|data).*|lateral.*|pos(?:ition)?\b.*|dist(?:ance)?\b.*|"
    r"len(?:gth)?\b.*|weg\b.*|strecke.*|länge.*|laenge.*|longueur.*|abscissa.*|travel.*|traverse.*|horizontal.*|scan.*|расстояние.*|"
    r"длина.*|距離.*|长度.*|位置.*|délka.*|vzdálenost.*|distanza.*|posizione.*|lunghezza.*|distancia.*|posición.*|longitud\b.*|"
    r"posição.*|distância.*|długość.*|pozycja.*|odległość.*|θέση.*|απόσταση.*|μήκος.*|mesafe.*|konum.*|uzunluk.*|"
    r"afstand.*|lengte.*|läge.*|längd.*|pituus.*|hossz.*|távolság.*|"
    r"droga.*|ścieżka.*|dráha.*|距离.*|長度.*|거리.*|위치.*|길이.*|"
    r"profil\w*?[ _-]*(?:länge|laenge|length|longueur|weg|position|distan\w*)\b.*)"
)
ACROSS = re.compile(r"(?i:y ?[0-9]*|y[ _-].*|y-?(?:axis|coord|pos|value).*)")
HEIGHT = re.compile(
    r"(?i:z ?[0-9]*|z[ _-].*|z-?(?:axis|coord|pos|value|data|height).*|.*height.*|altitude.*|elevation.*|vertical.*|"
    r"h|depth.*|.*höhe.*|.*hoehe.*|tiefe.*|hauteur.*|.*profil.*|altura.*|topo.*|raw.*|primary.*|roughness.*|amplitude.*|"
    r"высота.*|профил.*|高さ.*|高度.*|výška.*|altezza.*|quota.*|wysokość.*|ύψος.*|yükseklik.*|hoogte.*|höjd.*|højde.*|"
    r"høyde.*|korkeus.*|magasság.*|높이.*|깊이.*|(?:profon|profun)d.*|głębokość.*|hloubka.*|глубина.*|深さ.*|深度.*|βάθος.*|derinlik.*|"
    r"diepte.*|djup.*|dybde.*|syvyys.*|mélység.*)"
)
DEPTH = re.compile(
    r"(?i).*(?:depth|tiefe|깊이|(?:profon|profun)d|głębokość|hloubka|глубина|深さ|深度|βάθος|derinlik|diepte|djup|dybde|syvyys|"
    r"mélység).*"
)
OPTICAL = re.compile(r"(?i:intensity.*|red|green|blue|r|g|b|colou?r.*|quality.*|valid.*|flag.*|confidence.*)")
BRACKET = re.compile(r"[\[({<]\s*(?:in\s+)?([^\[\](){}<>]*?)\s*[\])}>]")
IS_VALUED = re.compile(r"[\s:=;,|\"']*(?:is\s+)?[+-]?[0-9]")  # "Height [mm]: 5" is a size
UNIT_WITH_WORDS = re.compile(r"(\w{2,})(?:,|;|\s)\s*[^\W\d_][^\d*×/^]+")  # um, filtered
COMMENT_IN_BRACKETS = re.compile(r"[xyzXYZ]|[^\W\d_]{3,}(?:[ _-][\w ]*)?|[0-9]{0,3}|.*[^\W\d_]{4}.*")
VALUE = re.compile(r"[+-]?[0-9][0-9.,]*\s*[^\W\d_]+")  # a number with a unit
_WORDS = re.compile(r"[\s_:;=|]+")
LONGEST_NAME = 200  # characters; a longer cell is no name
SURE = 2  # letters of a unit that is no other word
_DASH = "[-\u2010-\u2015\u2212]"
_SIGN = re.compile(
    rf"\u2212|^[\s(\[]*{_DASH}\s*(?=[^\W\d_(])|(?<=[\s(,;]){_DASH}(?=[^\W\d_])|\(\s*{_DASH}\s*\)"
    r"|[*×·÷^√±]\s*[-+]?(?:[0-9][0-9.,]*|(?=[\w(]))|[0-9)]\s*[*×·÷^]|/\s*[0-9]+(?![0-9.]*\s*[^\W\d_])|[0-9]+\s*[:/]\s*[0-9]+"
    r"|(?<=[\s)\](,;])[xX]\s*[0-9]+|(?<!\w)[0-9]+(?:[xX]| x)(?!\w)|(?:(?<![^\W_])[0-9]*)[eE]\s*[-+][0-9]+"
    r"|(?i:(?<![^\W_])(?:inver[st]\w*|flip\w*|neg(?:ative|ated)?|down(?:wards?)?|upside)(?![^\W_]))"
)
_SETTING = re.compile(
    r"(?:(?<![^\W_])[^\W\d_][\w.'\u2019-]*\s+){0,3}?(?:(?<![^\W_])[^\W\d_][\w.'\u2019-]*\s*[:=/]?\s*)?"
    r"(?<![0-9.,])[+-]?[0-9][0-9.,]*\s*(?P<unit>[^\s\d,;()\[\]]+)"
)
_NUMBERED = re.compile(
    r"(?i)[^\W\d_]+[\s_#№.-]*[0-9]+(?!\w|[.,]?[-0-9])|(?<!\w)[1-3]d(?!\w)|^[\s(#]*[0-9]{1,2}\s*[:.)]\s*(?=[^\W\d_])"
)
_NUMBER = re.compile(r"[-+]?[0-9][\w.,+-]*")
_WORD = re.compile(r"[^\W\d_]+")
HARMLESS = re.compile(
    r"(?i:[a-z]|total|measured|data|values?|axis|coord\w*|ch|channels?|signals?|sensor|probe|stylus|laser|surface|texture|"
    r"samples?|sections?|traces?|tracks?|runs?|steps?|left|right|mean|average|relativ\w*|rel|above|(?:un)?filter\w*|"
    r"(?:un)?gefiltert\w*|smoothed|level+ed|detrended|corrected|waviness|wert\w*|achse|koordinate|valeurs?|axe|brute?|"
    r"rauheit\w*|rugosit\w*|roh\w*|messung|spur|col|column|curve|iso|din|of|the|in|and|de|du|der|des|di)"
)
"""Words beside a name of heights that leave the numbers heights, upwards, in the stated unit."""


@dataclass(frozen=True, slots=True)
class Column:
    """A column of the numbers.

    name: as the header has it, or "".
    unit: a key of UNITS, "pixel", or None if the header states none.
    of_else: the whole cell, if it states what is no unit of length; else "".
    doubt: what of the cell is not understood, as the beginning of a sentence, or "".
    """

    name: str = ""
    unit: str | None = None
    of_else: str = ""
    doubt: str = ""

    @property
    def role(self) -> str:
        """One of "index", "x", "y", "height", "other" and "", told from the name."""
        lengths = (("x", ALONG), ("y", ACROSS), ("height", HEIGHT))
        name = self.name.strip()
        role = next((role for role, names in (("index", INDEX), *lengths) if names.fullmatch(name)), "")
        without_number = re.sub(r"[\s_#.-]*[0-9]+$", "", name)
        role = role or next((role for role, names in lengths if names.fullmatch(without_number)), "")
        return role or ("other" if OPTICAL.fullmatch(name) else "")


def is_height(name: str) -> bool:
    """Return whether a name has a word for heights (y is one above two columns), and none for depths."""
    words = re.findall(r"[^\W\d_]+", name)
    is_known = any(names.fullmatch(word) for word in words for names in (HEIGHT, ACROSS))
    return is_known and not DEPTH.fullmatch(name)


def column_of(cell: str) -> Column:
    """Return the column that a cell of the header names."""
    if len(cell) > LONGEST_NAME:
        return Column(cell)
    name, unit, understood, rest = _in_brackets(cell) if BRACKET.search(cell) else _by_words(cell)
    is_angle = ANGLE.fullmatch(name.strip()) and unit not in UNITS
    if not understood or is_angle:
        return Column(name, None, cell)
    if sign := sign_or_number(rest, unit is not None, NOT_LENGTHS):
        return Column(name, None, cell, _doubt(cell, sign))
    may_be_height = is_height(name) or HEIGHT.fullmatch(name.strip())
    words = unknown_words(rest, NOT_LENGTHS, (HEIGHT, ALONG, ACROSS, INDEX)) if may_be_height else ""
    return Column(name, unit, doubt=_doubt(cell, words))


def _doubt(cell: str, remainder: str) -> str:
    return f"a column {cell[:60]!r}, in which {remainder[:60]!r} is not understood" if remainder else ""


def unit_alone(cell: str) -> str | None:
    """Return the unit of a cell that is nothing else, such as "[mm]"."""
    inner = cell.strip(" []()<>{}")
    return unit_named(inner) or ("pixel" if PIXELS.fullmatch(inner) and inner != cell else None)


def is_other_unit(cell: str) -> bool:
    """Return whether a cell of a row of units is no unit of length: "deg", or a factor such as "10 nm"."""
    inner = cell.strip(" []()<>{}")
    if unit_named(inner):  # nm, which is newton metres in other letters
        return False
    return bool(NOT_LENGTHS.fullmatch(inner) or OTHER_LENGTHS.fullmatch(inner) or VALUE.fullmatch(inner))


def units_beside_names(lines: list[str]) -> list[tuple[str, str]]:
    """Return the role and the unit of each name with a unit in brackets, unless a value stands behind it."""
    found = []
    for line in lines:
        for match in BRACKET.finditer(line):
            name = re.split(r"[:;,=\t|\])]|\s{2,}", line[: match.start()].strip(" _,;/\"'"))[-1].strip(" #%\"'")
            role, unit = Column(name).role, _unit(match[1])
            behind = line[match.end() :]
            other = re.match(r"[^\t;,|\[({<]*(?P<bracket>[\[({<])?", behind)
            cell = name + match[0] + ("" if not other or other["bracket"] else other[0])
            understood = column_of(cell).unit == unit and not column_of(cell).doubt
            if role in ("x", "y", "height") and unit in UNITS and understood and not IS_VALUED.match(behind):
                found.append((role, str(unit)))
    return found


def _in_brackets(cell: str) -> tuple[str, str | None, bool, str]:
    """Return the name, the unit, whether every bracket was understood, and what remains beside the unit."""
    found = [(match[0][0], match[1]) for match in BRACKET.finditer(cell)]
    name = cell[: cell.index(found[0][0])].strip(" _:,;/")
    if not name and not any(_unit(text) for _, text in found):
        return found[0][1], None, True, cell  # a name in brackets
    units = {unit for _, text in found if (unit := _unit(text))}
    if len({UNITS.get(unit) for unit in units}) > 1:
        return name, None, False, ""
    if not units and all(_is_comment(sign, text, False) for sign, text in found):
        name, unit, understood, rest = _by_words(BRACKET.sub(" ", cell).strip())
        return name, unit, understood, " ".join([rest, *(f"({text})" for _, text in found)])
    of_else = [text for sign, text in found if not _unit(text) and not _is_comment(sign, text, bool(units))]
    rest = BRACKET.sub(lambda match: f" ({_beside_unit(match[1])}) ", cell)
    return name, next(iter(units), None), not of_else, rest


def _beside_unit(text: str) -> str:
    """Return the text of a bracket without its unit."""
    if with_words := UNIT_WITH_WORDS.fullmatch(text):
        return text[with_words.end(1) :] if _unit(text) else text
    return "" if _unit(text) else text


def _unit(text: str) -> str | None:
    """Return the unit of length that `text` is, or "pixel"; A is none."""
    if PIXELS.fullmatch(text):
        return "pixel"
    if with_words := UNIT_WITH_WORDS.fullmatch(text):
        text = with_words[1]
    return unit_named(text) if text != "A" else None


def _is_comment(sign: str, text: str, beside_unit: bool) -> bool:
    """Return whether the text in brackets is certainly no unit of the column."""
    if NOT_LENGTHS.fullmatch(text) or text == "A":
        return False
    if beside_unit:
        return True
    return (sign != "[" or text.isdigit()) and bool(COMMENT_IN_BRACKETS.fullmatch(text)) and not VALUE.match(text)


def _by_words(cell: str) -> tuple[str, str | None, bool, str]:
    """Return the name, the unit, whether it was understood, and what remains, of a cell without brackets."""
    parts = [part.strip() for part in re.split(r"[,;]", cell)]
    for place, part in enumerate(parts):
        name, unit, understood = _last_word(part)
        if not understood or (unit and (name or place)):
            return name or parts[0], unit, understood, ", ".join([*parts[:place], name, *parts[place + 1 :]])
    words = _WORDS.split(re.sub(VALUE, " ", cell))
    lost = [word for word in words[1:] if len(word) >= SURE and word.lower() != "in" and unit_named(word)]
    return cell, None, not lost, cell


def _last_word(part: str) -> tuple[str, str | None, bool]:
    """Return a name without its unit, the unit, and whether it was understood."""
    match = re.fullmatch(r"(.*?)(\s*/\s*|\s+in\s+|[\s_:=|-]+|^)([^\s_:=|/-]+)", part)
    if not match:
        return part, None, True
    name, sign, word = match.groups()
    if re.search(r"(?:^|[\s_])[+-]?[0-9][0-9.,]*$", name):
        return part, None, "/" not in sign  # a value; 1/mm is no length
    unit = _unit(word) if word.lower() != "pixel" else None
    is_alone = not name or unit == "pixel"
    before = re.split(r"[\s_/]+", name)[-1]
    if unit and sign.strip() == "/" and unit_named(before) and len(before) >= SURE:
        return part, None, False  # um/mm
    if unit and not (is_alone and sign.strip() != "/"):
        return name, unit, True
    if unit and is_alone:
        return ("", unit, True) if not name and unit != "pixel" else (part, None, True)
    is_unit = NOT_LENGTHS.fullmatch(word) or word == "A"
    is_stroke = sign.strip() == "/" and name
    sure = is_stroke or (name and re.fullmatch(r"(?i)deg|degrees?|volts?|rad|°|%|[mµu]m/s", word))
    return name if is_unit and sure else part, None, not (is_unit and sure)


def sign_or_number(rest: str, has_unit: bool, is_unit: re.Pattern[str]) -> str:
    """Return the first sign or operator of a remainder, or its first number if the name has a unit; else "".

    is_unit: what else may stand behind a number of a setting.
    """
    rest = unicodedata.normalize("NFKC", rest)
    if arrow := next((sign for sign in rest if "DOWN" in unicodedata.name(sign, "")), ""):
        return arrow
    if sign := _SIGN.search(rest):
        return sign[0].strip(" ()[]") or sign[0]
    number = _NUMBER.search(_NUMBERED.sub(" ", _without_settings(rest, is_unit))) if has_unit else None
    return number[0] if number else ""


def unknown_words(rest: str, is_unit: re.Pattern[str], known: tuple[re.Pattern[str], ...]) -> str:
    """Return the words of a remainder that are neither HARMLESS nor in `known`, separated by commas; else ""."""
    words = _WORD.findall(_without_settings(unicodedata.normalize("NFKC", rest), is_unit))
    return ", ".join(word for word in words if not any(names.fullmatch(word) for names in (HARMLESS, *known)))


def _without_settings(rest: str, is_unit: re.Pattern[str]) -> str:
    """Return a remainder without words that end in a number with a unit."""

    def left(match: re.Match[str]) -> str:
        return " " if unit_named(match["unit"]) or is_unit.fullmatch(match["unit"]) else match[0]

    return _SETTING.sub(left, rest)
