"""Read one JSON object from text, strictly; write JSON as text.

Stage: 1 (SCENE). Also used wherever a partial scene is read as text.
Model: Python's readers and writers of JSON are C, and keep the interpreter from every other thread until they return:
    for 30 ms per MB of numbers, in which a service sends no sound. `object_from_text` therefore converts each number in
    a Python function, before which another thread may run (a fifth slower). `json_text` writes PIECE_NUMBERS at a time.
Limits: the text is UTF-8, with or without a byte order mark. NaN and Infinity are read as numbers, and whole numbers of
thousands of digits as Infinity, as 1e999 is. Their fields refuse them later, with an error that is more useful than a
position in the text.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import islice

from synth.errors import Fault, SceneError
from synth.scene.rules import MOST_FAULTS

WANTED = "one JSON object"
PIECE_NUMBERS = 1000  # written at a time: half a millisecond; with fewer, a row of three numbers costs more
_WRITER = json.JSONEncoder(allow_nan=False, separators=(",", ":"))
MOST_DIGITS = 400  # of a whole number; float64 ends at 309


class _Repeated(dict[str, object]):
    """An object in which fields are written more than once. `repeated` lists their names."""

    repeated: tuple[str, ...] = ()


def object_from_text(text: str | bytes) -> dict[str, object]:
    """Return the object that `text` holds.

    Raises SceneError if the text is not exactly one JSON object, or if fields are written twice. It lists the pointer
    of each of these fields.
    """
    decoded = _decoded(text)
    if not decoded.strip():
        raise _refusal("nothing", "Write {} for the default scene.")
    try:
        document, faults = value_from_text(decoded)
    except json.JSONDecodeError as error:
        place = f"line {error.lineno}, column {error.colno}"
        raise _refusal(f"text that is not JSON at {place}", "Correct the text there.") from error
    except RecursionError as error:
        raise _refusal("JSON that is nested too deeply", "A scene needs four levels.") from error
    if not isinstance(document, dict):
        raise _refusal(f"JSON of another kind ({_json_kind(document)})", 'Write an object, such as {"texture": {}}.')
    if faults:
        raise SceneError(faults)
    return document


def value_from_text(
    text: str, at: str = "", constant: Callable[[str], object] | None = None
) -> tuple[object, list[Fault]]:
    """Return the JSON value that `text` holds, and a fault for each field in it that is written twice.

    at: pointer of the value, with which those of the faults begin.
    constant: returns the value of the words NaN, Infinity and -Infinity; None for the numbers.
    Raises ValueError if the text is not JSON, and RecursionError if it is nested too deeply.
    """
    repeated: list[_Repeated] = []
    value = json.loads(
        text,
        object_pairs_hook=lambda pairs: _fields(pairs, repeated),
        parse_float=_float,
        parse_int=_whole,
        parse_constant=constant,
    )
    return value, list(islice(_repetitions(value, at), MOST_FAULTS)) if repeated else []


def json_text(document: object) -> bytes:
    """Return `document` as compact JSON in ASCII. Raises ValueError for NaN and infinity."""
    return "".join(_written(document)).encode("ascii")


def _written(value: object) -> Iterator[str]:
    """Yield the text of `value` in pieces of about PIECE_NUMBERS numbers."""
    if isinstance(value, Mapping):
        for place, (name, item) in enumerate(value.items()):
            yield f"{',' if place else '{'}{_WRITER.encode(name)}:"
            yield from _written(item)
        yield "}" if value else "{}"
    elif isinstance(value, list | tuple) and len(value) > (rows := _rows_of_piece(value)):
        for begin in range(0, len(value), rows):
            yield f"{',' if begin else '['}{_WRITER.encode(value[begin : begin + rows])[1:-1]}"
        yield "]"
    else:
        yield _WRITER.encode(value)


def _rows_of_piece(rows: Sequence[object]) -> int:
    """Return how many of `rows` are written at a time, by the length of the first."""
    first = rows[0] if rows else None
    return max(1, PIECE_NUMBERS // len(first)) if isinstance(first, list | tuple) and first else PIECE_NUMBERS


def pointer(*parts: object) -> str:
    """Return the JSON pointer (RFC 6901) of `parts`. It is safe to print and to encode."""
    return "".join(f"/{_part(part)}" for part in parts)


def _part(part: object) -> str:
    printable = str(part)[:101].encode("utf-8", "backslashreplace").decode("utf-8")
    shortened = printable if len(printable) <= 100 else printable[:97] + "..."
    return shortened.replace("~", "~0").replace("/", "~1")


def _decoded(text: str | bytes) -> str:
    if isinstance(text, str):
        return text.removeprefix("\ufeff")
    try:
        return bytes(text).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise _refusal("bytes that are not UTF-8 text", "Save the scene as JSON in UTF-8.") from error


def _float(digits: str) -> float:
    return float(digits)


def _whole(digits: str) -> int | float:
    return int(digits) if len(digits) <= MOST_DIGITS else float(digits)  # `int` refuses thousands of digits


def _fields(pairs: list[tuple[str, object]], repeated: list[_Repeated]) -> dict[str, object]:
    """Return the object of `pairs`. If a field is written more than once, also add the object to `repeated`."""
    fields = dict(pairs)
    if len(fields) == len(pairs) or len(repeated) >= MOST_FAULTS:
        return fields
    marked = _Repeated(fields)
    count = Counter(name for name, _ in pairs)
    marked.repeated = tuple(name for name in fields if count[name] > 1)
    repeated.append(marked)
    return marked


def _repetitions(value: object, at: str) -> Iterator[Fault]:
    if isinstance(value, _Repeated):
        for name in value.repeated:
            yield Fault(at + pointer(name), "the same field more than once", "each field once", "Keep one of them.")
    if isinstance(value, dict):
        for name, item in value.items():
            yield from _repetitions(item, at + pointer(name))
    elif isinstance(value, list):
        for index, item in enumerate(value):
            yield from _repetitions(item, at + pointer(index))


def _json_kind(value: object) -> str:
    if value is None:
        return "null"
    names = {bool: "true or false", str: "text", list: "a list"}
    return names.get(type(value), "a number")


def _refusal(value: str, hint: str) -> SceneError:
    return SceneError([Fault("", value, WANTED, hint)])
