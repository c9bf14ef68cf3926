"""docs/study.md: its spec, its example and its figure, at a small size."""

from __future__ import annotations

import json
import re
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from tests.conftest import RunsRidgewave

PAGE = (Path(__file__).resolve().parents[1] / "docs" / "study.md").read_text("utf-8")


def test_the_spec_of_the_page_is_solved(ridgewave: RunsRidgewave, tmp_path: Path) -> None:
    xarray = pytest.importorskip("xarray")
    found = re.search(r"echo '(\{.*\})' > map.json", PAGE)
    assert found is not None
    spec = json.loads(found[1])
    spec["axes"]["groups.period_ratio"]["count"] = 6
    (tmp_path / "map.json").write_text(json.dumps(spec))
    done = ridgewave("study", str(tmp_path / "map.json"), "-o", str(tmp_path / "map.nc"), "--workers", "1")
    assert done.returncode == 0, done.stderr
    with xarray.open_dataset(tmp_path / "map.nc") as made:
        assert made.rms.sel(quantity="displacement").shape == (6, 3)
        assert np.isfinite(made.rms.values).all()


def test_analyze_tells_by_what_a_texture_is_felt(ridgewave: RunsRidgewave) -> None:
    told = ridgewave("analyze", "grating-1mm-31um", "--everyday", "--json")
    assert json.loads(told.stdout)["felt_by"] == "vibration"
    table = ridgewave("analyze", "grating-5mm-200um", "--set", "finger.kind=comb", "--set", "scan.load=0.5")
    assert b"SA1" in table.stdout and b"spatial pattern" in table.stdout
    refused = ridgewave("analyze", "golf-ball-dimples")
    assert refused.returncode == 2 and b"does not vary across" in refused.stderr


@pytest.mark.parametrize("name", ["duplex", "period_ratio", "sensitivity"])
def test_a_figure_is_the_same_when_it_is_drawn_again(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("xarray")
    module = import_module(f"docs.figures.{name}")
    small = {"PERIODS": np.array([2e-4, 1e-3, 4e-3]), "SPEEDS": np.array([0.02, 0.08]), "COUNTS": (8, 4)}
    for constant in {"PERIODS", "SPEEDS", "COUNTS"} & set(vars(module)):
        monkeypatch.setattr(module, constant, small[constant])
    monkeypatch.setattr(module, "RESAMPLES", 20, raising=False)
    folders = tmp_path / "one", tmp_path / "two"
    for folder in folders:
        folder.mkdir()
        module.main([str(folder)])
    for ending in ("svg", "png"):
        assert (folders[0] / f"{name}.{ending}").read_bytes() == (folders[1] / f"{name}.{ending}").read_bytes()
