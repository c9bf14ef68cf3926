"""The accuracy report: its errors against an independent implementation of the model, and its reasons and names."""

from __future__ import annotations

import json
import math
from functools import cache
from time import thread_time
from typing import Any

import numpy as np
import pytest

from synth.accuracy.baseline import Trapezoid
from synth.accuracy.methods import Case, chosen_method, methods_of
from synth.accuracy.methods import case_of as case_of_solved
from synth.accuracy.report import REPEATS, AccuracyReport, Measured, measure_accuracy
from synth.accuracy.steady import reference_of
from synth.contact.scene_contact import contact_of
from synth.contact.stiffness import Stiffness
from synth.errors import InvalidRequest
from synth.perception.threshold import threshold_displacement
from synth.plan.prepare import prepare
from synth.plan.scene_table import read_error, table_of_scene
from synth.response.demand import Demand, curves, points_for
from synth.response.spectrum import solve_spectrum
from synth.surfaces import profile_of
from tests.few import thorough
from tests.reference.kinds_oracle import approach
from tests.synth.engine_cases import Real, scene_of

QUICK: dict[str, Any] = {
    "finger": {"contact_length": "2 mm"},
    "scan": {"speed": 0.6, "load": 0.01},
    "output": {"channels": ["displacement", "acceleration"], "sample_rate": 8000, "duration": 1.0},
}
KINDS: dict[str, dict[str, Any]] = {
    "sinusoid": {},
    "harmonics": {"kind": "harmonics", "period": "0.8 mm", "amplitudes": ["20 um", "8 um"], "phases": [0.3, 1.0]},
    "grating": {"kind": "grating", "period": "0.9 mm", "height": "30 um", "duty": 0.4, "ramp": "0.1 mm"},
    "rough": {"kind": "rough", "period": "3 mm", "hurst": 0.8, "rms_height": "6 um", "longest": "1 mm",
              "shortest": "0.1 mm", "seed": 3},
    "profile": {"kind": "profile", "heights": [0.0, 2e-5, 1e-5, 3e-5, -1e-5, 5e-6], "spacing": "0.15 mm"},
}  # fmt: skip
SHOWN = ("sinusoid", "grating")
SOME_KINDS = [kind if kind in SHOWN else thorough(kind) for kind in KINDS]
REPORTS = [("displacement", kind) if kind in SHOWN else thorough("displacement", kind) for kind in KINDS]
REPORTS.append(thorough("acceleration", "sinusoid"))
FIELDS = {
    "method", "family", "max_error", "rms_error", "error_m", "worst_harmonic_db", "threshold_margin_db",
    "setup_seconds", "seconds_per_second", "times_real_time", "memory_bytes", "pareto",
}  # fmt: skip
FAMILIES = ["baseline", "sampled", "exact", "table", "harmonics"]
FEW = 1  # timings of a method, in tests that do not check their spread
ORACLE = 4e-4  # error of the oracle's quadrature, relative to the peak-to-peak


