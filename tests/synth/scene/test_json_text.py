"""JSON is read and written in pieces, between which another thread may run, and is the same as Python's."""

from __future__ import annotations

import json
import sys
from collections import Counter
from typing import Any

import pytest

from synth.scene import text
from synth.scene.text import PIECE_NUMBERS, json_text, object_from_text

NUMBERS = [0.1 * n for n in range(5 * PIECE_NUMBERS + 3)]
DOCUMENTS: dict[str, Any] = {
    "empty": {},
    "empty lists": {"a": [], "b": [[]], "c": {"d": {}}},
    "kinds": {"text": 'é "quoted"\n', "none": None, "true": True, "whole": 2**70, "number": -1.5e-300},
    "numbers": {"heights": NUMBERS, "after": 1},
    "points": {"scan": {"trajectory": [[t, -t, 0.3] for t in NUMBERS]}},
    "wide rows": {"rows": [NUMBERS, NUMBERS, []]},
    "rows of unequal length": [[], *([t] * 3 for t in NUMBERS)],
    "tuples": (tuple(NUMBERS), (1, 2)),
    "objects in a list": [{"t": t} for t in NUMBERS],
    "a number": 0.25,
}


@pytest.mark.parametrize("name", DOCUMENTS)
def test_the_text_is_that_of_python(name: str) -> None:
    document = DOCUMENTS[name]
    assert json_text(document) == json.dumps(document, separators=(",", ":")).encode("ascii")


@pytest.mark.parametrize("number", [float("nan"), float("inf")])
def test_a_number_that_json_has_not_is_refused(number: float) -> None:
    with pytest.raises(ValueError, match="not JSON compliant"):
        json_text({"a": [*NUMBERS, number]})


@pytest.mark.parametrize("name", ["numbers", "points", "wide rows"])
def test_no_call_writes_more_than_a_piece_or_a_row(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    written: list[int] = []
    plain = json.JSONEncoder.encode

    def encode(writer: json.JSONEncoder, value: object) -> str:
        written.append(_numbers(value))
        return plain(writer, value)

    monkeypatch.setattr(json.JSONEncoder, "encode", encode)
    json_text(DOCUMENTS[name])
    assert len(written) > 3
    assert max(written) <= (len(NUMBERS) if name == "wide rows" else PIECE_NUMBERS)


def _numbers(value: object) -> int:
    return sum(map(_numbers, value)) if isinstance(value, list) else 1


def test_each_number_is_read_by_a_python_function_before_which_another_thread_may_run() -> None:
    calls: Counter[str] = Counter()

    def watch(frame: Any, event: str, _argument: object) -> None:
        if event == "call" and frame.f_code.co_filename == text.__file__:
            calls[frame.f_code.co_name] += 1

    document = {"numbers": NUMBERS, "whole": list(range(1000))}
    read = json.dumps(document)
    sys.setprofile(watch)
    try:
        found = object_from_text(read)
    finally:
        sys.setprofile(None)
    assert found == document
    assert sum(calls.values()) > len(NUMBERS) + 1000
