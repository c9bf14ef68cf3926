"""`/healthz` tells the truth: what works, what does not, and that the process answers all the same."""

from __future__ import annotations

import asyncio
import subprocess
import sys

import pytest
from fastapi import FastAPI

from service.sinks.device_list import INSTALL_PORTAUDIO, missing_portaudio
from tests.service.harness import ROOT, ask, serving, until
from tests.service.plain_engine import PlainEngine


def test_without_portaudio_the_service_is_healthy_and_says_what_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ctypes.util.find_library", lambda name: None)
    with serving(PlainEngine()) as running:
        until(lambda: running.client.get("/healthz").json()["audio_device"]["available"] is not None)
        document = running.client.get("/healthz").json()
    assert document["status"] == "ok"
    assert document["audio_device"] == {"available": False, "reason": f"{INSTALL_PORTAUDIO}."}


def test_portaudio_is_looked_for_once_and_not_in_the_event_loop(monkeypatch: pytest.MonkeyPatch) -> None:
    looked: list[object] = []
    monkeypatch.setattr(
        "service.operations.health.missing_portaudio", lambda: looked.append(asyncio._get_running_loop())
    )
    with serving(PlainEngine()) as running:
        until(lambda: running.client.get("/healthz").json()["audio_device"] == {"available": True, "reason": None})
        for _ in range(5):
            running.client.get("/healthz")
    assert looked == [None]


def test_an_answer_does_not_wait_for_what_is_not_known_yet(app: FastAPI) -> None:
    document = ask(app, "GET", "/healthz").json()  # no server, so nobody has looked
    assert document["audio_device"]["available"] is None
    assert document["status"] == "ok" and document["ready"] is False and document["workers"] == 1


def test_to_look_for_portaudio_loads_nothing() -> None:
    code = "import sys, service.sinks.device_list as d; d.missing_portaudio(); print('sounddevice' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


def test_the_python_package_may_be_missing_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    assert "pip install sounddevice" in (missing_portaudio() or "")


def test_a_service_of_several_workers_says_that_it_has_live_connections_and_no_sessions() -> None:
    with serving(PlainEngine(), workers=2) as running:
        document = running.client.get("/healthz").json()
    assert document["sessions"]["available"] is False and "RIDGEWAVE_WORKERS=1" in document["sessions"]["reason"]
    assert document["live"] == {"available": True, "reason": None}


def test_ready_is_told_once_the_kernels_are_there() -> None:
    with serving(PlainEngine()) as running:
        until(lambda: running.client.get("/healthz").json()["ready"])
