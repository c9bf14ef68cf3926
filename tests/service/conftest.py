"""Fixtures of the service's tests: the plain engine, an application in process, a server on a free port."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from fastapi import FastAPI

from service.app import create_app
from service.compute.import_process import Imports
from tests.service.harness import PATIENCE, Running, outcome_here, serving, settings_of, warmed_up
from tests.service.plain_engine import PlainEngine

MADE_UP = """
import synth.accuracy.report
from tests.accuracy_case import fake_measure
synth.accuracy.report.measure_accuracy = fake_measure
"""


@pytest.fixture
def engine() -> PlainEngine:
    return PlainEngine()


@pytest.fixture
def app(engine: PlainEngine) -> Iterator[FastAPI]:
    made = create_app(settings_of(), engine)
    yield made
    made.state.service.finish()


@pytest.fixture
def running(engine: PlainEngine, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    with serving(engine, file_folder=tmp_path_factory.mktemp("recordings")) as server:
        warmed_up(server, engine)
        yield server


@pytest.fixture
def unhurried(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have a stop and a scrape wait for readers and workers that a busy machine holds up, where no time is tested."""
    for name in (
        "lifespan.STOP_ANSWER_SECONDS",
        "operations.worker_metrics.ANSWER_SECONDS",
        "sessions.voice_stream.STOP_GRACE_SECONDS",
    ):
        monkeypatch.setattr(f"service.{name}", PATIENCE)


@pytest.fixture
def read_here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have uploaded surfaces be read in this process, where it does not matter in which."""
    monkeypatch.setattr(Imports, "_outcome", outcome_here)


@pytest.fixture
def own_process(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return what the measuring process runs before anything else; it keeps the usual priority beside other tests."""
    begins = tmp_path / "sitecustomize.py"
    begins.write_text("import os\nos.nice = lambda _: 0\n")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    return begins


@pytest.fixture
def made_up_measurement(own_process: Path) -> None:
    """Have the measuring process return a made-up measurement at once, after it has read its scene."""
    with own_process.open("a") as begins:
        begins.write(MADE_UP)
