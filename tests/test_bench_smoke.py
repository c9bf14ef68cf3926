"""The benchmarks, the figure and the sounds to listen to can be made. No time is judged here."""

from __future__ import annotations

import json
import math
import shutil
from pathlib import Path

import pytest

from tests.bench.__main__ import main as bench
from tests.file_metadata import read_metadata
from tests.listen.__main__ import main as listen
from tests.listen.cases import CASES
from tests.listen.report import numbers

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "benchmarks.md"
UNITS = {"us/phase", "1/1000", "x assumed", "x equal", "x sin", "ns/frame", "ms", "s", "kB"}
SHORT = ("solver", "limiter")  # the others compile, solve what takes long, or start services


@pytest.mark.parametrize("parts", [SHORT, pytest.param((), marks=pytest.mark.thorough)], ids=["short", "all"])
def test_every_benchmark_runs_and_the_page_knows_every_figure(
    parts: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    bench(["--quick", "--json", *parts])
    figures = json.loads(capsys.readouterr().out)["figures"]
    units = {one["unit"] for one in figures}
    assert units < UNITS if parts else units == UNITS
    assert all(math.isfinite(one["value"]) and one["value"] > 0.0 and one["least"] > 0.0 for one in figures)
    page = PAGE.read_text("utf-8")
    missing = {one["name"] for one in figures if f"\n{one['name']} " not in page}
    assert not missing, f"docs/benchmarks.md was printed by another version: it lacks {missing}"


def test_a_part_prints_a_line_for_each_figure_with_its_limit(capsys: pytest.CaptureFixture[str]) -> None:
    bench(["--quick", "solver"])
    head, columns, *lines, last = capsys.readouterr().out.splitlines()
    assert head.startswith("processor ")
    assert columns.split() == ["figure", "median", "least", "unit", "limit", "how"]
    assert [line[:35].rstrip() for line in lines] == [
        "exact solver, default scene",
        "exact solver, of a baseline's time",
    ]
    assert last.startswith("interruptions of the core by other work, per second: solver ")
    assert lines[0].split("us/phase")[1].split()[:2] in (["5", "within"], ["5", "OVER"])


def test_a_part_that_does_not_exist_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as refused:
        bench(["nothing"])
    assert refused.value.code == 2
    assert "'nothing' is not one of solver, voice" in capsys.readouterr().err


def test_the_waveform_figure_is_drawn(tmp_path: Path) -> None:
    """That a figure is twice the same, tests/test_effects_docs.py shows."""
    pytest.importorskip("matplotlib", reason="figures need the extra `plots`: pip install '.[plots]'")
    from docs.figures.waveform import main

    main(tmp_path)
    drawn = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    assert drawn.keys() == {"waveform.png", "waveform.svg"}
    assert drawn["waveform.png"].startswith(b"\x89PNG")
    assert b"<svg" in drawn["waveform.svg"]


EXAMPLES = ("heavy-touch", "rough-surface")  # tests/synth/scene/test_examples.py renders the others
SOUNDS = ("heavy-touch", "change")


@pytest.mark.parametrize("asked", [SOUNDS, pytest.param((), marks=pytest.mark.thorough)], ids=["some", "all"])
def test_the_sounds_to_listen_to_are_written_with_their_numbers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, asked: tuple[str, ...]
) -> None:
    examples, folder = tmp_path / "examples", tmp_path / "sounds"
    examples.mkdir()
    for name in EXAMPLES:
        shutil.copy(ROOT / "docs" / "examples" / f"{name}.json", examples)
    monkeypatch.setattr("tests.listen.__main__.EXAMPLES", examples)
    listen([str(folder), *asked])
    names = set(asked) or {*EXAMPLES, *(case.name for case in CASES)}
    assert {path.stem for path in folder.glob("*.wav")} == names
    report = (folder / "report.txt").read_text("utf-8")
    assert all(f"{name}.wav  " in report for name in names)
    assert read_metadata(folder / "change.wav") is not None


def test_a_sound_that_does_not_exist_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as refused:
        listen([str(tmp_path / "folder"), "nothing"])
    assert refused.value.code == 2
    told = capsys.readouterr().err
    assert "'nothing'" in told and "sweep" in told
    assert not (tmp_path / "folder").exists()


def test_the_numbers_of_a_sine_are_those_of_a_sine() -> None:
    import numpy as np

    rate, hertz = 48000, 1000.0
    found = numbers(0.5 * np.sin(2.0 * np.pi * hertz * np.arange(rate) / rate), rate)
    assert found.peak == pytest.approx(0.5)
    assert found.rms == pytest.approx(0.5 / math.sqrt(2.0))
    assert found.step == pytest.approx(0.5 * math.sin(2.0 * math.pi * hertz / rate))
    assert found.centroid == pytest.approx(hertz, abs=0.1)
