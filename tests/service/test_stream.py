"""Streams from a real server: sizes, pacing, one reader, changes, ends. The plain engine's sound is known exactly."""

from __future__ import annotations

import io
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import httpx
import numpy as np
import numpy.typing as npt
import pytest
import soundfile

from synth.encode.formats import SoundFormat, quantise
from synth.scene.scene import parse_scene
from tests.file_metadata import read_metadata
from tests.service.harness import Running, problem, serving, until
from tests.service.plain_engine import FULL_SCALE, LEVEL, PlainEngine, PlainLive

RATE = 48000
FADE = round(0.01 * RATE)
STEEPEST = LEVEL * 2 * np.pi * 100.0 / RATE  # largest step of the default scene's 100 Hz, from frame to frame


def live(frames: int) -> npt.NDArray[np.float32]:
    """Return the first frames of the default scene's live voice."""
    return PlainLive(parse_scene({})).render(frames)[:, 0]


def closing(frames: int) -> npt.NDArray[np.float32]:
    """Return the gain of the fade that ends a stream."""
    return np.asarray(0.5 + 0.5 * np.cos(np.pi * np.arange(1, frames + 1) / frames), dtype=np.float32)


def test_a_finite_stream_has_its_exact_length_and_fades_out(running: Running) -> None:
    session = running.open_session()
    answer = running.client.get(f"/v1/sessions/{session}/stream?duration=0.3&format=wav")
    assert int(answer.headers["content-length"]) == len(answer.content)
    samples, rate = soundfile.read(io.BytesIO(answer.content), dtype="float32")
    wanted = live(round(0.3 * RATE))
    wanted[-FADE:] *= closing(FADE)
    assert rate == RATE
    np.testing.assert_allclose(samples, wanted, rtol=0, atol=1e-7)
    assert samples[-1] == 0.0


@pytest.mark.parametrize("duration", [0.001, 0.005, 0.0100001, 0.02])
def test_the_shortest_streams_are_whole_too(running: Running, duration: float) -> None:
    session = running.open_session()
    answer = running.client.get(f"/v1/sessions/{session}/stream?duration={duration}&format=f32le")
    assert len(answer.content) == 4 * round(duration * RATE) == int(answer.headers["content-length"])


def test_a_stream_of_an_odd_number_of_bytes_is_padded(running: Running) -> None:
    session, frames = running.open_session(), 481
    answer = running.client.get(f"/v1/sessions/{session}/stream?duration={frames / RATE}&format=wav24")
    assert len(answer.content) == int(answer.headers["content-length"])
    assert len(answer.content) % 2 == 0 and answer.content[-1:] == b"\0"
    assert len(soundfile.read(io.BytesIO(answer.content))[0]) == frames


@pytest.mark.parametrize("name", [str(kind) for kind in SoundFormat if kind is not SoundFormat.FLAC])
def test_an_endless_stream_opens_as_its_format_does(running: Running, name: str) -> None:
    session = running.open_session()
    sound_format = SoundFormat(name)
    with running.client.stream("GET", f"/v1/sessions/{session}/stream?format={name}") as answer:
        assert "content-length" not in answer.headers
        assert answer.headers["transfer-encoding"] == "chunked"
        assert answer.headers["ridgewave-format"] == f"{name};rate=48000;channels=1"
        start = b""
        for part in answer.iter_raw():
            start += part
            if len(start) > 20_000:
                break
    if sound_format.container == "wav":
        assert start[4:8] == b"\xff\xff\xff\xff"
        metadata = read_metadata(start)
        assert metadata is not None and metadata.full_scale == (FULL_SCALE,)
        at = start.index(b"data") + 8
        assert start[at - 4 : at] == b"\xff\xff\xff\xff"
        start = start[at:]
    count = 9600 // 4
    wanted = live(count)[:, np.newaxis]
    if sound_format.is_float:
        assert start[: 4 * count] == wanted.astype("<f4").tobytes()
    elif name in ("wav16", "l16"):
        assert start[: 2 * count] == quantise(wanted, 16).astype("<i2" if name == "wav16" else ">i2").tobytes()


