"""The processes that the service starts: what they import, and their bounds."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from service.compute.accuracy_process import _answer_of_process
from service.compute.import_process import Imports
from service.compute.render_process import Copies
from tests.service.harness import ROOT


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


def test_an_import_that_takes_too_long_is_ended_by_its_own_bound() -> None:
    code = "from service.compute import import_process as own; own.LONGEST_CPU = 1; own.set_bounds()\nwhile True: pass"
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-P", "-c", code], env=environment, capture_output=True)
    assert done.returncode == -signal.SIGXCPU


def test_a_measurement() -> None:
    request: dict[str, object] = {"scene": {}, "quantity": "colour", "textures": None, "live": False}
    code, outcome, messages = _answer_of_process(json.dumps(request).encode(), threading.Event())
    assert (code, messages) == (0, b"") and json.loads(outcome)["faults"]


def test_a_bound_never_exceeds_the_users_own() -> None:
    own = 1 << 40
    code = f"""
import resource
from service.compute.resource_bounds import bound
resource.setrlimit(resource.RLIMIT_AS, ({own}, {own}))
for most in ({own} + 4096, {own} - 4096, {own}):
    bound(resource.RLIMIT_AS, most)
    print(*resource.getrlimit(resource.RLIMIT_AS))
"""
    command = [sys.executable, "-P", "-c", code]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True, env=environment)
    assert done.stdout.split() == [str(own), str(own), str(own - 4096), str(own), str(own), str(own)]
