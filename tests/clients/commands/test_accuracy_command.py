"""`ridgewave accuracy`: the table, the JSON, the files of -o, and what is refused before the measurement."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn

import pytest

import clients.commands.accuracy
from clients.command_line import main
from synth.errors import CannotRender, Fault, InvalidRequest
from tests.accuracy_case import CHOSEN, document, fake_drawings, fake_measure
from tests.conftest import RunsRidgewave

FILES = ["accuracy.json", "accuracy.png", "accuracy.svg"]
SCENE = "grating-800um-40um"

WITHOUT_MATPLOTLIB = """
import sys
sys.modules["matplotlib"] = None
import synth.accuracy.report
def never(*words, **named):
    raise AssertionError("it measured")
synth.accuracy.report.measure_accuracy = never
from clients.command_line import main
sys.exit(main(sys.argv[1:]))
"""

WHAT_IS_LOADED = """
import sys
import synth.accuracy.report
from tests.accuracy_case import fake_measure
synth.accuracy.report.measure_accuracy = fake_measure
from clients.command_line import main
assert main(sys.argv[1:]) == 0
print("matplotlib" in sys.modules, file=sys.stderr)
"""


@pytest.fixture
def measured(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Put made-up numbers in the place of the measuring, and work in an empty folder."""
    monkeypatch.setattr(clients.commands.accuracy, "measure_accuracy", fake_measure)
    monkeypatch.chdir(tmp_path)


def refusing(error: Exception) -> Callable[..., NoReturn]:
    def measure(*_words: Any, **_named: Any) -> NoReturn:
        raise error

    return measure


@pytest.mark.usefixtures("measured")
def test_the_table_names_every_method_under_its_family(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["accuracy", SCENE]) == 0
    out = capsys.readouterr().out
    for family in ("trapezoid and brentq", "sampled solver", "exact solver", "response table", "sum of harmonics"):
        assert f"    {family} " in out
    assert "1024 phases" in out and " 3200, oversampling 8 " in out and " 1600, tabled, 4096 " in out
    assert out.count("(points)") == 1 and " to a 2000th  " in out
    assert "Once a process: 1.25 s to start, import, and load its kernels." in out
    assert "Left out: closed form. The contact is not full at every phase." in out


@pytest.mark.usefixtures("measured")
def test_the_first_line_describes_the_numbers(capsys: pytest.CaptureFixture[str]) -> None:
    main(["accuracy", SCENE])
    assert capsys.readouterr().out.splitlines()[0] == (
        "grating-800um-40um: acceleration, peak-to-peak 37.9 m/s^2; timings are medians of 7 on this machine; "
        "threshold: Nobody (1900)"
    )


@pytest.mark.usefixtures("measured")
def test_front_and_choice_are_marked(capsys: pytest.CaptureFixture[str]) -> None:
    main(["accuracy", SCENE])
    rows = [line for line in capsys.readouterr().out.splitlines() if line[:2].strip() and line[2:6] == "    "]
    front = [row for row in document()["methods"] if row["pareto"]]
    assert sum(line.startswith("*") for line in rows) == len(front)
    (choice,) = (line for line in rows if "<" in line[:2])
    assert CHOSEN.removeprefix("sum of harmonics, ") in choice


@pytest.mark.usefixtures("measured")
def test_the_table_is_no_wider_than_120_columns_and_no_row_wraps(capsys: pytest.CaptureFixture[str]) -> None:
    main(["accuracy", SCENE])
    lines = capsys.readouterr().out.splitlines()[2:]
    assert max(map(len, lines)) <= 120
    assert len(lines) < len(document()["methods"]) + 30


@pytest.mark.usefixtures("measured")
def test_no_error_is_a_zero_without_decibels(capsys: pytest.CaptureFixture[str]) -> None:
    main(["accuracy", SCENE])
    (row,) = (line for line in capsys.readouterr().out.splitlines() if " 65536 phases " in line)
    assert row.partition(" phases ")[2].split()[:5] == ["0", "0", "0", "-", "-"]


@pytest.mark.usefixtures("measured")
def test_json_is_the_document(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["accuracy", SCENE, "--json", "--set", "scan.load=0.5N"]) == 0
    shown = json.loads(capsys.readouterr().out)
    assert shown["scene"]["scan"]["load"] == 0.5
    assert shown["methods"] == document()["methods"]
    assert shown.keys() == document().keys()


@pytest.mark.usefixtures("measured")
def test_the_quantity_is_passed_on(capsys: pytest.CaptureFixture[str]) -> None:
    channels = 'output.channels=["acceleration", "displacement"]'
    assert main(["accuracy", SCENE, "--set", channels, "--quantity", "displacement"]) == 0
    assert ": displacement, peak-to-peak 1.93 um;" in capsys.readouterr().out


