"""What remains of the name of a column once its unit is read, and could change what the numbers mean.

Stage   SURFACES, from files.
Model   A remainder may number a name ("Z1", "Line 3"), state a setting ("cut-off 0.8 mm"), and have words. A sign, an
        operator or a number beyond these refuses the column: "-Z", "Z/50", "Z 1E-3 mm". A word that is not known
        beside a name of heights has to be confirmed by the user: "Height reduction", "Z (um, scaled)".
Source  This project's choice of words.
Limits  A name of unknown words alone is read by its place in the table, with a note (`text_layout`).
"""

from __future__ import annotations

import re
import unicodedata

from synth.surfaces.readers.surface_file import unit_named

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
