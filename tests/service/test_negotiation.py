"""The sound format of an answer."""

from __future__ import annotations

import pytest

from service.http.content_negotiation import choose_format
from service.problems import Problem


@pytest.mark.parametrize(
    ("accept", "expected"),
    [
        (None, "wav"),
        ("", "wav"),
        ("*/*", "wav"),
        ("audio/*", "wav"),
        ("audio/wav", "wav"),
        ("audio/x-wav", "wav"),
        ("audio/flac", "flac"),
        ("application/octet-stream", "f32le"),
        ("application/*", "f32le"),
        ("audio/L16", "l16"),
        ("audio/l16;rate=48000;channels=2", "l16"),
        ('audio/L16; rate="48000"', "l16"),
        ("text/html, audio/flac;q=0.5, audio/wav;q=0.4", "flac"),
        ("audio/*;q=0.3, audio/flac;q=0.2, */*;q=0.1", "wav"),
        ("*/*, audio/wav;q=0", "flac"),
        ("audio/wav;q=0.5, audio/flac;q=0.5", "wav"),
        ("nonsense, audio/flac", "flac"),
        ("audio/wav;q=2, audio/flac", "flac"),
        ("audio/ogg,audio/*;q=0.9,*/*;q=0.1", "wav"),
    ],
)
def test_the_largest_weight_of_accept_wins(accept: str | None, expected: str) -> None:
    assert choose_format(None, accept, 48000, 2) == expected


@pytest.mark.parametrize(
    "accept", ["text/html", "audio/mpeg", "*/*;q=0", "audio/L16;rate=44100", "audio/l16;channels=1"]
)
def test_an_accept_without_a_possible_format_is_refused(accept: str) -> None:
    with pytest.raises(Problem) as refused:
        choose_format(None, accept, 48000, 2)
    assert refused.value.kind == "not-acceptable"
    assert "audio/L16;rate=48000;channels=2" in refused.value.detail


def test_the_parameter_wins_over_accept() -> None:
    assert choose_format("wav24", "audio/flac", 48000, 1) == "wav24"


def test_l16_is_not_offered_above_48_khz() -> None:
    with pytest.raises(Problem):
        choose_format(None, "audio/L16", 96000, 1)
    assert choose_format(None, "audio/L16, audio/wav;q=0.1", 96000, 1) == "wav"


def test_flac_is_not_offered_for_streams_nine_channels_or_a_rate_that_it_cannot_hold() -> None:
    with pytest.raises(Problem):
        choose_format(None, "audio/flac", 48000, 1, endless=True)
    with pytest.raises(Problem):
        choose_format(None, "audio/flac", 48000, 9)
    with pytest.raises(Problem):
        choose_format(None, "audio/flac", 65_537, 1)