def test_accept_chooses_and_flac_does_not_stream(running: Running) -> None:
    session = running.open_session()
    path = f"/v1/sessions/{session}/stream"
    assert running.client.head(path, headers={"Accept": "audio/L16"}).headers["content-type"].startswith("audio/L16")
    problem(running.client.get(path, headers={"Accept": "audio/flac"}), 406, "not-acceptable")
    for query in ("format=flac", "format=flac&duration=0.1"):
        (fault,) = problem(running.client.get(f"{path}?{query}"), 422, "request-refused")["errors"]
        assert fault["pointer"] == "?format" and fault["hint"].startswith("Write wav24")


@pytest.mark.parametrize("query", ["duration=0", "duration=-1", "duration=nan", "duration=inf", "duration=3601", "x=1"])
def test_a_wrong_parameter_is_refused_and_the_reader_slot_stays_free(running: Running, query: str) -> None:
    session = running.open_session()
    document = problem(running.client.get(f"/v1/sessions/{session}/stream?{query}"), 422, "request-refused")
    assert document["errors"][0]["pointer"] == "?" + query.partition("=")[0]
    assert running.reader_of(session) is False


def test_head_tells_the_headers_and_claims_nothing(running: Running) -> None:
    session = running.open_session()
    endless = running.client.head(f"/v1/sessions/{session}/stream")
    assert endless.status_code == 200 and "content-length" not in endless.headers
    finite = running.client.head(f"/v1/sessions/{session}/stream?duration=1&format=f32le")
    assert finite.headers["content-length"] == str(4 * RATE)
    assert running.reader_of(session) is False


def test_a_stream_keeps_real_time_ahead_by_the_lead(running: Running) -> None:
    """1.5 s of sound with a lead of 0.25 s take 1.25 s: not earlier by a block, however fast the reader."""
    session = running.open_session()
    began = time.perf_counter()
    with running.listening(session) as listener:
        listener.frames(round(1.5 * RATE))
    took = time.perf_counter() - began
    assert took >= 1.25 - 0.021


def test_a_second_reader_is_refused_until_the_first_has_left(running: Running) -> None:
    session = running.open_session()
    with running.listening(session) as listener:
        listener.frames(480)
        assert running.reader_of(session) is True
        problem(running.client.get(f"/v1/sessions/{session}/stream"), 409, "busy")
        listener.frames(480)
    until(lambda: running.reader_of(session) is False)
    with running.listening(session) as listener:
        np.testing.assert_array_equal(listener.frames(4800), live(4800))


def test_a_reader_that_comes_while_the_one_before_leaves_is_let_in(running: Running) -> None:
    session = running.open_session()
    for _ in range(5):
        with running.listening(session) as listener:
            listener.frames(480)


def test_a_reader_that_leaves_is_noticed_at_once_and_costs_nothing_more(running: Running) -> None:
    session = running.open_session()
    with running.listening(session) as listener:
        listener.frames(4800)
    until(lambda: running.reader_of(session) is False)
    held = running.service.sessions.find(session, None)
    assert held.reader is None and not held.active