@pytest.fixture(autouse=True)
def few_repeats(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("synth.accuracy.report.REPEATS", FEW)
    monkeypatch.setattr("synth.accuracy.report.PATIENCE", 0.25)
    monkeypatch.setattr("synth.accuracy.methods.TABLE_SECONDS", 0.2)  # so that the tables are measured
    monkeypatch.setattr("synth.accuracy.report.perf_counter", thread_time)  # other work on the machine does not count


@pytest.fixture
def short_patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave the slow methods out."""
    monkeypatch.setattr("synth.accuracy.report.PATIENCE", 0.03)


A_PHASE = 1e-6  # s, less than on any machine: nothing is left out because one is busy


def scene_of_kind(kind: str) -> Any:
    return scene_of(**(QUICK | ({"texture": KINDS[kind]} if KINDS[kind] else {})))


def case_of(scene: Any, channel: int) -> Case:
    return case_of_solved(prepare(scene), channel)


def report(quantity: str = "displacement", kind: str = "sinusoid") -> AccuracyReport:
    return measured_once(quantity, kind)


@cache
def measured_once(quantity: str, kind: str) -> AccuracyReport:
    """Return a report whose methods are the same on any machine, however busy: no clock leaves one out."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("synth.accuracy.methods.seconds_a_phase", lambda _solve: A_PHASE)
        patch.setattr("synth.accuracy.report.BUDGET", math.inf)
        return measure_accuracy(scene_of_kind(kind), quantity=quantity)


def rows(family: str, part: str = "", quantity: str = "displacement", kind: str = "sinusoid") -> list[Measured]:
    return [row for row in report(quantity, kind).methods if row.family == family and part in row.method]


@pytest.mark.parametrize("kind", SOME_KINDS)
def test_every_family_is_measured_of_every_kind_and_the_plans_choice_is_among_them(kind: str) -> None:
    made = report(kind=kind)
    assert list(dict.fromkeys(row.family for row in made.methods)) == FAMILIES
    assert [row.method for row in made.methods].count(made.chosen) == 1
    assert len({row.method for row in made.methods}) == len(made.methods)


def test_what_two_cosines_alone_have_is_left_out_elsewhere_with_the_reason() -> None:
    def left(kind: str) -> dict[str, str]:
        found = {one.method: one.reason for one in report(kind=kind).left_out}
        return {name: reason for name, reason in found.items() if "to measure" not in reason}

    assert left("sinusoid") == {"closed form": "The load does not flatten the whole contact at every phase."}
    other = left("grating")
    assert "antiderivatives in closed form" in other["exact solver in closed form"]
    assert "sinusoid only if the texture is a sinusoid" in other["closed form"]
    assert rows("exact", "exact solver") and not rows("exact", "exact solver", kind="grating")


@pytest.mark.usefixtures("short_patience")
def test_full_contact_adds_the_closed_form_and_the_plan_takes_it() -> None:
    made = measure_accuracy(scene_of(**(QUICK | {"scan": {"speed": 0.6, "load": 30}})))
    closed = [row for row in made.methods if row.family == "closed"]
    assert [row.method for row in closed] == [made.chosen] == ["closed form"]
    assert closed[0].max_error <= 5e-8 and not any(one.family == "closed" for one in made.left_out)


@pytest.mark.parametrize(("quantity", "kind"), REPORTS)
@pytest.mark.parametrize("family", ["baseline", "sampled", "exact", "harmonics"])
def test_more_work_comes_nearer(family: str, quantity: str, kind: str) -> None:
    """The error falls to the reference, or to the error of the solver's own segments."""
    found = [row for row in rows(family, "", quantity, kind) if row.method != report(quantity, kind).chosen]
    found = [row for row in found if "tabled" not in row.method]
    errors = np.array([row.max_error for row in found])
    floor = max(1e-3 * 0.1, 4.0 * report(quantity, kind).reference_error) if kind != "sinusoid" else 0.0
    assert len(errors) >= 3 and (errors[-1] < 0.05 * errors[0] or errors[-1] <= floor)
    assert np.all((errors[2:] <= 1.5 * errors[:-2]) | (errors[2:] <= floor))


@cache
def truth_of(kind: str, phases: int = 1024) -> tuple[Real, int]:
    """Return z (m) of the oracle at equal steps of a period, and the number of harmonics below 3200 Hz."""
    scene = scene_of_kind(kind)
    profile = profile_of(scene)
    pressed = scene.scan.load / Stiffness.of_scene(scene).stiffness(scene.scan.load)
    z = approach(scene.finger, profile, np.arange(phases) / phases, pressed)
    return z, math.ceil(3200.0 * profile.period / 0.6) - 1


@pytest.mark.parametrize("kind", SOME_KINDS)
def test_the_reference_is_the_oracles_quadrature_of_every_kind(kind: str) -> None:
    z, highest = truth_of(kind)
    wanted = np.fft.rfft(z)[: highest + 1] / len(z)
    wanted[0] = 0.0
    case = case_of(scene_of_kind(kind), 0)
    series, error = reference_of(case)
    assert case.solved.highest == highest
    apart = curves(wanted - series, 0, 4096)
    assert np.max(np.abs(apart)) <= ORACLE * case.extent
    assert error <= 1e-4


@pytest.mark.parametrize("kind", SOME_KINDS)
def test_coarse_methods_err_by_what_the_oracle_shows(kind: str) -> None:
    """A series of 8 phases and a trapezoid of 25 points per ridge, computed here, against the oracle's quadrature."""
    z, highest = truth_of(kind)
    case = case_of(scene_of_kind(kind), 0)
    wanted = curves(np.fft.rfft(z)[: highest + 1] / len(z), 0, 4096)

    def error_of(heights: Real) -> float:
        kept = np.fft.rfft(heights)[: highest + 1] / len(heights)
        if len(heights) // 2 < len(kept):
            kept[-1] *= 0.5  # the line at half the number counts for both sides
        return float(np.max(np.abs(curves(kept, 0, 4096) - wanted)) / case.extent)

    (coarse,) = rows("harmonics", " 8 phases", kind=kind)
    few = error_of(z[:: len(z) // 8])
    assert coarse.max_error == pytest.approx(few, rel=0.02, abs=2.0 * ORACLE)
    (tabled,) = rows("baseline", "25 points a ridge, tabled, 512", kind=kind)
    rule, target = Trapezoid(case.contact, case.load, 25), np.full(512, case.contact.indentation(case.load))
    solved = error_of(rule.solved(np.arange(512) / 512, target))
    assert tabled.max_error == pytest.approx(solved, rel=0.02, abs=2.0 * ORACLE)


@pytest.mark.parametrize("kind", SOME_KINDS)
@pytest.mark.parametrize("points", [25, 100])
def test_the_roots_of_the_trapezoid_rule_are_those_of_brentq(kind: str, points: int) -> None:
    case = case_of(scene_of_kind(kind), 0)
    rule = Trapezoid(case.contact, case.load, points)
    phases = np.linspace(-1.0, 2.0, 40)
    targets = np.geomspace(0.1, 10.0, 40) * case.contact.indentation(case.load)
    apart = rule.roots(phases, targets) - rule.solved(phases, targets)
    assert np.max(np.abs(apart)) <= 4e-15 * case.contact.geometry.height_scale


def test_every_measure_of_an_error_is_what_an_independent_reading_shows() -> None:
    """Compares the series of 16 exact phases with one of thousands."""
    scene = scene_of(**QUICK)
    contact = contact_of(scene)
    (row,) = rows("harmonics", " 16 phases")
    highest = 4  # harmonics of 750 Hz below 3200 Hz
    truth = solve_spectrum(contact, 0.01, Demand(highest, (0,), 1e-7), highest).harmonics
    kept = np.fft.rfft(contact.approach(np.arange(16) / 16, 0.01)[0])[: highest + 1] / 16
    kept[0] = truth[0] = 0.0
    theta = (np.arange(1 << 14) + 0.5) / (1 << 14)
    angles = np.exp(2j * np.pi * np.outer(theta, np.arange(highest + 1)))
    error = 2.0 * np.real(angles @ (kept - truth))
    extent = np.ptp(curves(truth, 0, points_for(highest)))
    assert row.max_error == pytest.approx(np.max(np.abs(error)) / extent, rel=0.02)
    assert row.rms_error == pytest.approx(np.sqrt(np.mean(error**2)) / extent, rel=0.02)
    assert row.error_m == pytest.approx(np.max(np.abs(error)), rel=0.02)
    lines = 2.0 * np.abs(np.fft.rfft(error))[1:] / len(theta)
    strongest = 2.0 * np.max(np.abs(truth))
    assert row.worst_harmonic_db == pytest.approx(20 * math.log10(np.max(lines[:highest]) / strongest), abs=0.5)
    frequency = 750.0 * np.arange(1, highest + 1)
    margin = -20 * math.log10(np.max(lines[:highest] / threshold_displacement(frequency)))
    assert row.threshold_margin_db == pytest.approx(margin, abs=0.5)


@pytest.mark.parametrize("kind", SOME_KINDS)
def test_the_table_errs_by_no_more_than_it_tells_a_live_voice(kind: str) -> None:
    scene = scene_of_kind(kind)
    case, table = case_of(scene, 0), table_of_scene(scene)
    told = read_error(table, "displacement", 8000, (0.01, 0.01), case.solved.highest)
    (row,) = rows("table", "to a 2000th", kind=kind)
    assert row.max_error <= told
    assert row.memory_bytes == table.memory_bytes


def test_backwards_the_table_reads_what_it_reads_forwards() -> None:
    made = []
    for speed in (0.6, -0.6):
        case = case_of(scene_of(**(QUICK | {"scan": {"speed": speed, "load": 0.01}})), 0)
        (table,) = (method for method in methods_of(case) if method.name.endswith("to a 2000th"))
        made.append(table.set_up().values(0))
    assert np.max(np.abs(made[0] - made[1])) <= 1e-3 * np.ptp(made[0])


@pytest.mark.parametrize(("quantity", "kind"), REPORTS)
def test_the_plans_choice_keeps_the_tolerance_of_the_scene(quantity: str, kind: str) -> None:
    made = report(quantity, kind)
    (row,) = (row for row in made.methods if row.method == made.chosen)
    assert row.max_error <= 1e-3


def test_the_plans_choice_is_named_as_the_sizes_beside_it() -> None:
    case = case_of(scene_of(**QUICK), 0)
    spectrum = case.solved.spectrum
    assert spectrum is not None
    assert chosen_method(case, 0).name == f"sum of harmonics, {spectrum.phases} phases"


@pytest.mark.parametrize("kind", ["sinusoid", "grating"])
def test_the_front_is_what_nothing_else_beats(kind: str) -> None:
    made = report(kind=kind)
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
    assert any(row.pareto for row in made.methods)
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


@pytest.mark.usefixtures("short_patience")
def test_another_threshold_moves_the_margins_alone() -> None:
    accuracy = {"accuracy": {"threshold": "pen"}}
    other = measure_accuracy(scene_of(**(QUICK | accuracy)))
    assert other.threshold == "pen"
    pairs = [(a, b) for a in report().methods for b in other.methods if a.method == b.method]
    assert all(a.max_error == b.max_error for a, b in pairs)
    assert any(abs(a.threshold_margin_db - b.threshold_margin_db) > 3.0 for a, b in pairs)


def test_a_tabled_baseline_costs_its_phases_in_set_up_and_is_then_as_fast_as_any_series() -> None:
    framed = {row.method.split(", ")[1]: row for row in rows("baseline", "oversampling")}
    for row in rows("baseline", "tabled"):
        _name, points, _tabled, phases = row.method.split(", ")
        if points in framed and "oversampling 1" in framed[points].method:
            expected = int(phases.split()[0]) * framed[points].seconds_per_second / 8000
            assert (
                0.03 * expected < row.setup_seconds < 30.0 * expected
            )  # a wide range, because of other work on the machine
        assert row.seconds_per_second < 0.1
    assert min(row.max_error for row in rows("baseline")) <= 1e-3


def test_what_a_process_takes_once_is_told_apart_from_the_set_up() -> None:
    made = report()
    assert 0.1 < made.process_seconds < 1000.0 and 0.0 <= made.compile_seconds < made.process_seconds


@pytest.mark.usefixtures("short_patience")
def test_progress_is_told_before_each_method() -> None:
    told: list[tuple[str, int, int]] = []
    scene = scene_of(**(QUICK | {"output": {"sample_rate": 1000, "bandwidth": 400}, "scan": {"speed": 0.1}}))
    made = measure_accuracy(scene, progress=lambda *one: told.append(one))
    count = len(made.methods) + sum("to measure" in one.reason for one in made.left_out)
    assert [done for _name, done, _of in told] == list(range(count + 1))
    assert {of for _name, _done, of in told} == {count}


def test_a_quantity_that_the_scene_lacks_is_an_invalid_request() -> None:
    with pytest.raises(InvalidRequest, match="velocity"):
        measure_accuracy(scene_of(**QUICK), quantity="velocity")


@pytest.mark.parametrize(
    "sections", [{"texture": {"amplitude": 0}}, {"scan": {"load": 0}}, {"scan": {"speed": 0}}, {"scan": {"speed": 9}}]
)
def test_nothing_is_measured_where_nothing_moves(sections: dict[str, Any]) -> None:
    output = {"sample_rate": 8000}
    with pytest.raises(InvalidRequest, match="nothing to measure"):
        measure_accuracy(scene_of(**sections, output=output))


@pytest.mark.usefixtures("short_patience")
def test_what_would_take_too_long_is_left_out_by_name() -> None:
    scene = scene_of(**(QUICK | {"scan": {"speed": 1e-3}, "output": {"sample_rate": 8000, "bandwidth": 100}}))
    listed = {method.name for method in methods_of(case_of(scene, 0))}
    made = measure_accuracy(scene)
    late = [left for left in made.left_out if left.reason.endswith("s to measure.")]
    assert {"baseline", "exact"} <= {left.family for left in late}
    assert {row.method for row in made.methods} | {left.method for left in late} >= listed
