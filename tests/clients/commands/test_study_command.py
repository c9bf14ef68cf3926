"""`ridgewave study`: what it writes, and what it refuses."""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path

import pytest

from tests.conftest import RunsRidgewave

SPEC = {"axes": {"texture.period": ["0.4 mm", "0.8 mm"], "scan.load": ["0.1 N", "0.3 N"]}, "phases": 64, "lines": 3}


def written(folder: Path, spec: object = SPEC) -> Path:
    path = folder / "map.json"
    path.write_text(json.dumps(spec))
    return path


def test_a_study_is_written_as_a_table(ridgewave: RunsRidgewave, tmp_path: Path) -> None:
    out = tmp_path / "map.csv"
    done = ridgewave("study", str(written(tmp_path)), "-o", str(out), "--workers", "1", "--json")
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["scenes"] == 4 and told["not_solved"] == 0
    rows = list(csv.DictReader(out.open()))
    assert [row["scan.load"] for row in rows] == ["0.1", "0.3"] * 2
    assert all(float(row["rms_acceleration"]) > 0.0 for row in rows)
    assert not (tmp_path / "map.csv.parts").exists()
    again = ridgewave("study", str(written(tmp_path)), "-o", str(out))
    assert again.returncode == 2 and "does not exist" in str(again.stderr)


def test_bad_specs_end_before_anything_is_computed(ridgewave: RunsRidgewave, tmp_path: Path) -> None:
    for spec, word in (({"axes": {"texture.perod": [1]}}, "texture.perod"), ({"axes": {}}, "at least one field")):
        done = ridgewave("study", str(written(tmp_path, spec)), "-o", str(tmp_path / "map.nc"))
        assert done.returncode == 2 and word in str(done.stderr) and "Traceback" not in str(done.stderr)
    stroke = {"scene": {"scan": {"stroke": {}}}, "axes": {"texture.period": [1e-3, 2e-3]}}
    none = ridgewave("study", str(written(tmp_path, stroke)), "-o", str(tmp_path / "map.nc"), "--workers", "1")
    assert none.returncode == 1 and "not steady" in str(none.stderr) and "Traceback" not in str(none.stderr)
    missing = ridgewave("study", str(tmp_path / "none.json"), "-o", str(tmp_path / "map.nc"))
    assert missing.returncode == 2 and "exists" in str(missing.stderr)
    for asked in (["-o", "nowhere/map.nc"], ["-o", str(tmp_path / "map.nc"), "--figure", "nowhere/map.svg"]):
        done = ridgewave("study", str(written(tmp_path)), *asked)
        assert done.returncode == 2 and "Make nowhere first" in str(done.stderr)
    assert not list(tmp_path.glob("map.nc*"))


def test_an_imported_texture_is_studied_by_its_name_in_two_processes(
    ridgewave: RunsRidgewave, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RIDGEWAVE_DATA_FOLDER", str(tmp_path / "data"))
    heights = "".join(f"{5 * n}\t{8.0 * math.cos(math.pi * n / 40.0):.5f}\n" for n in range(400))
    (tmp_path / "mine.txt").write_text("x [um]\tz [um]\n" + heights)
    assert ridgewave("import", str(tmp_path / "mine.txt"), "--name", "mine").returncode == 0
    loads = {"scan.load": {"from": 0.1, "to": 1.0, "count": 20}}
    kinds = {"texture.kind": ["grating-800um-40um", "mine"]}
    specs = {"scene": "mine", "axes": loads | {"scan.speed": [0.05, 0.1]}}, {"axes": kinds | loads}
    for spec in specs:
        out = tmp_path / "mine.csv"
        text = written(tmp_path, spec | {"phases": 64, "lines": 3})
        done = ridgewave("study", str(text), "-o", str(out), "--workers", "2", "--overwrite")
        assert done.returncode == 0, done.stderr
        rows = list(csv.DictReader(out.open()))
        assert len(rows) == 40 and all(float(row["rms_acceleration"]) > 0.0 for row in rows)
    assert {row["texture.kind"] for row in rows} == set(kinds["texture.kind"])
