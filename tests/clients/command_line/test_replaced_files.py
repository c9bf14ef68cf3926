"""Existing files: a render reports that it replaced one; with --no-clobber it keeps it and computes nothing."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from clients.command_line import main
from tests.accuracy_case import fake_drawings, fake_measure

WORDS = ["render", "grating-1mm-31um", "--duration", "10 ms", "-o"]


@pytest.fixture(autouse=True)
def _in_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_a_replaced_file_is_reported(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*WORDS, "out.wav"]) == 0
    assert "replaced" not in capsys.readouterr().err
    assert main([*WORDS, "out.wav"]) == 0
    assert "ridgewave: replaced out.wav, which existed" in capsys.readouterr().err
    assert main([*WORDS, "out.wav", "--json"]) == 0
    told = capsys.readouterr()
    assert json.loads(told.out)["replaced"] is True and not told.err


def test_no_clobber_keeps_existing_files(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert main([*WORDS, "out.wav", "--no-clobber"]) == 0
    before = (tmp_path / "out.wav").read_bytes()
    (tmp_path / "link.wav").symlink_to("out.wav")
    monkeypatch.setattr("clients.commands.render.open_voice", None)  # nothing is computed
    for name in ("out.wav", "link.wav"):
        assert main([*WORDS, name, "--no-clobber"]) == 2
        assert "--no-clobber" in capsys.readouterr().err
    assert (tmp_path / "out.wav").read_bytes() == before


def test_an_accuracy_report_does_the_same(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("clients.commands.accuracy.measure_accuracy", fake_measure)
    monkeypatch.setattr("clients.accuracy_report.figure.drawings", fake_drawings)
    words = ["accuracy", "grating-1mm-31um", "-o", "report"]
    assert main([*words, "--no-clobber"]) == 0
    assert main([*words, "--no-clobber"]) == 2
    capsys.readouterr()
    assert main(words) == 0
    assert "ridgewave: replaced accuracy.json, accuracy.svg, accuracy.png in report" in capsys.readouterr().err
