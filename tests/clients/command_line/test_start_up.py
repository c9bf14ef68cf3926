"""The command line answers at once: what it imports before it computes."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import RunsRidgewave

HEAVY = (
    "numpy",
    "scipy",
    "numba",
    "llvmlite",
    "pydantic",
    "fastapi",
    "uvicorn",
    "httpx",
    "websockets",
    "rich",
    "soundfile",
    "sounddevice",
    "matplotlib",
)

LOADED = """
import json, sys
from clients.command_line import main
try:
    main(sys.argv[1:])
except SystemExit as stop:
    assert not stop.code, stop.code
print(json.dumps(sorted(sys.modules)))
"""


def modules_after(repository: Path, *words: str) -> set[str]:
    """Return what a process has imported once it has run `ridgewave WORDS`."""
    command = [sys.executable, "-c", LOADED, *words]
    done = subprocess.run(command, cwd=repository, capture_output=True, timeout=300, check=True)
    return set(json.loads(done.stdout.splitlines()[-1]))


@pytest.mark.parametrize("command", ["", "render", "accuracy", "play", "serve"])
def test_help_loads_nothing_heavy(repository: Path, command: str) -> None:
    loaded = modules_after(repository, *command.split(), "--help")
    assert not loaded & {*HEAVY, "synth", "service", "importlib.metadata"}


def test_version_loads_nothing_heavy(repository: Path) -> None:
    assert not modules_after(repository, "--version") & set(HEAVY)


def test_textures_computes_nothing_and_so_loads_no_numerics(repository: Path) -> None:
    assert not modules_after(repository, "textures", "--json") & {"numpy", "numba", "scipy", "fastapi", "rich"}


def test_version_is_the_installed_packages(ridgewave: RunsRidgewave) -> None:
    from importlib.metadata import PackageNotFoundError, version

    done = ridgewave("--version")
    assert done.returncode == 0
    try:
        expected = f"ridgewave {version('ridgewave')}\n"
    except PackageNotFoundError:
        expected = "ridgewave (a checkout that is not installed)\n"
    assert done.stdout.decode() == expected
