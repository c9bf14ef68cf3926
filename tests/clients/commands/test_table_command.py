"""`ridgewave table`: the file, and clear refusals."""

from __future__ import annotations

import json
from pathlib import Path

from synth.response.table_file import read_table
from tests.conftest import RunsRidgewave


def test_a_table_is_written_and_replaces_a_file_unless_no_clobber(ridgewave: RunsRidgewave, tmp_path: Path) -> None:
    path = tmp_path / "one.safetensors"
    told = json.loads(ridgewave("table", "grating-800um-40um", "-o", str(path), "--json").stdout)
    table = read_table(path)
    assert told["hash"] == table.hash
    assert told["bytes"] == path.stat().st_size
    assert told["covered_n"] == list(table.covered)
    assert 0.0 < told["largest_error"]["displacement"] < told["largest_error"]["acceleration"] < 0.1
    again = ridgewave("table", "grating-800um-40um", "-o", str(path))
    assert b"of the peak-to-peak" in again.stdout and b"{" not in again.stdout and b"replaced" in again.stderr
    kept = ridgewave("table", "grating-800um-40um", "-o", str(path), "--no-clobber")
    assert kept.returncode == 2
    assert [file.name for file in tmp_path.iterdir()] == ["one.safetensors"]


def test_another_ending_is_refused_before_anything_is_made(ridgewave: RunsRidgewave, tmp_path: Path) -> None:
    done = ridgewave("table", "grating-800um-40um", "-o", str(tmp_path / "one.wav"))
    assert done.returncode == 2
    assert b".safetensors" in done.stderr
    assert not list(tmp_path.iterdir())