@pytest.mark.usefixtures("measured")
def test_progress_counts_the_methods(capsys: pytest.CaptureFixture[str]) -> None:
    main(["accuracy", SCENE, "--progress"])
    assert "measuring: 100 %, 47 of 47 methods" in capsys.readouterr().err
    main(["accuracy", SCENE])
    assert capsys.readouterr().err == ""


@pytest.mark.usefixtures("measured")
def test_a_folder_gets_the_three_files(capsys: pytest.CaptureFixture[str]) -> None:
    folder = "made/within/others"
    assert main(["accuracy", SCENE, "-o", folder]) == 0
    assert sorted(path.name for path in Path(folder).iterdir()) == FILES
    assert json.loads((Path(folder) / "accuracy.json").read_text())["chosen"] == CHOSEN
    assert f"Written to {folder}" in capsys.readouterr().out


@pytest.mark.usefixtures("measured")
def test_existing_files_are_replaced_and_others_stay(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("clients.accuracy_report.figure.drawings", fake_drawings)
    Path("accuracy.svg").write_text("an older one")
    Path("notes.txt").write_text("mine")
    assert main(["accuracy", SCENE, "-o", "."]) == 0
    assert Path("accuracy.svg").read_bytes() == b"<svg>"
    assert sorted(os.listdir()) == sorted([*FILES, "notes.txt"])


@pytest.mark.usefixtures("measured")
@pytest.mark.parametrize("name", ["a-file", "a-file/below"])
def test_a_file_in_the_place_of_the_folder_is_refused(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("a-file").write_text("precious")
    assert main(["accuracy", SCENE, "-o", name]) == (2 if name == "a-file" else 1)
    assert name in capsys.readouterr().err
    assert Path("a-file").read_text() == "precious"


@pytest.mark.usefixtures("measured")
@pytest.mark.parametrize(
    ("error", "code"),
    [
        (InvalidRequest([Fault("/quantity", "'force'", "acceleration", "Name a channel.")]), 2),
        (CannotRender("Nothing moves."), 1),
        (KeyboardInterrupt(), 130),
    ],
)
@pytest.mark.parametrize("folder", ["old", "new/within"])
def test_a_failure_leaves_the_folder_as_it_was(
    error: Exception, code: int, folder: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(clients.commands.accuracy, "measure_accuracy", refusing(error))
    Path("old").mkdir()
    (Path("old") / "accuracy.json").write_text("an older one")
    assert main(["accuracy", SCENE, "-o", folder]) == code
    assert os.listdir() == ["old"]
    assert os.listdir("old") == ["accuracy.json"]
    assert (Path("old") / "accuracy.json").read_text() == "an older one"
    assert capsys.readouterr().out == ""


@pytest.mark.usefixtures("measured")
def test_a_drawing_that_fails_leaves_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("clients.accuracy_report.figure.drawings", refusing(OSError(28, "No space left on device")))
    assert main(["accuracy", SCENE, "-o", "made"]) == 1
    assert os.listdir() == []


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
@pytest.mark.usefixtures("measured")
def test_a_folder_that_cannot_be_written_is_reported_before_the_measurement(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clients.commands.accuracy, "measure_accuracy", refusing(AssertionError("it measured")))
    Path("locked").mkdir(mode=0o500)
    assert main(["accuracy", SCENE, "-o", "locked"]) == 1


def test_a_taken_file_name_is_reported_before_the_measurement(ridgewave: RunsRidgewave, tmp_path: Path) -> None:
    (tmp_path / "made" / "accuracy.svg").mkdir(parents=True)
    done = ridgewave("accuracy", SCENE, "-o", "made")
    assert done.returncode == 1
    assert b"accuracy.svg: it is a folder" in done.stderr and b"Traceback" not in done.stderr
    assert os.listdir(tmp_path / "made") == ["accuracy.svg"]


def test_without_matplotlib_the_figures_are_refused_before_the_measurement(
    tmp_path: Path, environment: dict[str, str]
) -> None:
    command = [sys.executable, "-c", WITHOUT_MATPLOTLIB, "accuracy", SCENE, "-o", "made"]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, timeout=300, check=False)
    assert done.returncode == 1
    assert done.stderr.decode().startswith("ridgewave: cannot draw the figures")
    assert b"pip install 'ridgewave[plots]'" in done.stderr and done.stderr.count(b"\n") == 1
    assert os.listdir(tmp_path) == []


def test_without_a_folder_matplotlib_is_never_imported(tmp_path: Path, environment: dict[str, str]) -> None:
    command = [sys.executable, "-c", WHAT_IS_LOADED, "accuracy", SCENE]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, timeout=300, check=True)
    assert done.stderr == b"False\n"


def test_a_wrong_scene_is_an_invalid_request_and_makes_no_folder(ridgewave: RunsRidgewave, tmp_path: Path) -> None:
    done = ridgewave("accuracy", SCENE, "-o", "made", "--set", "scan.load=-1")
    assert done.returncode == 2
    assert b"scan.load" in done.stderr
    assert os.listdir(tmp_path) == []
