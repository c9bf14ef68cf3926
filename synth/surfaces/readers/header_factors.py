"""Statements in a header that change what the numbers mean: factors, and heights that count downwards.

Stage   SURFACES, from files.
Model   A factor is a word such as "scale factor", "gain" or "Skalierung" with a number other than 1; a unit with a
        number ("Unit: 0.1 um"); a length of one count ("0.1 um/LSB"); or a multiplication of the heights.
        An inversion is "positive down", "inverted: yes" and the like. Both refuse the file: a factor may be applied
        already, and only the user knows. `column_names` checks the names of columns.
Source  This project's choice of words.
Limits  "Gain" and "magnification" count only alone or with a word for the heights: microscopes state those of optics.
"""

from __future__ import annotations

import re

from synth.surfaces.readers.surface_file import refuse_file

_NUMBER = r"(?P<number>(?<![0-9])[+-]?(?:[0-9]+(?:[.,][0-9]*)?|[.,][0-9]+)(?:[eE][+-]?[0-9]{1,4})?)"
_BEHIND = r"(?P<more>\s*(?:\^|:|\*\*)\s*[+-]?[0-9.]+|\s*[%x×]?)"
_HEIGHTS = r"(?:z|y|heights?|vertical|signal|probe|gauge|amplifier|raw|data|values?|numbers?|höhen?|werte?|hauteurs?)"
_COUNT = r"(?:digits?|counts?|bits?|lsb|adu|dn|gr[ae]y ?(?:levels?|values?)|increments?|inkrement)"
_LENGTH = r"(?:[numµμk]?m|Å|inch|mil|microns?|[a-zµ]*met(?:er|re)s?)"
_FACTOR = (
    r"(?:[\w-]{0,20}scal(?:e|ing)(?:[\s_-]*(?:factor|z|height|data))?|[\w-]{0,20}(?:faktor|factor|facteur|fattore)|skalierung|échelle|echelle|"
    r"escala|scala|multiplier|multiplikator|divisor|conversion|umrechnung|sensitivity|empfindlichkeit|"
    r"(?:bit|lsb|count|digit|dac|adc|raw)s?[\s_-]?(?:2|to)[\s_-]?[nuµm]m)"
)
_ALONE = (
    r"(?:gain|amplif\w*|[\w-]{0,20}verst(?:ä|ae)rkung|magnification|[\w-]{0,20}vergr(?:ö|oe)(?:ß|ss)erung|(?:ü|ue)berh(?:ö|oe)hung|"
    r"exaggeration|grossissement|guadagno|ganancia|усиление|масштаб|ma(?:ß|ss)stab|коэффициент|倍率)"
)
_OTHER_FACTOR = re.compile(
    r"(?i)(?:^|[\s_-])(?:full|q|quality|crest|form|fill|duty|damping|power|shape|safety|colou?r|grey|gray|bar|font)[\s_-]*"
    r"(?:factor|faktor|scale)|scale[\s_-]*bar|\b(?:objekti[vf]|objective|okular|ocular|lens|linse)|^\W*(?:optical|objective|lens|total)?\s*(?:magnification|vergr(?:ö|oe)(?:ß|ss)erung|grossissement|倍率)"
    r"\W*[0-9.,]+\s*[x×]"
)
_SIGN = r"(?:\s*[\[(][^\])]*[\])])?(?:[\s_-]+[^\W\d]+){0,4}\s*(?:[:=\t;,|]|\bis\b)\s*"
STATEMENTS = tuple(
    re.compile(f"(?i){words}")
    for words in (
        rf"(?<![^\W\d_]){_FACTOR}(?:{_SIGN}|\s+){_NUMBER}{_BEHIND}",
        rf"(?:^|[;,|])[\s#%!'/*]*(?:{_HEIGHTS}[\s_-]*(?:axis[\s_-]*)?)?{_ALONE}(?:{_SIGN}|\s+)[x×]?\s*{_NUMBER}{_BEHIND}",
        rf"\bunits?[^:=0-9]{{0,25}}[:=\s]\s*{_NUMBER}(?P<more>(?:\s*(?:\^|\*\*)\s*[+-]?[0-9]+)?)\s*[*·x×]?\s*{_LENGTH}\b",
        rf"\b(?:einheit|unité)(?:en|s)?[^:=0-9]{{0,25}}[:=\s]\s*{_NUMBER}(?P<more>)\s*[*·x×]?\s*{_LENGTH}\b",
        rf"(?:\bper|/|\bpro|\bpar|\bone|\b1)\s*{_COUNT}\b[\])]?\s*(?:[:=;,\t]|is|are)\s*{_NUMBER}{_BEHIND}",
        rf"\b{_COUNT}(?:\s+[^\W\d]+)?[\s:=]+{_NUMBER}(?P<more>)\s*{_LENGTH}\b",
        rf"\b{_HEIGHTS}\s+(?:[^\W\d]+\s+)?(?:in|as)\s+{_NUMBER}(?P<more>(?:\s*/\s*[0-9]+)?)\s*{_LENGTH}\b(?!\s*(?:step|inter))",
        rf"(?<![^\W\d_]){_FACTOR}\s+(?:of|by|von|de)\s+{_NUMBER}{_BEHIND}",
        rf"(?<![^\W\d_]){_FACTOR}\b.*\bz\s*[:=]\s*{_NUMBER}{_BEHIND}",
        rf"{_NUMBER}(?P<more>)\s*{_LENGTH}\s*(?:/|per|pro|par)\s*(?:1\s*)?{_COUNT}\b",
        rf"\b{_COUNT}\s*(?:/|per|pro|par)\s*{_LENGTH}\b[\])]?\s*[:=;,\t]?\s*{_NUMBER}(?P<more>)",
        rf"\b(?:multipl\w*|divid\w*|multipliziert\w*)\s+(?:\w+\s+){{0,2}}?(?:with|by|mit|par|durch)?\s*{_NUMBER}{_BEHIND}",
        rf"\b{_HEIGHTS}\s*[*×·/]\s*{_NUMBER}{_BEHIND}",
        rf"{_NUMBER}(?P<more>)\s*[*×·]\s*(?:{_HEIGHTS}|{_COUNT})\b",
        rf"[\])] *[*×x/] *{_NUMBER}\b(?! *[\[(]){_BEHIND}",
        rf"[\])] *{_NUMBER}(?P<more>\s*:\s*[0-9]+)(?![:0-9])",
    )
)
INVERSION = re.compile(
    r"(?i)positive?\s+(?:is\s+|points?\s+|nach\s+)?(?:down|downwards?|unten|into)\b|(?:down|downwards?)\s+(?:is\s+)?positive"
    r"|\b(?:z|height|vertical)[\s_-]*(?:axis|direction|achse)?\s*(?:[:=\t;,]|is|points?)\s*(?:is\s+|points?\s+)?(?:down|unten|into)\w*"
    r"|\b(?:z[\s_-]*)?(?:inver(?:t|ted|sion|se)|flipped|negated|invertiert|inversé|upside[ -]?down)"
    r"\s*(?:z|heights?|data)?\s*(?:[:=\t;,]|is)\s*(?:yes|true|1|on|ja|oui|si|y)\b"
    r"|\(\s*(?:z\s+)?(?:inverted|flipped|negated|invertiert|downwards?|inv\.?)\s*\)"
    r"|\b(?:data|heights?|values?|numbers?|z)\s+(?:is|are|were|was)\s+(?:\w+\s+)?(?:depths?|inverted|negated|flipped|upside)\b"
    r"|\b(?:data|heights?|z|orientation|direction)\s*[:=\t;,]\s*(?:is\s+)?(?:inverted|negated|flipped|upside|depths?\b)"
    r"|\b(?:depth|valley|pit|groove|dent|hole)s?\s+(?:is\s+|are\s+)?positive|positive\s+(?:depth|valley|pit|groove|dent|hole)s?\b"
    r"|\b(?:sign|polarity|vorzeichen)\s*[:=\t;,]\s*(?:neg\w*|-|inver\w*|rever\w*)"
)


def check_statements(lines: list[str]) -> None:
    """Raise InvalidRequest if a line of the header states a factor other than 1, or heights that count downwards."""
    for line in lines:
        text = line.replace('"', "").strip()
        if INVERSION.search(text):
            refuse_file(
                f"heights that count downwards: {text[:60]!r}",
                "heights that count upwards",
                "Change the sign of the heights if it is not done, and remove the line or the word.",
            )
        if _OTHER_FACTOR.search(text):
            continue
        if any(_is_factor(match) for pattern in STATEMENTS for match in pattern.finditer(text)):
            refuse_file(
                f"a header that states a factor: {text[:60]!r}",
                "heights without a factor",
                "Multiply the numbers by it, or export without it. Then remove the line.",
            )


def _is_factor(match: re.Match[str]) -> bool:
    more = match["more"].strip()
    number = float(match["number"].replace(",", "."))
    if more == "%":
        return number != 100.0
    return number != 1.0 or (len(more) > 1 and more.lstrip(":^* ").strip() not in ("1", "1."))
