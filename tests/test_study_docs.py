"""docs/study.md: its spec, its example and its figure, at a small size."""

from __future__ import annotations

import json
import re
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


def test_the_figure_is_the_same_when_it_is_drawn_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from docs.figures import duplex

    monkeypatch.setattr(duplex, "PERIODS", np.array([2e-4, 1e-3, 4e-3]))
    monkeypatch.setattr(duplex, "SPEEDS", np.array([0.02, 0.08]))
    folders = tmp_path / "one", tmp_path / "two"
    for folder in folders:
        folder.mkdir()
        duplex.main([str(folder)])
    for name in ("duplex.svg", "duplex.png"):
        assert (folders[0] / name).read_bytes() == (folders[1] / name).read_bytes()
