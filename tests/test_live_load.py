"""The load generator sees what is wrong: lost blocks, late ones, updates applied backwards, a clock that runs fast."""

from __future__ import annotations

import re
import struct

import numpy as np
import pytest

from tests.bench.live_frames import BINARY, TEXT, FrameError, FrameReader, contact_frames, frame
from tests.bench.live_hand import REACH, Hand
from tests.bench.live_load import Asked, Load
from tests.bench.live_report import Window, lateness
from tests.bench.plain_live import Faults, opening, plain_live

SECONDS, STREAMS = 0.6, 3
BLOCK_SECONDS = 0.01


def run(faults: Faults | None = None) -> dict[str, object]:
    """Return the report of a short run against a server that errs as it is told."""
    with plain_live(faults) as url:
        return Load(Asked(url, streams=STREAMS, seconds=SECONDS, settle=0.1, drain=0.2, scenes=2)).run()


def test_a_server_that_does_right_is_not_blamed() -> None:
    report = run()
    assert (report["mistakes"], report["missing"], report["opened"]) == ([], 0, STREAMS)
    whole = STREAMS * round(SECONDS / BLOCK_SECONDS)
    assert (
        whole - 2 * STREAMS <= int(str(report["blocks_expected"])) <= 1.5 * whole
    )  # a busy machine measures for longer
    latency = report["latency_ms"]
    assert isinstance(latency, dict) and latency["p50"] > 0.0


def test_a_block_that_is_lost_is_seen_by_what_follows_it() -> None:
    report = run(Faults(lost_block=30))
    assert report["mistaken_streams"] == STREAMS
    told = re.findall(r"says frame (\d+), but (\d+) came", str(report["mistakes"]))
    assert told and all(int(frame) - int(came) == 480 and int(frame) >= 14880 for frame, came in told)


def test_updates_that_are_applied_backwards_are_seen() -> None:
    assert "after" in str(run(Faults(backwards=True))["mistakes"])


def test_a_block_that_is_held_back_is_late_by_as_much() -> None:
    late = run(Faults(late_block=40, late_by=0.5))["lateness_ms"]
    assert isinstance(late, dict) and late["max"] >= 250.0  # of 500, less what the clock's zero was late


def test_a_clock_that_runs_fast_is_a_drift() -> None:
    arrivals = np.asarray(5.0 + BLOCK_SECONDS * (1.0 - 1e-3) * np.arange(1000), np.float64)
    came, missing = lateness(arrivals, BLOCK_SECONDS, Window(6.0, 14.0))
    assert missing == 0
    assert came[-1] - came[0] == pytest.approx(-8e-3, rel=0.05)


def test_blocks_that_have_not_come_are_missing() -> None:
    arrivals = np.asarray(5.0 + BLOCK_SECONDS * np.arange(1000), np.float64)
    came, missing = lateness(arrivals[:700], BLOCK_SECONDS, Window(6.0, 14.0))
    assert (len(came), missing) == (600, 200)
    assert np.allclose(came, 0.0)
    assert lateness(np.zeros(0), BLOCK_SECONDS, Window(6.0, 14.0))[1] == 800


@pytest.mark.parametrize("sizes", [[1], [7], [1, 2, 3, 1000], [100_000]])
def test_frames_are_the_same_however_the_network_cuts_them(sizes: list[int]) -> None:
    payloads = [b"", b"a" * 125, b"b" * 126, b"c" * 1920, b"d" * 70_000, b"e"]
    heads = [opening(BINARY, len(one)) for one in payloads if len(one) < 1 << 16]
    heads.insert(4, struct.pack("!BBQ", 0x82, 127, 70_000))
    text = b"".join(head + payload for head, payload in zip(heads, payloads, strict=True))
    reader, found, place, number = FrameReader(), [], 0, 0
    while place < len(text):
        size = sizes[number % len(sizes)]
        found += [held[start:end] for _, start, end, held in reader.frames(text[place : place + size])]
        place, number = place + size, number + 1
    assert found == payloads


@pytest.mark.parametrize("text", [b"\x02\x01a", b"\xc2\x01a", b"\x82\x81abcda", b"\x82\x7f" + b"\xff" * 8])
def test_what_is_no_frame_of_a_server_is_refused(text: bytes) -> None:
    with pytest.raises(FrameError):
        list(FrameReader().frames(text + bytes(20)))


def unmasked(text: bytes) -> bytes:
    """Return the payload of a short masked frame."""
    mask, coded = text[2:6], text[6:]
    return bytes(one ^ mask[index % 4] for index, one in enumerate(coded))


def test_an_update_is_the_28_bytes_of_the_protocol() -> None:
    made = contact_frames(
        7, np.array([1.5, 2.5]), np.array([-0.01, 0.02]), np.array([0.25, 0.5]), np.random.default_rng(1)
    )
    assert len(made) == 2 * 34 and made[:2] == b"\x82\x9c"
    assert struct.unpack("<BBHIddf", unmasked(made[34:])) == (1, 0, 0, 8, 2.5, 0.02, 0.5)
    assert made[2:6] != made[36:40]


def test_a_message_is_one_masked_frame() -> None:
    assert unmasked(frame(TEXT, b'{"type":"stop"}')) == b'{"type":"stop"}'


@pytest.mark.parametrize("smooth", [False, True])
def test_a_hand_strokes_within_its_reach(smooth: bool) -> None:
    times = np.arange(0.0, 20.0, 1e-3)
    position = Hand(3, smooth).position(times)
    assert np.max(position) == pytest.approx(REACH, rel=1e-3) and np.min(position) == pytest.approx(-REACH, rel=1e-3)
    assert np.max(np.abs(np.diff(position))) < 1e-3 * 0.4  # m in a millisecond: below 0.4 m/s
    assert np.all(Hand(3, smooth).load(times) > 0.2)
