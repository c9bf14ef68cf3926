"""Fixtures of the service's tests: the plain engine, an application in process, a server on a free port."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from fastapi import FastAPI

from service.app import create_app
from tests.service.harness import PATIENCE, Running, serving, settings_of
from tests.service.plain_engine import PlainEngine, warmed_up


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
