"""docs/study.md: its four commands, its ready studies and their figures, at a small size."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from synth.study.spec import read_spec, ready_names, ready_text
from tests.conftest import RunsRidgewave
from tests.few import few

PAGE = (Path(__file__).resolve().parents[1] / "docs" / "study.md").read_text("utf-8")


def small(name: str) -> dict[str, Any]:
    """Return a ready study with a few scenes."""
    spec: dict[str, Any] = json.loads(ready_text(name))
    for axis, values in spec["axes"].items():
        if isinstance(values, dict) and "count" in values:
            values["count"] = 3
        elif isinstance(values, list) and len(values) > 2:
            spec["axes"][axis] = [values[len(values) // 3], values[-6] if len(values) > 6 else values[-1]]
    if "sample" in spec:
        spec["sample"]["count"] = 4
    return spec


def test_the_four_commands_of_the_page_lead_to_the_map(ridgewave: RunsRidgewave, tmp_path: Path) -> None:
    xarray = pytest.importorskip("xarray")
    block = re.search(r"<!-- not run: it installs; tests/.*?```sh\n(.*?)```", PAGE, re.DOTALL)
    assert block is not None
    lines = [line.replace(".venv/bin/", "") for line in block[1].splitlines()]
    assert len(lines) == 4 and lines[1].startswith("pip install") and "study,plots" in lines[1]
    words, target = lines[2].split(" > ")
    printed = ridgewave(*words.split()[1:])
    assert json.loads(printed.stdout) == json.loads(ready_text("duplex")) and target == "map.json"
    (tmp_path / target).write_text(json.dumps(small("duplex")))
    asked = [str(tmp_path / word) if word.startswith("map.") else word for word in lines[3].split()[1:]]
    done = ridgewave(*asked, "--workers", "1")
    assert done.returncode == 0, done.stderr
    assert b"<svg" in (tmp_path / "map.svg").read_bytes()
    with xarray.open_dataset(tmp_path / "map.nc") as made:
        assert np.isfinite(made.pc_level.values).any() and (made.reason.values == 0).all()


@pytest.mark.parametrize("name", few(ready_names(), 3))
def test_the_figure_of_a_ready_study_is_the_same_when_it_is_drawn_again(
    name: str, ridgewave: RunsRidgewave, tmp_path: Path
) -> None:
    pytest.importorskip("xarray")
    (tmp_path / "small.json").write_text(json.dumps(small(name)))
    figures = [str(tmp_path / file) for file in ("one.svg", "one.png")]
    asked = [word for figure in figures for word in ("--figure", figure)]
    done = ridgewave(
        "study", str(tmp_path / "small.json"), "-o", str(tmp_path / "small.nc"), *asked, "--workers", "1"
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    again = [str(tmp_path / file) for file in ("two.svg", "two.png")]
    asked = [word for figure in again for word in ("--figure", figure)]
    assert ridgewave("study", str(tmp_path / "small.nc"), *asked).returncode == 0
    for one, two in zip(figures, again, strict=True):
        assert Path(one).read_bytes() == Path(two).read_bytes()


def test_every_ready_study_is_on_the_page_with_its_size() -> None:
    for name in ready_names():
        spec = read_spec(ready_text(name))
        assert f"`{name}`" in PAGE and f"figures/{name}.svg" in PAGE
        row = next(line for line in PAGE.splitlines() if line.startswith("|") and f"`{name}`" in line)
        assert re.search(rf"\b{spec.count}\b", row), row


def test_analyze_tells_by_what_a_texture_is_felt(ridgewave: RunsRidgewave) -> None:
    told = ridgewave("analyze", "grating-1mm-31um", "--everyday", "--json")
    assert json.loads(told.stdout)["felt_by"] == "vibration"
    table = ridgewave("analyze", "grating-5mm-200um", "--set", "finger.kind=comb", "--set", "scan.load=0.5")
    assert b"SA1" in table.stdout and b"spatial pattern" in table.stdout
    refused = ridgewave("analyze", "golf-ball-dimples")
    assert refused.returncode == 2 and b"does not vary across" in refused.stderr


@pytest.mark.parametrize(
    ("change", "words", "message"),
    [
        ({"figure": "duplx"}, (), b"curves, period-ratio"),
        ({"figure": "duplx"}, ("-o", "map.nc"), b"curves, period-ratio"),
        ({}, ("--figure", "map.gif"), b".svg, .png, .pdf"),
        ({"figure": "duplex"}, (), b"skin"),
        ({"figure": "sensitivity"}, (), b"saltelli"),
        ({"axes": {"texture.kind": ["denim-72x56"]}}, (), b"one of them of two numbers or more"),
    ],
)
def test_a_figure_that_cannot_be_drawn_says_what_it_needs(
    change: dict[str, Any], words: tuple[str, ...], message: bytes, ridgewave: RunsRidgewave, tmp_path: Path
) -> None:
    spec = {"axes": {"scan.load": [0.1, 0.2]}, "phases": 64} | change
    (tmp_path / "map.json").write_text(json.dumps(spec))
    asked = words or ("--figure", str(tmp_path / "map.svg"))
    done = ridgewave("study", str(tmp_path / "map.json"), *asked, "--workers", "1")
    assert done.returncode == 2 and message in done.stderr and b"Traceback" not in done.stderr
    assert [one.name for one in tmp_path.iterdir()] == ["map.json"], "nothing was solved"


def test_analyze_tells_whether_two_scenes_are_told_apart(ridgewave: RunsRidgewave) -> None:
    done = ridgewave("analyze", "grating-1mm-31um", "--beside", "grating-5mm-200um", "--set", "scan.load=0.5")
    assert done.returncode == 0 and b"told apart" in done.stdout
    same = ridgewave("analyze", "grating-1mm-31um", "--beside", "grating-1mm-31um", "--json")
    told = json.loads(same.stdout)
    assert told["verdict"] == "not told apart" and told["level_db"] == 0.0 and told["first"] == told["second"]
