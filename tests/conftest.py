"""What every test may ask for: where the repository is, and the command line as a process of its own.

A kernel is compiled by one of the processes of a run (-n); the others wait for it, and read it from the disk.
"""

from __future__ import annotations

import fcntl
import gc
import io
import os
import ssl
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

# Before numpy is loaded: each process of a run (-n) would else spin a thread a core for every product of matrices.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Textures that the user has imported must not be in a test, nor those of a test among the user's.
os.environ["XDG_DATA_HOME"] = tempfile.mkdtemp(prefix="ridgewave-tests-")

import hypothesis
import pytest
from numba.core.compiler_lock import global_compiler_lock
from numba.core.dispatcher import Dispatcher

# The processes of a run import the same modules again and again, so these are compiled once, whatever the shell says.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
# A slow shared machine must not fail a property, and the same commit must try the same examples everywhere.
hypothesis.settings.register_profile("ridgewave", deadline=None, derandomize=True)
hypothesis.settings.load_profile("ridgewave")

ROOT = Path(__file__).resolve().parent.parent

LOCKS = ROOT / ".pytest_cache" / "kernels"
LOCKS.mkdir(parents=True, exist_ok=True)
compile_here = Dispatcher.compile


def compile_once(kernel: Any, signature: Any) -> Any:
    """Compile `kernel` as numba does, which looks on the disk first, while no other process compiles it.

    numba's own lock is taken first: a thread that held the file and waited for it would stop one that waits for both.
    """
    name = f"{kernel.__module__}.{kernel.__qualname__}"
    with global_compiler_lock, (LOCKS / name).open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        return compile_here(kernel, signature)


Dispatcher.compile = compile_once  # type: ignore[method-assign, assignment]

# Every client of httpx reads the certificates of the world anew, in 15 ms; tests speak plain HTTP to this machine.
ssl.create_default_context = cache(ssl.create_default_context)  # type: ignore[assignment]


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Run files in the order of their names without folders: those that wait and those that compute then alternate."""
    items.sort(key=lambda item: item.path.name)


def pytest_collection_finish() -> None:
    """Take what was imported and collected out of every later search for garbage: all of it stays until the end."""
    gc.collect()
    gc.freeze()


RunsRidgewave = Callable[..., subprocess.CompletedProcess[bytes]]


@pytest.fixture(scope="session")
def repository() -> Path:
    """Return the root of the checkout."""
    return ROOT


@pytest.fixture(scope="session")
def environment() -> dict[str, str]:
    """Return an environment for processes that are to import this checkout, without settings of the user's own."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith("RIDGEWAVE_")}
    kept["RIDGEWAVE_PREPARE_TEXTURES"] = "off"
    return {**kept, "PYTHONPATH": str(ROOT), "COLUMNS": "120"}


@pytest.fixture
def ridgewave(tmp_path: Path, environment: dict[str, str]) -> RunsRidgewave:
    """Return a function that runs `ridgewave WORDS` in an empty folder and returns what a finished process would.

    It runs in this process, which saves a second; input: what is on its standard input. With any other keyword it is a
    process of its own, and they go to subprocess.run. Output comes back as bytes.
    """

    def run(*words: str, **keywords: Any) -> subprocess.CompletedProcess[bytes]:
        if keywords.keys() <= {"input"}:
            return in_this_process(words, tmp_path, **keywords)
        own = {**environment, "XDG_DATA_HOME": str(tmp_path / ".data")}
        settings: dict[str, Any] = {"cwd": tmp_path, "env": own, "timeout": 300, "stdin": subprocess.DEVNULL}
        if "stdout" not in keywords:
            settings["stdout"] = subprocess.PIPE
        settings.update(stderr=subprocess.PIPE, check=False)
        return subprocess.run([sys.executable, "-m", "clients", *words], **{**settings, **keywords})

    return run


def in_this_process(words: Sequence[str], folder: Path, input: bytes = b"") -> subprocess.CompletedProcess[bytes]:
    """Return what `ridgewave WORDS` leaves: its exit code, standard output and standard error."""
    from clients.command_line import main

    out, err = io.BytesIO(), io.BytesIO()
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setenv("COLUMNS", "120")
        patch.setenv("XDG_DATA_HOME", str(folder / ".data"))
        for name in [name for name in os.environ if name.startswith("RIDGEWAVE_")]:
            patch.delenv(name)
        for name, stream in (("stdin", io.BytesIO(input)), ("stdout", out), ("stderr", err)):
            patch.setattr(sys, name, io.TextIOWrapper(stream, "utf-8", write_through=True))
        try:
            code = main(words)
        except SystemExit as ended:
            code = int(ended.code or 0)
        return subprocess.CompletedProcess(words, code, out.getvalue(), err.getvalue())
