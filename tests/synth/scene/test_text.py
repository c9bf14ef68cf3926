"""Scenes as text: what is not one JSON object in UTF-8, and what JSON allows but a scene does not."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from synth.errors import Fault, SceneError
from synth.scene.scene import Scene, parse_scene_text


def text_faults_of(text: str | bytes) -> tuple[Fault, ...]:
    with pytest.raises(SceneError) as refused:
        parse_scene_text(text)
    return refused.value.faults


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "Write {}"),
        (b"", "Write {}"),
        (" \n\t", "Write {}"),
        ("\ufeff", "Write {}"),
        ("{", "Correct the text"),
        ("{'finger': {}}", "Correct the text"),
        ('{"finger": {},}', "Correct the text"),
        ("{} {}", "Correct the text"),
        ("RIFF\x00\x00", "Correct the text"),
        ("[]", "Write an object"),
        ("null", "Write an object"),
        ("3", "Write an object"),
        ("true", "Write an object"),
        ("NaN", "Write an object"),
        ('"grating-1mm-31um"', "Write an object"),
        (b"\xff\xfe{\x00}\x00", "UTF-8"),
        ("[" * 200_000, "levels"),
        ('{"a":' * 100_000, "levels"),
        ('{"texture": {"period": ' + "9" * 5000 + "}}", "range"),
    ],
)
def test_text_that_is_not_one_json_object_is_refused(text: str | bytes, words: str) -> None:
    faults = text_faults_of(text)
    assert [fault.pointer for fault in faults] == [""]
    assert words in faults[0].hint


@pytest.mark.parametrize("number", ["NaN", "Infinity", "-Infinity", "1e999", "-1e999", "1" + "0" * 400])
def test_numbers_that_are_not_finite_are_refused_at_their_field(number: str) -> None:
    faults = text_faults_of(f'{{"texture": {{"period": {number}}}}}')
    assert [fault.pointer for fault in faults] == ["/texture/period"]
    assert "finite" in faults[0].hint


def test_a_field_written_twice_is_refused_at_its_place() -> None:
    text = (
        '{"texture": {"period": 1, "period": 1}, "scan": {}, "scan": {},'
        ' "output": {"channels": [{}, {"a": 1, "a": 2}]}}'
    )
    assert [fault.pointer for fault in text_faults_of(text)] == ["/scan", "/texture/period", "/output/channels/1/a"]


def test_a_byte_order_mark_is_passed_over() -> None:
    assert parse_scene_text(b"\xef\xbb\xbf{}") == Scene()
    assert parse_scene_text("\ufeff{}") == Scene()


@given(st.text() | st.binary())
def test_garbage_text_raises_nothing_but_scene_error(text: str | bytes) -> None:
    try:
        parse_scene_text(text)
    except SceneError as refused:
        assert refused.faults
