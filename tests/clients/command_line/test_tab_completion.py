"""TAB completes commands, textures and fields, and a shell accepts the script of `ridgewave completion`."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from clients.command_line.help_examples import EXAMPLES
from clients.command_line.parser import build_parser, parse
from clients.command_line.tab_completion import fields, quantities, scenes, textures
from service.store.own_textures import own_store
from service.store.store import Quota
from synth.surfaces.surface_data import SurfaceData
from tests.conftest import RunsRidgewave


def completed(line: str, folder: Path, environment: dict[str, str]) -> list[str]:
    """Return what is offered after `line`, as the shell asks for it."""
    answer = folder / "answer"
    asked = {
        "_ARGCOMPLETE": "1",
        "_ARGCOMPLETE_IFS": "\n",
        "_ARGCOMPLETE_STDOUT_FILENAME": str(answer),
        "COMP_LINE": line,
        "COMP_POINT": str(len(line)),
    }
    subprocess.run(
        [sys.executable, "-m", "clients"], cwd=folder, env={**environment, **asked}, timeout=300, capture_output=True
    )
    return [word.strip() for word in answer.read_text().split("\n")]


def test_commands_and_textures_are_completed(tmp_path: Path, environment: dict[str, str]) -> None:
    assert completed("ridgewave acc", tmp_path, environment) == ["accuracy"]
    assert completed("ridgewave play grating-1m", tmp_path, environment) == ["grating-1mm-31um"]


def test_values_are_completed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "grating.json").touch()
    assert {"texture.period=", "scan.stroke.length=", "effects.inertia="} <= set(fields(""))
    assert fields("texture.period=") == []
    assert textures("grating-5") == ["grating-500um-40um", "grating-5mm-200um"]
    assert {"grating.json", "grating-1mm-31um"} <= set(scenes("grat"))
    assert quantities("v") == ["velocity"]


def test_imported_textures_are_completed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RIDGEWAVE_DATA_FOLDER", str(tmp_path))
    surface = SurfaceData(np.array([0.0, 1e-6, 0.0, -1e-6], np.float32), (1e-5,))
    own_store().keep("", "grating-5-measured", surface, "profile", {"file": "a.csv"}, Quota())
    own_store().keep("another", "grating-5-of-a-key", surface, "profile", {"file": "a.csv"}, Quota())
    assert textures("grating-5") == ["grating-500um-40um", "grating-5mm-200um", "grating-5-measured"]
    assert "grating-5-measured" in scenes("grating-5")
    (tmp_path / "textures.sqlite").write_bytes(b"no database " * 1000)
    assert textures("grating-5") == ["grating-500um-40um", "grating-5mm-200um"]


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_script_for_a_shell_names_the_command(ridgewave: RunsRidgewave, shell: str) -> None:
    done = ridgewave("completion", shell)
    assert done.returncode == 0 and b"ridgewave" in done.stdout
    if shell == "bash":
        taken = subprocess.run(["bash", "-c", f"{done.stdout.decode()}\ncomplete -p ridgewave"], capture_output=True)
        assert taken.returncode == 0 and b"ridgewave" in taken.stdout


def test_every_command_has_examples_that_parse() -> None:
    commands = next(action for action in build_parser()._actions if action.dest == "==SUPPRESS==" or action.choices)
    assert commands.choices is not None and set(EXAMPLES) == {"", *commands.choices}
    for name, examples in EXAMPLES.items():
        for words, _what in examples:
            plain = words.replace("'", "").split(" > ")[0].split(" >> ")[0].split(" | ")[0].split()
            assert parse(plain).command_module == f"clients.commands.{plain[0]}"
            assert name in ("", plain[0])


def test_without_arguments_the_help_is_printed(ridgewave: RunsRidgewave) -> None:
    done = ridgewave()
    assert done.returncode == 0 and not done.stderr
    assert b"examples:" in done.stdout and b"render a scene to a file" in done.stdout
