"""The processes that the service starts import the service, never a file of the folder in which it was started."""

from __future__ import annotations

import asyncio
import json
import threading
from pathlib import Path

import pytest

from service.compute.accuracy_process import _answer_of_process
from service.compute.import_process import Imports
from service.compute.render_process import Copies


@pytest.fixture(autouse=True)
def folder_of_false_modules(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Work in a folder whose files have the names of modules."""
    for name in ("service", "synth", "signal", "json"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit('a false module')")
    monkeypatch.chdir(tmp_path)


def test_a_render(tmp_path: Path) -> None:
    copies = Copies(1 << 20, 10.0, tmp_path / "data")
    try:
        copies.start()  # raises RuntimeError if the process ends
    finally:
        copies.close()


def test_an_import() -> None:
    request = {"path": "none.csv", "file": "none.csv", "options": {}, "heights": "heights"}
    code, outcome, messages = asyncio.run(Imports()._outcome(json.dumps(request).encode()))
    assert (code, messages) == (0, b"") and json.loads(outcome)["faults"][0]["pointer"] == "/file"


def test_a_measurement() -> None:
    request: dict[str, object] = {"scene": {}, "quantity": "colour", "textures": None}
    code, outcome, messages = _answer_of_process(json.dumps(request).encode(), threading.Event())
    assert (code, messages) == (0, b"") and json.loads(outcome)["faults"]
