"""Progress on standard error: lines without a terminal, a bar on one, nothing unless wanted."""

from __future__ import annotations

import os
import pty
import subprocess
import sys
import time
from pathlib import Path

import pytest

from clients.command_line.progress import Progress, Waiting
from tests.service.harness import until

BAR = """
import time
from clients.command_line.progress import Progress, Waiting
with Progress("rendering", 10.0, "s", True) as bar:
    bar.advance(5.0)
    time.sleep(0.3)
"""


def test_without_a_terminal_nothing_shows_unless_asked(capsys: pytest.CaptureFixture[str]) -> None:
    for wanted in (None, False):
        with Progress("rendering", 10.0, "s", wanted) as bar:
            bar.advance(10.0)
    assert capsys.readouterr() == ("", "")


def test_on_request_without_a_terminal_it_is_a_line_per_tenth(capsys: pytest.CaptureFixture[str]) -> None:
    with Progress("rendering", 60.0, "s", True) as bar:
        for _ in range(120):
            bar.advance(0.5)
    out, err = capsys.readouterr()
    lines = err.splitlines()
    assert out == ""
    assert len(lines) == 10
    assert lines[0] == "rendering: 10 %, 6 of 60 s"
    assert lines[-1] == "rendering: 100 %, 60 of 60 s"


def test_work_of_unknown_length_reports_the_elapsed_time(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("clients.command_line.progress.WAIT_AFTER", 0.01)
    told: list[str] = []

    def something() -> bool:
        told.append(capsys.readouterr().err)
        return bool(told[-1])

    with Waiting("solving the contact", True):
        until(something)
    assert "".join(told).startswith("solving the contact: 0 s\n")
    capsys.readouterr()
    for wanted in (None, False):
        with Waiting("solving the contact", wanted):
            time.sleep(0.1)
        assert capsys.readouterr() == ("", "")


def test_short_work_reports_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    with Waiting("solving the contact", True):
        pass
    assert capsys.readouterr() == ("", "")


def test_on_a_terminal_it_is_a_bar(repository: Path) -> None:
    ours, theirs = pty.openpty()
    try:
        subprocess.run([sys.executable, "-c", BAR], cwd=repository, stderr=theirs, timeout=300, check=True)
        os.set_blocking(ours, False)
        shown = os.read(ours, 65536).decode()
    finally:
        os.close(ours)
        os.close(theirs)
    assert "rendering" in shown
    assert "50%" in shown
