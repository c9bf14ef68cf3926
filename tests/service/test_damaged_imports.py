"""Damaged files and bombs: each is imported or refused in words, and the next import is served."""

from __future__ import annotations

import json
import logging
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fastapi import FastAPI

import ridgewave as rw
from service.app import create_app
from service.compute.import_process import answer_of
from synth.errors import CannotRender, InvalidRequest
from tests.conftest import RunsRidgewave
from tests.few import few, thorough
from tests.service.harness import ROOT, ask, problem, settings_of
from tests.service.plain_engine import PlainEngine
from tests.synth.surfaces.readers.bad_files import zip_of
from tests.synth.surfaces.readers.damage import damaged, whole_files

BROKEN = zip_of("main.xml", b"<a/>").replace(b"PK\x01\x02", b"PK\x01\x03")
MOST_MEGABYTES = 600  # with 160 of libraries; the most was 250
GIVEN = {"unit": "um", "pixel": "5 um"}


def damaged_imports(*words: str) -> dict[str, dict[str, Any]]:
    """Return what the program of that name found."""
    command = [sys.executable, "-m", "tests.service.damaged_imports", "--json", *words]
    one_thread = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"), "1")
    done = subprocess.run(command, cwd=ROOT, env={**os.environ, **one_thread}, capture_output=True, check=True)
    found: dict[str, dict[str, Any]] = json.loads(done.stdout)
    return found


@pytest.mark.parametrize("each", [5, thorough(1000)])
def test_damaged_files_are_imported_or_refused_in_words(each: int) -> None:
    found = damaged_imports("--each", str(each))
    assert len(found) >= 17 and not [(name, one["wrong"]) for name, one in found.items() if one["wrong"]]


def test_bombs_are_read_or_refused_in_words_with_little_memory() -> None:
    found = damaged_imports("--bombs", "--format", "none")
    assert len(found) > 45 and not [(name, one["wrong"]) for name, one in found.items() if one["wrong"]]
    assert max(one["megabytes"] for one in found.values()) < MOST_MEGABYTES


def test_damage_is_the_same_each_time() -> None:
    whole = whole_files()["PNG"][0].content
    first, again, other = (damaged(whole, np.random.default_rng(seed)) for seed in (1, 1, 2))
    assert first == again and first != whole and first != other


@pytest.fixture
def own(tmp_path: Path) -> FastAPI:
    return create_app(settings_of(data_folder=tmp_path / "data"), PlainEngine())


@pytest.mark.parametrize("name", few(["scan.x3p", "scan.xlsx", "scan.npz"], 1))
def test_a_damaged_zip_is_refused_over_http_and_the_next_import_is_served(
    own: FastAPI, name: str, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO, "ridgewave.service")
    refused = ask(own, "POST", "/v1/textures", files={"file": (name, BROKEN)}, data=GIVEN)
    told = problem(refused, 422, "request-refused")
    assert "damaged" in told["detail"] and "Traceback" not in refused.text
    (line,) = (one.getMessage() for one in caplog.records if "reader failed" in one.getMessage())
    assert ": BadZipFile: " in line and "zipfile" in line and "\n" not in line and "Traceback" not in caplog.text
    assert ask(own, "POST", "/v1/textures", files={"file": ("a.csv", b"1\n2\n3\n")}, data=GIVEN).status_code == 201


@pytest.mark.parametrize(
    ("code", "messages", "raised", "says"),
    [
        (-signal.SIGSEGV, b"", InvalidRequest, "crashes"),
        (-signal.SIGABRT, b"double free", InvalidRequest, "crashes"),
        (-signal.SIGXCPU, b"", InvalidRequest, "90 s of processor time"),
        (1, b"numpy._core._exceptions._ArrayMemoryError", InvalidRequest, "memory"),
        (-signal.SIGKILL, b"", CannotRender, "too little time or memory"),
        (1, b"NameError", RuntimeError, "ended with 1"),
    ],
)
def test_the_end_of_an_importing_process_is_told(
    code: int, messages: bytes, raised: type[Exception], says: str
) -> None:
    with pytest.raises(raised, match=says):
        answer_of(code, b"", messages)


def test_a_damaged_file_is_refused_without_a_traceback_on_the_command_line_and_in_python(
    ridgewave: RunsRidgewave, tmp_path: Path
) -> None:
    (tmp_path / "scan.x3p").write_bytes(BROKEN)
    done = ridgewave("import", "scan.x3p", "--unit", "um", "--dry-run", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (2, b"") and b"damaged" in done.stderr and b"Traceback" not in done.stderr
    with pytest.raises(rw.InvalidRequest, match="damaged"):
        rw.import_texture(tmp_path / "scan.x3p", dry_run=True)
