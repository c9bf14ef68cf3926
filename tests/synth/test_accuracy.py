"""The report of what accuracy costs: its errors against an independent reading of the model, and its own words."""

from __future__ import annotations

import json
import math
from functools import cache
from typing import Any

import numpy as np
import pytest

from synth.accuracy.methods import OVERSAMPLINGS, case_of, methods_of
from synth.accuracy.report import REPEATS, AccuracyReport, Measured, measure_accuracy
from synth.errors import AskedWrong, CannotRender
from synth.perception.threshold import threshold_displacement
from synth.response.spectrum import Demand, curves, points_for, solve_spectrum
from tests.synth.engine_cases import contact_of, scene_of

QUICK: dict[str, Any] = {
    "finger": {"contact_length": "2 mm"},
    "scan": {"speed": 0.6, "load": 0.01},
    "output": {"channels": ["displacement", "acceleration"], "sample_rate": 8000, "duration": 1.0},
}
FIELDS = {
    "method", "family", "max_error", "rms_error", "error_m", "worst_harmonic_db", "threshold_margin_db",
    "setup_seconds", "seconds_per_second", "times_real_time", "memory_bytes", "pareto",
}  # fmt: skip


FEW = 1  # timings of a method, where no test looks at how steady they are


@pytest.fixture(autouse=True)
def few_repeats(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("synth.accuracy.report.REPEATS", FEW)


@cache
def report(quantity: str = "displacement") -> AccuracyReport:
    return measure_accuracy(scene_of(**QUICK), quantity=quantity)


def rows(family: str, part: str = "", quantity: str = "displacement") -> list[Measured]:
    return [row for row in report(quantity).methods if row.family == family and part in row.method]


def test_every_family_is_measured_and_the_plans_choice_is_among_them() -> None:
    made = report()
    assert {row.family for row in made.methods} == {"baseline", "sampled", "exact", "table", "harmonics"}
    assert [row.method for row in made.methods].count(made.chosen) == 1
    assert len({row.method for row in made.methods}) == len(made.methods)


def test_full_contact_adds_the_closed_form_and_the_plan_takes_it() -> None:
    made = measure_accuracy(scene_of(**(QUICK | {"scan": {"speed": 0.6, "load": 30}})))
    closed = [row for row in made.methods if row.family == "closed"]
    assert [row.method for row in closed] == [made.chosen] == ["closed form"]
    assert closed[0].max_error <= 5e-8


@pytest.mark.parametrize("quantity", ["displacement", "acceleration"])
@pytest.mark.parametrize("family", ["sampled", "exact", "table"])
def test_more_work_comes_nearer(family: str, quantity: str) -> None:
    part = "cubic" if family == "table" else ""
    found = [row for row in rows(family, part, quantity) if "cells" not in row.method]
    errors = np.array([row.max_error for row in found])
    assert errors[-1] < 1e-2 * errors[0]
    assert np.all(errors[2:] <= 1.5 * errors[:-2])


def test_a_table_errs_by_what_an_independent_reading_of_it_shows() -> None:
    """64 exact phases, joined by straight lines, against a series of thousands."""
    scene = scene_of(**QUICK)
    contact = contact_of(scene)
    (row,) = (row for row in rows("table", "linear") if row.method.startswith("response table, 64 phases"))
    highest = 4  # 750 Hz below 3200 Hz
    truth = solve_spectrum(contact, 0.01, Demand(highest, (0,), 1e-7), highest).harmonics
    heights = contact.approach(np.arange(64) / 64, 0.01)[0]
    kept = np.fft.rfft(heights) / 64
    kept[0] = 0.0
    kept[highest + 1 :] = 0.0
    points = np.fft.irfft(kept, 64) * 64
    theta = (np.arange(1 << 14) + 0.5) / (1 << 14)
    read = np.interp(theta * 64, np.arange(65), np.append(points, points[0]))
    truth[0] = 0.0
    angles = np.exp(2j * np.pi * np.outer(theta, np.arange(highest + 1)))
    error = read - 2.0 * np.real(angles @ truth)
    extent = np.ptp(curves(truth, 0, points_for(highest)))
    assert row.max_error == pytest.approx(np.max(np.abs(error)) / extent, rel=0.02)
    assert row.rms_error == pytest.approx(np.sqrt(np.mean(error**2)) / extent, rel=0.02)
    assert row.error_m == pytest.approx(np.max(np.abs(error)), rel=0.02)
    lines = 2.0 * np.abs(np.fft.rfft(error))[1:] / len(theta)
    strongest = 2.0 * np.max(np.abs(truth))
    assert row.worst_harmonic_db == pytest.approx(20 * math.log10(np.max(lines[:highest]) / strongest), abs=0.5)
    frequency = 750.0 * np.arange(1, len(lines) + 1)
    folded = np.maximum(np.abs(frequency - np.rint(frequency / 8000) * 8000), 1.0)
    margin = -20 * math.log10(np.max(lines / threshold_displacement(folded)))
    assert row.threshold_margin_db == pytest.approx(margin, abs=0.5)


def test_the_plans_choice_keeps_the_tolerance_of_the_scene() -> None:
    for quantity in ("displacement", "acceleration"):
        made = report(quantity)
        (row,) = (row for row in made.methods if row.method == made.chosen)
        assert row.max_error <= 1e-3


def test_the_front_is_what_nothing_else_beats() -> None:
    made = report()
    for row in made.methods:
        cost = row.setup_seconds + row.seconds_per_second * made.duration
        beaten = any(
            (other.max_error <= row.max_error and other.setup_seconds + other.seconds_per_second * made.duration < cost)
            or (
                other.max_error < row.max_error
                and other.setup_seconds + other.seconds_per_second * made.duration <= cost
            )
            for other in made.methods
        )
        assert row.pareto is not beaten
    assert not any(row.pareto for row in made.methods if row.family == "baseline")


def test_the_document_is_json_with_every_field() -> None:
    made = report().document()
    assert json.loads(json.dumps(made, allow_nan=False)) == made
    assert all(set(row) == FIELDS for row in made["methods"])
    assert made["repeats"] == FEW and REPEATS >= 3
    assert made["threshold"] == "fingertip" and made["quantity"] == "displacement" and made["unit"] == "m"
    assert 0.0 < made["reference_error"] < 1e-6
    assert all(row["setup_seconds"] > 0 and row["seconds_per_second"] > 0 for row in made["methods"])
    assert all(row["times_real_time"] == 1.0 / row["seconds_per_second"] for row in made["methods"])


def test_another_threshold_moves_the_margins_alone() -> None:
    accuracy = {"accuracy": {"threshold": "pen"}}
    other = measure_accuracy(scene_of(**(QUICK | accuracy)))
    assert other.threshold == "pen"
    pairs = [(a, b) for a in report().methods for b in other.methods if a.method == b.method]
    assert all(a.max_error == b.max_error for a, b in pairs)
    assert any(abs(a.threshold_margin_db - b.threshold_margin_db) > 3.0 for a, b in pairs)


def test_the_baseline_is_measured_at_every_oversampling_and_tabled_until_it_meets_the_tolerance() -> None:
    for quantity in ("displacement", "acceleration"):
        found = rows("baseline", quantity=quantity)
        for count in OVERSAMPLINGS:
            assert any(row.method.endswith(f"oversampling {count}") for row in found)
        for kind in ("oversampling", "tabled"):
            assert min(row.max_error for row in found if kind in row.method) <= 1e-3
        assert sum(row.max_error <= 1e-3 for row in found) < len(found) / 2


def test_a_tabled_baseline_costs_its_phases_in_set_up_and_is_then_as_fast_as_any_table() -> None:
    tabled = {row.method: row for row in rows("baseline", "tabled")}
    framed = {row.method: row for row in rows("baseline", "oversampling 1", "displacement")}
    for name, row in tabled.items():
        points, phases = name.split(", ")[1], int(name.split(", ")[-1].split()[0])
        frame = framed.get(f"trapezoid and brentq, {points}, oversampling 1")
        if frame is not None:
            expected = phases * frame.seconds_per_second / 8000
            assert 0.03 * expected < row.setup_seconds < 30.0 * expected  # other work on the machine takes less
        assert row.seconds_per_second < 0.1


def test_what_a_process_takes_once_is_told_apart_from_the_set_up() -> None:
    made = report()
    assert 0.1 < made.process_seconds < 1000.0 and 0.0 <= made.compile_seconds < made.process_seconds


def test_progress_is_told_before_each_method() -> None:
    told: list[tuple[str, int, int]] = []
    scene = scene_of(**(QUICK | {"output": {"sample_rate": 1000, "bandwidth": 400}, "scan": {"speed": 0.1}}))
    made = measure_accuracy(scene, progress=lambda *one: told.append(one))
    count = len(made.methods) + len(made.left_out)
    done = [done for _name, done, _of in told]
    assert done == list(range(len(told)))
    assert {of for _name, _done, of in told} == {len(told) - 1} and len(told) > count


def test_a_quantity_that_the_scene_lacks_is_asked_wrong() -> None:
    with pytest.raises(AskedWrong, match="velocity"):
        measure_accuracy(scene_of(**QUICK), quantity="velocity")


@pytest.mark.parametrize(
    "sections", [{"texture": {"amplitude": 0}}, {"scan": {"load": 0}}, {"scan": {"speed": 0}}, {"scan": {"speed": 9}}]
)
def test_nothing_is_measured_where_nothing_moves(sections: dict[str, Any]) -> None:
    output = {"sample_rate": 8000}
    with pytest.raises(CannotRender, match="nothing to measure"):
        measure_accuracy(scene_of(**sections, output=output))


def test_what_would_take_too_long_is_left_out_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("synth.accuracy.report.PATIENCE", 0.5)
    scene = scene_of(scan={"speed": 1e-4}, output={"sample_rate": 8000, "bandwidth": 100})
    case = case_of(scene, 0)
    listed = {method.name for method in methods_of(case)}
    made = measure_accuracy(scene)
    assert made.left_out
    assert all("s to measure" in left.reason for left in made.left_out if left.family != "baseline")
    assert {row.method for row in made.methods} | {left.method for left in made.left_out} >= listed
    assert any(left.family == "baseline" for left in made.left_out)


def test_a_stroke_is_measured_at_its_speed_and_load() -> None:
    stroke = scene_of(**(QUICK | {"scan": {"stroke": {"speed": 0.6, "load": 0.01}}}))
    assert measure_accuracy(stroke).peak_to_peak == pytest.approx(report().peak_to_peak, rel=1e-12)
