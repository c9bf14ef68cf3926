"""Blocks of numbers in a text file, which empty lines or lines of words divide.

Stage   SURFACES, from files.
Limits  Blocks that comments alone divide are one surface, unless the last two have one length.
"""

from __future__ import annotations

import re
from itertools import count, dropwhile
from pathlib import Path

from synth.surfaces.readers.number_forms import COMMENT, is_missing
from synth.surfaces.readers.surface_file import refuse_file

MARKS = re.compile(r"(?=.*[-*?])[-*?\s;,|]+")  # a line of missing points
OF_BLOCK = re.compile(
    r"(?i)profil|scan|trace|track|line|block|curve|set|run|channel|measure|[0-9]"
)  # words of comments
SHORT_ROW = 3  # cells of a row that may be a point
EMPTY_CELLS = re.compile(r"(?=.*[^\s])[\s;,|\"]+")


def check_blocks(path: Path, codec: str, columns: int, above: int) -> None:
    """Refuse heights without x in blocks that empty lines or lines of words divide: each may be a surface of its own.

    Lists of x, y and z may have an empty line after each row. Empty lines after every line divide nothing. Pages of
    one length, with a shorter last one, are one surface. So are blocks of two lengths that comments divide.

    above: lines of the header.
    """
    lengths, equal, left, held = [0], [0], count(), 0
    with path.open(encoding=codec) as file:
        for line in dropwhile(lambda line: (bool(line.strip()) and next(left) < above) or not line.strip(), file):
            is_number = line[0] in "0123456789+-" or (re.search("[0-9]", line) and not COMMENT.match(line))
            if is_number or MARKS.fullmatch(line) or is_missing(line):
                lengths[-1] += 1 + held
                equal[-1] += 1 + held
                held = 0
                continue
            if EMPTY_CELLS.fullmatch(line):  # a row of missing points, if others follow
                held += 1
                continue
            held = 0
            equal += [0] * bool(equal[-1] and (OF_BLOCK.search(line) or not COMMENT.match(line)))
            lengths += [0] * bool(lengths[-1] and not COMMENT.match(line))
    whole, equal = ([length for length in of if length] for of in (lengths, equal))
    if columns > SHORT_ROW and len(whole) == 2 and whole[0] == 1:
        return  # the coordinates of the columns
    pages = len(whole) > 2 and len(set(whole[:-1])) == 1 and whole[-1] < whole[0]
    if len(whole) < 2 and len(equal) > 1 and 1 < equal[-1] == equal[-2]:
        whole, pages = equal, False
    if columns not in (2, 3) and len(whole) > 1 and max(whole) > 1 and not pages:
        found = f"{len(whole)} blocks of numbers, of {', '.join(map(str, whole[:4]))} lines"
        refuse_file(found, "one block", "Keep the lines of one of them. Write nan for a missing point.")