def test_a_change_is_heard_within_the_lead_and_without_a_step(running: Running) -> None:
    session = running.open_session()
    began = time.perf_counter()  # no later than the stream's own clock
    with running.listening(session) as listener:
        before = listener.frames(RATE // 2)
        answer = running.client.patch(f"/v1/sessions/{session}", json={"scan": {"speed": "160 mm/s"}})
        patched = time.perf_counter() - began
        assert answer.status_code == 200
        after = listener.frames(round((patched + 1.0) * RATE))  # a busy machine answers late
    heard = np.concatenate([before, after])
    changed = int(np.argmax(heard != live(len(heard)))) / RATE
    assert changed <= patched + answer.json()["heard_within"]
    assert np.abs(np.diff(heard)).max() <= 2 * STEEPEST * 1.01  # 200 Hz is the steeper of the two steady waves
    settled = PlainLive(parse_scene({"scan": {"speed": "160 mm/s"}}))
    settled.render(len(heard) - 960)
    np.testing.assert_allclose(heard[-960:], settled.render(960)[:, 0], atol=1e-6)


def test_two_changes_at_once_end_in_the_last(running: Running) -> None:
    session = running.open_session()
    with running.listening(session) as listener:
        listener.frames(4800)
        for speed in (0.1, 0.12, 0.14):
            assert running.client.patch(f"/v1/sessions/{session}", json={"scan": {"speed": speed}}).status_code == 200
        listener.frames(RATE)
        tail = listener.frames(960)
    settled = PlainLive(parse_scene({"scan": {"speed": 0.14}}))
    settled.render(4800 + RATE)
    np.testing.assert_allclose(tail, settled.render(960)[:, 0], atol=1e-6)


def test_a_deleted_session_fades_its_stream_and_ends_it_properly(running: Running) -> None:
    session = running.open_session()
    with running.listening(session) as listener:
        heard = listener.frames(RATE // 2)
        assert running.client.delete(f"/v1/sessions/{session}").status_code == 204
        heard = np.concatenate([heard, listener.rest()])
    wanted = live(len(heard))
    wanted[-FADE:] *= closing(FADE)
    np.testing.assert_allclose(heard, wanted, rtol=0, atol=1e-7)
    assert np.abs(np.diff(heard)).max() <= STEEPEST + LEVEL * np.pi / 2 / FADE


def test_a_finite_stream_that_is_ended_early_is_filled_with_silence(running: Running) -> None:
    session = running.open_session()
    with running.listening(session, "format=wav&duration=60") as listener:
        listener.frames(RATE // 2)
        began = time.perf_counter()
        assert running.client.delete(f"/v1/sessions/{session}").status_code == 204
        rest = listener.rest()
    assert time.perf_counter() - began < 50.0, "it was waited for, as if it were sound"
    assert not rest[RATE:].any() and len(rest) > 59 * RATE


def test_a_stream_waits_for_a_voice_that_is_slow_to_open(running: Running, engine: PlainEngine) -> None:
    """A session that is deleted meanwhile answers 404, and no stream starts."""
    session = running.open_session()
    with running.listening(session) as listener:
        listener.frames(480)
    until(lambda: running.reader_of(session) is False)
    engine.gate = threading.Event()
    answers = []
    thread = threading.Thread(
        target=lambda: answers.append(running.client.get(f"/v1/sessions/{session}/stream?duration=1"))
    )
    count = len(engine.opened)
    thread.start()
    until(lambda: len(engine.opened) > count)
    assert running.client.delete(f"/v1/sessions/{session}").status_code == 204
    engine.gate.set()
    thread.join(60.0)
    problem(answers[0], 404, "not-found")


def test_an_idle_session_expires_by_itself_and_a_streaming_one_does_not() -> None:
    with serving(PlainEngine(), session_idle=1.0) as running:
        silent, heard = running.open_session(), running.open_session()
        with running.listening(heard) as listener:
            listener.frames(2 * RATE)
            assert running.client.get(f"/v1/sessions/{silent}").status_code == 404
            assert running.client.get(f"/v1/sessions/{heard}").json()["expires_in"] is None
        until(lambda: len(running.service.sessions) == 0)


def test_many_streams_keep_time_together(running: Running) -> None:
    """Twenty streams of one process, each at its own deadlines: none falls behind by more than its lead."""

    def listen(session: str) -> float:
        with httpx.Client(base_url=running.url, timeout=60.0) as client:
            began = time.perf_counter()
            answer = client.get(f"/v1/sessions/{session}/stream?duration=1&format=l16")
            assert len(answer.content) == 2 * RATE
            return time.perf_counter() - began

    sessions = [running.open_session() for _ in range(20)]
    with ThreadPoolExecutor(20) as pool:
        took = list(pool.map(listen, sessions))
    assert min(took) >= 0.75 - 0.041 and max(took) < 15.0  # one after the other they would take 15 s
