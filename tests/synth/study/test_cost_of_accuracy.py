"""What fewer phases cost and change: rows against studies of the same scenes."""

from __future__ import annotations

import numpy as np
import pytest

import ridgewave as rw
from synth.study.cost_of_accuracy import accuracy_rows
from synth.study.spec import read_spec

AXES = {"texture.period": {"from": "0.5 mm", "to": "2 mm", "count": 6}, "scan.load": [0.1, 0.4]}


def test_rows_are_the_distances_of_studies_with_other_phases() -> None:
    rows = accuracy_rows(read_spec({"axes": AXES}))
    assert [row["phases"] for row in rows] == [16, 64, 256, 1024, 4096]
    assert all(row["seconds"] > 0.0 for row in rows)
    coarse, fine = (rw.sweep({}, AXES, phases=count, lines=1) for count in (64, 4096))
    for name in ("displacement", "acceleration"):
        apart = np.abs(20.0 * np.log10((coarse.rms / fine.rms).sel(quantity=name).values))
        assert rows[1][name]["rms_db"] == pytest.approx([np.median(apart), np.max(apart)])
        told = coarse.error.sel(quantity=name).values
        assert rows[1][name]["told"] == pytest.approx([np.median(told), np.max(told)])
    level = np.abs(coarse.sensation_level - fine.sensation_level).values
    assert rows[1]["level_db"] == pytest.approx([np.median(level), np.max(level)])
    felt = np.mean((coarse.sensation_level > 0).values != (fine.sensation_level > 0).values)
    assert rows[1]["verdicts"] == pytest.approx(float(felt))
    assert rows[-1]["verdicts"] == 0.0 and rows[-1]["level_db"] == [0.0, 0.0]


def test_a_study_without_a_scene_that_can_be_solved_says_why() -> None:
    spec = read_spec({"axes": {"groups.ridges": [300.0], "finger.ridge_period": [5e-4]}})
    with pytest.raises(rw.CannotRender, match="length"):
        accuracy_rows(spec)
