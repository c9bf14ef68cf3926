"""What fields may be together: each rule at both of its sides, with the words of docs/scene.md that state it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from synth.scene.output_section import MOST_CHANNELS
from synth.scene.scene import parse_scene
from synth.scene.trajectory import FEWEST_POINTS, MOST_POINTS
from synth.voice.voice import open_voice
from tests.synth.engine_cases import QUANTITIES, scene_of
from tests.synth.scene.scene_cases import RISING, faults_of
from tests.test_scene_docs import PAGE

WORDS = " ".join(PAGE.split())


def stroke(**fields: float) -> dict[str, Any]:
    return {"scan": {"stroke": fields}}


def points(step: float, speed: float, count: int = 4) -> dict[str, Any]:
    return {"scan": {"trajectory": [[1.0 + i * step, i * step * speed, 0.3] for i in range(count)]}}


SIDES: dict[str, tuple[dict[str, Any], dict[str, Any], str, str]] = {
    "a turn fits into its stroke": (
        stroke(length=0.01, speed=0.1, turn_time=0.16), stroke(length=0.01, speed=0.1, turn_time=0.1600001),
        "/scan/stroke/turn_time", "`turn_time` is at most 1.6 `length` / `speed`",
    ),
    "a turn fits into the longest stroke": (
        stroke(length=10.0, speed=10.0, turn_time=1.6), stroke(length=10.0, speed=10.0, turn_time=1.6 * (1 + 1e-8)),
        "/scan/stroke/turn_time", "`turn_time` is at most 1.6 `length` / `speed`",
    ),
    "a stroke has room for the shortest turns": (
        stroke(length=0.00625, speed=10.0), stroke(length=0.00624, speed=10.0),
        "/scan/stroke/length", "a stroke without room for its turns",
    ),
    "a fade is half the duration": (
        {"output": {"duration": 3.0, "fade": 1.5}}, {"output": {"duration": 3.0, "fade": np.nextafter(1.5, 2.0)}},
        "/output/fade", "at most half the duration",
    ),
    "the longest fade": (
        {"output": {"duration": 120.0, "fade": 60.0}},
        {"output": {"duration": float(np.nextafter(120.0, 0.0)), "fade": 60.0}},
        "/output/fade", "at most half the duration",
    ),
    "points a microsecond apart": (
        points(1e-6, 0.01), points(0.998e-6, 0.01), "/scan/trajectory/1/0", "rise by at least 1 us from one point",
    ),
    "points at 10 m/s": (
        points(0.125, 10.0), points(0.125, 10.0000001), "/scan/trajectory/1/1", "between two points is 10 m/s at most",
    ),
    "the fewest points": (
        points(0.1, 0.1, FEWEST_POINTS), points(0.1, 0.1, FEWEST_POINTS - 1), "/scan/trajectory", "2 to 1000000 points",
    ),
    "one channel": (
        {"output": {"channels": ["velocity"]}}, {"output": {"channels": []}}, "/output/channels", "a list of 1 to 16",
    ),
    "sixteen channels": (
        {"output": {"channels": ["velocity"] * MOST_CHANNELS}},
        {"output": {"channels": ["velocity"] * (MOST_CHANNELS + 1)}},
        "/output/channels", "a list of 1 to 16",
    ),
    "a rate is a whole number": (
        {"output": {"sample_rate": 44100.0}}, {"output": {"sample_rate": 44100.5}},
        "/output/sample_rate", "1000 Hz to 192000 Hz, a whole number",
    ),
    "an amplitude or a roughness": (
        {"texture": {"roughness": 1e-6}}, {"texture": {"roughness": 1e-6, "amplitude": 1e-6}},
        "/texture/roughness", "an amplitude and a roughness for the same surface",
    ),
    "a speed or a stroke": (
        stroke(speed=0.1), {"scan": {"speed": 0.1, "stroke": {}}}, "/scan/speed", "two kinds of scan at once",
    ),
    "a stroke or a trajectory": (
        {"scan": {"trajectory": RISING}}, {"scan": {"trajectory": RISING, "stroke": {}}},
        "/scan/trajectory", "two kinds of scan at once",
    ),
    "a quantity or channels": (
        {"output": {"channels": ["velocity"]}}, {"output": {"channels": ["velocity"], "quantity": "velocity"}},
        "/output/quantity", "`channels` together with `quantity` or `full_scale`",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", SIDES)
def test_a_rule_holds_on_both_sides_and_the_page_states_it(name: str) -> None:
    inside, outside, pointer, words = SIDES[name]
    parse_scene(inside)
    faults = faults_of(outside)
    assert faults[0].pointer == pointer
    assert faults[0].allowed and faults[0].hint and faults[0].value
    assert words in WORDS


@pytest.mark.thorough
def test_the_most_points_are_read() -> None:
    """It takes some 7 s: a million points."""
    many = [[1e-3 * i, 0.0, 0.3] for i in range(MOST_POINTS)]
    found = parse_scene({"scan": {"trajectory": many}}).scan.trajectory
    assert found is not None and len(found) == MOST_POINTS


def test_more_than_the_most_points_are_refused() -> None:
    faults = faults_of({"scan": {"trajectory": [[0.0, 0.0, 0.3]] * (MOST_POINTS + 1)}})
    assert [fault.pointer for fault in faults] == ["/scan/trajectory"]
    assert str(MOST_POINTS) in faults[0].allowed


@pytest.mark.parametrize("rate", [1000, 8000, 48000])
@pytest.mark.parametrize("scan", [{}, {"stroke": {"length": "10 mm", "turn_time": "50 ms"}}], ids=["steady", "stroke"])
def test_a_bandwidth_above_the_rate_is_accepted_and_does_nothing(rate: int, scan: dict[str, Any]) -> None:
    assert "a value above 0.45 of the sample rate, only the sample rate limits the band" in WORDS
    assert "A bandwidth above the limit of the sample rate is accepted and has no effect" in WORDS

    def block(bandwidth: float | str) -> Any:
        output = {"channels": list(QUANTITIES), "sample_rate": rate, "bandwidth": bandwidth}
        return open_voice(scene_of(scan=scan, output=output, accuracy={"tolerance": 1e-2})).render(2000)

    free = block("full")
    assert free.any()
    for bandwidth in (0.45 * rate, np.nextafter(0.45 * rate, 1e9), 96e3):
        assert np.array_equal(block(float(bandwidth)), free)
    assert not np.array_equal(block(0.2 * rate), free)
