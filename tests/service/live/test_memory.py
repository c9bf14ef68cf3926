"""The memory of one live session and of all together is bounded; a session that does not fit is refused."""

from __future__ import annotations

import gc
import weakref

import pytest

from service.live.replay_buffer import KEPT_BYTES, kept_frames
from synth.held_memory import Held
from tests.service.harness import Running, serving, until, warmed_up
from tests.service.live.client import live
from tests.service.plain_engine import PlainEngine
from tests.service.plain_hand import PlainHand
from tests.service.scraping import scrape

QUANTITIES = ["displacement", "velocity", "acceleration"]
MANY = {"output": {"channels": [QUANTITIES[index % 3] for index in range(16)]}}
BLOCK = 48_000
BLOCK_BYTES = BLOCK * 16 * 4


@pytest.mark.parametrize("rate", [8000, 48_000, 192_000])
@pytest.mark.parametrize("block", [16, 480, 48_000])
@pytest.mark.parametrize("channels", [1, 2, 16, 64])
def test_the_kept_past_has_a_bound_in_bytes(rate: int, block: int, channels: int) -> None:
    frame_bytes = 4 * channels
    frames = kept_frames(rate, block, frame_bytes)
    assert frames >= 2 * block
    assert frames * frame_bytes <= max(KEPT_BYTES, 2 * block * frame_bytes)
    assert frames == max(rate, 8 * block) or frames * frame_bytes > KEPT_BYTES - frame_bytes


def test_what_does_not_fit_is_refused_and_fits_once_another_has_ended() -> None:
    with serving(PlainEngine(), live_bytes=9 * BLOCK_BYTES) as running:
        with live(running) as first, live(running) as second:
            first.hello(scene=MANY, block=BLOCK)
            second.hello(scene=MANY, block=BLOCK)
            assert used(running) == 8 * BLOCK_BYTES
            with live(running) as third:
                third.say("hello", scene=MANY, block=BLOCK)
                told = third.until("problem")
                assert told["problem"] == "/docs#problem-full" and "RIDGEWAVE_LIVE_BYTES" in told["detail"]
                third.rest()
                assert third.code == 1013
            first.say("stop")
            first.rest()
        until(lambda: used(running) <= 4 * BLOCK_BYTES)
        with live(running) as fourth:
            fourth.hello(scene=MANY, block=BLOCK)


def test_voices_count_and_a_stream_beyond_them_is_refused_with_bytes_and_setting(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(PlainHand, "memory", Held(small=600_000))
    with serving(PlainEngine(), live_bytes=1 << 20) as running:
        with live(running) as first, live(running) as second:
            first.hello()
            assert 600_000 < used(running) < 1 << 20
            second.say("hello")
            told = second.until("problem")
            assert told["problem"] == "/docs#problem-full"
            assert (
                f"of {1 << 20} bytes (RIDGEWAVE_LIVE_BYTES)" in told["detail"]
                and "needs 795840 bytes" in told["detail"]
            )
            second.rest()
            assert second.code == 1013
            first.say("scene", scene={"texture": {"period": 0.001}})
            assert "RIDGEWAVE_LIVE_BYTES" in first.until("problem")["detail"]
            first.say("stop")
            first.rest()
        until(lambda: used(running) == 0)
        assert running.client.post("/v1/sessions", json={}).status_code == 201


def test_what_voices_share_counts_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(PlainHand, "memory", Held(large={1: 600_000}))
    with serving(PlainEngine(), live_bytes=2 << 20) as running, live(running) as first, live(running) as second:
        first.hello()
        alone = used(running)
        second.hello()
        assert used(running) - alone == alone - 600_000


@pytest.mark.parametrize("ends", ["stop", "hangs up"])
def test_an_ended_session_frees_its_voice_at_once(ends: str) -> None:
    """Not when the garbage collector finds its cycles: a voice over an area holds 80 MB."""
    engine = PlainEngine()
    with serving(engine, resume=0.1) as running:
        warmed_up(running, engine)
        gc.collect()
        gc.disable()
        try:
            with live(running) as client:
                client.hello()
                voice = weakref.ref(engine.hands.pop())
                assert voice() is not None
                if ends == "stop":
                    client.say("stop")
                    client.rest()
            until(lambda: voice() is None)
        finally:
            gc.enable()


def test_recordings_end_where_the_memory_does(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tests.service.plain_hand.EVENT_BYTES", 1 << 19)
    engine = PlainEngine()
    with serving(engine, live_bytes=1 << 20) as running, live(running) as client:
        client.hello(record=True)
        hand = engine.hands[-1]
        for seq in range(4):
            client.contact(seq)
            client.say("more", frames=480)
            client.frames(480 * (seq + 1))
        until(lambda: hand.ended_recording)


def test_the_oldest_recordings_of_ended_sessions_go_where_the_memory_does(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("service.live.live_stream.LiveStream.recording", lambda _stream: bytes(400_000))
    with serving(PlainEngine(), live_bytes=1 << 20) as running:
        names = []
        for _ in range(4):
            with live(running) as client:
                names.append(client.hello(record=True)["session"])
                client.say("stop")
                client.rest()
        paths = [f"/v1/sessions/{name}/recording" for name in names]
        until(lambda: [running.client.get(path).status_code for path in paths] == [404, 404, 200, 200])


def used(running: Running) -> float:
    return scrape(running.client).value("live_bytes")
