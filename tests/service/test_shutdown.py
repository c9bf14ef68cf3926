"""SIGTERM and SIGINT with streams open: each ends properly, within two seconds."""

from __future__ import annotations

import signal
import socket
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import httpx
import numpy as np
import pytest
import soundfile

from service.server import listen, run
from synth.errors import CannotRender
from tests.service.harness import PATIENCE, Child, Listener, problem, settings_of, until
from tests.service.live.client import live

PLAIN = "tests.service.serve_plain"


class Follower:
    """Reads a stream in a thread until it ends; `error` is what went wrong, if its end was not proper."""

    def __init__(self, client: httpx.Client, path: str) -> None:
        self.samples = np.zeros(0, np.float32)
        self.error: Exception | None = None
        self.started = threading.Event()
        self.thread = threading.Thread(target=self._run, args=(client, path))
        self.thread.start()

    def _run(self, client: httpx.Client, path: str) -> None:
        try:
            with client.stream("GET", path, timeout=60.0) as answer:
                answer.raise_for_status()
                listener = Listener(answer)
                first = listener.frames(4800)
                self.started.set()
                self.samples = np.concatenate([first, listener.rest()])
        except Exception as error:
            self.error = error


@pytest.mark.alone  # two seconds by the wall's clock, in which every stream gets the processor in time to fade
@pytest.mark.parametrize(("module", "number"), [("service", signal.SIGTERM), (PLAIN, signal.SIGINT)])
def test_a_signal_ends_every_stream_with_a_fade_within_two_seconds(
    tmp_path: Path, module: str, number: signal.Signals
) -> None:
    child = Child(module, tmp_path)
    try:
        url = child.url()
        client = httpx.Client(base_url=url, timeout=PATIENCE)
        sessions = [client.post("/v1/sessions", json={}).json()["stream"] for _ in range(6)]
        followers = [Follower(httpx.Client(base_url=url), f"{session}?format=f32le") for session in sessions]
        assert all(follower.started.wait(60.0) for follower in followers)
        recorded = client.post("/v1/sessions", json={}).json()["id"]
        assert client.post(f"/v1/sessions/{recorded}/play", json={"device": "file:a.wav"}).status_code == 202
        client.close()
        began = time.monotonic()
        child.process.send_signal(number)
        child.process.wait(60.0)
        assert time.monotonic() - began < 2.0
    finally:
        child.end()
    for follower in followers:
        follower.thread.join(60.0)
        assert follower.error is None, "the chunked answer was cut off"
        assert follower.samples[-1] == 0.0
        assert np.abs(follower.samples[-10:]).max() < 0.005 < np.abs(follower.samples[-4800:]).max()
    log = child.log.read_text()
    assert "Traceback" not in log and "Cancel" not in log, log
    assert soundfile.info(tmp_path / "recordings" / "a.wav").samplerate == 48000


@pytest.mark.alone  # as above
@pytest.mark.parametrize("number", [signal.SIGTERM, pytest.param(signal.SIGINT, marks=pytest.mark.thorough)])
def test_a_signal_ends_every_live_stream_with_a_fade_an_end_and_1001(tmp_path: Path, number: signal.Signals) -> None:
    child = Child(PLAIN, tmp_path)
    try:
        url = child.url()
        with live(url) as moving, live(url) as pulling, live(url) as waiting:
            moving.hello(pacing="realtime", block=4800)
            pulling.hello()
            pulling.say("more", frames=48000)
            pulling.frames(48000)
            moving.frames(4800)
            began = time.monotonic()
            child.process.send_signal(number)
            for client in (moving, pulling, waiting):
                pcm = client.rest()
                assert (client.code, client.reason) == (1001, "shutting down")
                assert client.texts("end")[0] == {"type": "end", "reason": "shutting down", "frame": len(pcm)}
                if len(pcm):
                    assert pcm[-1] == 0.0 and np.abs(pcm[-470:-240]).max() > 0.1 > np.abs(pcm[-10:]).max()
        child.process.wait(60.0)
        assert time.monotonic() - began < 2.0
    finally:
        child.end()
    log = child.log.read_text()
    assert "Traceback" not in log and "Cancel" not in log, log


def test_a_render_that_is_not_finished_does_not_hold_the_end_up(tmp_path: Path) -> None:
    """A slow reader of an hour of sound: its answer is cut after the timeout, which Content-Length lets it see."""
    child = Child(PLAIN, tmp_path)
    try:
        url = child.url()
        with socket.create_connection(("127.0.0.1", int(url.rpartition(":")[2]))) as peer:
            body = b'{"output": {"duration": 3600}}'
            peer.sendall(
                b"POST /v1/render HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
                b"Content-Length: %d\r\n\r\n%s" % (len(body), body)
            )
            assert peer.recv(1024).startswith(b"HTTP/1.1 200")
            child.process.send_signal(signal.SIGTERM)
            child.process.wait(60.0)
    finally:
        child.end()


def test_a_solve_a_measurement_and_an_upload_that_are_not_finished_are_told_of_the_end(tmp_path: Path) -> None:
    child = Child("tests.service.serve_stuck", tmp_path)
    try:
        url = child.url()
        fields = b"Host: localhost\r\nContent-Type: application/json\r\nContent-Length: 9\r\n"
        place = ("127.0.0.1", int(url.rpartition(":")[2]))
        with ThreadPoolExecutor(2) as callers, socket.create_connection(place, PATIENCE) as upload:
            upload.sendall(b"POST /v1/sessions HTTP/1.1\r\n" + fields + b"\r\n{")
            answers = [
                callers.submit(httpx.post, f"{url}/v1/{path}", json={}, timeout=PATIENCE)
                for path in ("tables", "accuracy")
            ]
            until(lambda: all(f"a {work} begins" in child.log.read_text() for work in ("table", "measurement")), 60.0)
            child.process.send_signal(signal.SIGTERM)
            for answer in answers:
                problem(answer.result(), 503, "closing")
            with upload.makefile("rb") as received:
                answered = received.read()
            assert answered.startswith(b"HTTP/1.1 503 ") and b"/docs#problem-closing" in answered
        child.process.wait(60.0)
    finally:
        child.end()
    assert "Traceback" not in child.log.read_text()


def test_a_taken_port_is_a_sentence(tmp_path: Path) -> None:
    holder = listen(settings_of())
    try:
        port = holder.getsockname()[1]
        with pytest.raises(CannotRender, match=f"port {port}: address already in use"):
            run(settings_of(port=port))
        child = Child("service", tmp_path, RIDGEWAVE_PORT=str(port))
        until(lambda: child.process.poll() is not None, 60.0)
        assert child.process.returncode == 1
        assert child.log.read_text().count("\n") == 1
    finally:
        holder.close()


def test_a_wrong_setting_is_a_sentence_and_exit_2(tmp_path: Path) -> None:
    child = Child("service", tmp_path, RIDGEWAVE_LEAD="2", RIDGEWAVE_WORKERS="none")
    until(lambda: child.process.poll() is not None, 60.0)
    assert child.process.returncode == 2
    log = child.log.read_text()
    assert "RIDGEWAVE_LEAD" in log and "RIDGEWAVE_WORKERS" in log and "Traceback" not in log
