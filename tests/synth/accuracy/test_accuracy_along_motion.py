"""Reports along a motion: their errors against independent solutions, a table for every scene, and a bounded time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.signal import firwin
from scipy.special import erfc

from synth.accuracy.baseline import AREA_SIZES, SIZES, baseline_along
from synth.accuracy.hand import rubbed
from synth.accuracy.method import Subject
from synth.accuracy.motion import FINEST, MotionCase, solved_reference
from synth.accuracy.motion_methods import file_methods
from synth.accuracy.report import live_subject, measure_accuracy, moving_subject
from synth.accuracy.simulated import BASELINE
from synth.contact.stiffness import Stiffness
from synth.motion.motion import LOAD
from synth.motion.scan_motion import ScanMotion
from synth.plan.prepare import prepare
from synth.plan.usual_hand import prepare_hand
from synth.scene.scene import Scene, parse_scene, scene_document
from tests.few import paired, thorough
from tests.reference.area_oracle import approach, dots
from tests.reference.moving_oracle import Finger, Profile, elastic, steady_scan
from tests.reference.stiffness_oracle import stiffness
from tests.synth.contact.fingertip_study import brute_heights
from tests.synth.engine_cases import Real, touch_of

SHORT = {"contact_length": "1.2 mm"}  # few ridges: quick to solve
OUTPUT = {"quantity": "acceleration", "sample_rate": 8000, "bandwidth": 600, "duration": 0.12}
STEPS = 24_000  # Hz, of the oracle
ASIDE = 0.25  # s that it computes before and after the output: the edge of the band rings for less
MEANS = 161  # loads at which its mean over a period is solved
LANDING: list[list[float]] = [
    [0, 0, 0],
    [0.02, 1e-3, 0],
    [0.03, 1.8e-3, 0.3],
    [0.06, 4e-3, 0.4],
    [0.09, 6.5e-3, 0.35],
    [0.12, 9e-3, 0.3],
]
DRAWN = 150  # points along and across of a comb over dots
STROKE = {"stroke": {"speed": "80 mm/s", "length": "8 mm", "load": "0.3 N", "turn_time": "50 ms"}}
NEAR = 0.1  # of an error: how far the oracle may be from it

Heights = Callable[[Real, Real, Real], Real]


def oracle_along(scene: Scene, z: Heights, steps: int = STEPS, means: int = MEANS) -> Real:
    """Return the acceleration (m/s^2) at the frames of `scene`, from z at `steps` (Hz) along its motion.

    z: m, at phases (turns), loads (N) and how far the texture has moved across (m).
    """
    every, rate = steps // scene.output.sample_rate, float(steps)
    aside, count = round(ASIDE * rate), round(scene.output.duration * rate)
    motion = ScanMotion(scene, rate).at(-aside, count + 2 * aside)
    phases, loads = motion.position / scene.texture.period, motion.samples[LOAD]
    across = motion.path[0] if motion.path.size else np.zeros(len(loads))
    values = np.zeros(len(loads))
    there = np.flatnonzero(loads > 0.0)
    values[there] = z(phases[there], loads[there], across[there])
    if means:
        roots = np.linspace(np.cbrt(1e-6), np.cbrt(1.1 * loads.max()), means)
        places, none = np.arange(64) / 64, np.zeros(64)
        values[there] -= CubicSpline(roots, [np.mean(z(places, np.full(64, root**3), none)) for root in roots])(
            np.cbrt(loads[there])
        )
    s = np.minimum(loads / scene.scan.lift_load, 1.0)
    own = slice(aside, aside + count, every)
    made = in_band(scene, values * s**3 * (10.0 + s * (6.0 * s - 15.0)), steps)[own]
    return np.asarray(made * (loads[own] > 0.0))


def in_band(scene: Scene, values: Real, steps: int) -> Real:
    """Return the second time derivative of `values` at `steps` (Hz), cut at the edge of a file (docs/scene.md)."""
    hertz = np.fft.rfftfreq(len(values), 1.0 / steps)
    lines = np.fft.rfft(values - np.linspace(values[0], values[-1], len(values)))
    lines *= 0.5 * erfc((hertz / scene.output.bandwidth_hz - 0.96) / 0.018) * (2j * np.pi * hertz) ** 2
    return np.asarray(np.fft.irfft(lines, len(values)))


def of_comb(scene: Scene) -> Heights:
    """Return z (m) of a comb on a sinusoid, by the areas of monotone stretches."""
    touch = touch_of(scene)
    profile = Profile(touch)

    def heights(phases: Real, loads: Real, _across: Real) -> Real:
        depths = [load / stiffness(replace(touch, load=load)).k for load in loads.tolist()]
        return np.array([elastic(profile, depth, phase) for depth, phase in zip(depths, phases.tolist(), strict=True)])

    return heights


def of_period(z: Real) -> Heights:
    """Return the heights of which `z` is one period, in equal steps, at one load."""
    turns = np.arange(len(z) + 1) / len(z)
    curve = CubicSpline(turns, np.append(z, z[0]), bc_type="periodic")
    return lambda phases, _loads, _across: np.asarray(curve(phases % 1.0))


def on_dots(scene: Scene) -> Heights:
    """Return z (m) of a comb over dots, by a sum over DRAWN by DRAWN points."""
    finger, texture = scene.finger, scene_document(scene)["texture"]
    length = scene_document(scene)["finger"]["contact_length"]
    parts = (np.arange(DRAWN) + 0.5) * (length / DRAWN)
    x, y = np.repeat(parts, DRAWN), np.tile(parts - 0.5 * length, DRAWN)
    ridges = -finger.ridge_amplitude * np.cos(2.0 * np.pi * x / finger.ridge_period)
    shape = [texture[name] for name in ("dot_height", "dot_diameter", "dot_top", "phase")]
    under = dots(texture["period"], texture["row_distance"], 0.0, *shape)
    law, period = Stiffness.of_scene(scene), texture["period"]

    def heights(phases: Real, loads: Real, across: Real) -> Real:
        return np.array([
            approach(x, y, ridges, 1.0 / len(x), under, np.array([place]), law.indentation(load))[0]
            for place, load in zip(np.stack([phases * period, across], axis=1), loads.tolist(), strict=True)
        ])  # fmt: skip

    return heights


def subject_of(scene: Scene) -> Subject:
    return moving_subject(prepare(scene), 0, 0.0)


def check_errors(subject: Subject, truth: Real, own_error: float) -> dict[str, float]:
    """Assert that the errors of a file's methods are those against `truth` (SI); return them by name."""
    extent, found = float(np.ptp(truth)), {}
    assert subject.extent == pytest.approx(extent, rel=2.0 * own_error)
    for method in subject.methods:
        ready = method.set_up()
        if ready.live:
            continue
        true = float(np.max(np.abs(ready.values(0) - truth))) / extent
        found[method.name] = told = subject.errors(ready).max_error
        assert told == pytest.approx(true, rel=NEAR, abs=own_error + subject.reference_error), method.name
    return found


@pytest.mark.parametrize("scan", [thorough({"trajectory": LANDING}), STROKE], ids=["landing", "stroke"])
def test_the_errors_along_a_motion_are_those_against_an_oracle(scan: dict[str, Any]) -> None:
    scene = parse_scene({"finger": SHORT, "scan": scan, "output": OUTPUT})
    subject = subject_of(scene)
    found = check_errors(subject, oracle_along(scene, of_comb(scene)), 5e-5)
    assert found[subject.chosen] <= 1e-3
    families = {method.family for method in subject.methods}
    assert {"baseline", "sampled", "steps", "table"} <= families and ("harmonics" in families) is ("stroke" in scan)


@pytest.mark.thorough
def test_the_errors_of_a_fingertips_stroke_are_those_against_brute_force() -> None:
    finger = {"kind": "fingertip", "contact_length": "2 mm", "contact_width": "2 mm"}
    scene = parse_scene({"finger": finger, "texture": {"period": "1 mm"}, "scan": STROKE, "output": OUTPUT})
    subject = subject_of(scene)
    truth = oracle_along(scene, of_period(brute_heights(scene, 512, 1.0)), means=0)
    found = check_errors(subject, truth, 2e-3)
    assert found[subject.chosen] <= 3e-3 and max(found.values()) > 0.1


def test_the_errors_of_a_mass_are_those_against_an_integrator() -> None:
    scene = parse_scene({"finger": SHORT, "effects": {"inertia": {}}, "output": OUTPUT})
    subject, inertia = subject_of(scene), scene.effects["inertia"]
    moving = (inertia.mass, inertia.damping, lambda _t: scene.scan.load, lambda t: scene.scan.speed * t)
    series = steady_scan(Finger(touch_of(scene), *moving, spring=inertia.stiffness), 0.01, 4096, 1e-9).harmonics[0]
    truth = series.signal(2, np.arange(round(0.12 * 8000)), 8000, 600)
    found = check_errors(subject, truth, 3e-4)
    assert found[subject.chosen] <= 1e-3
    assert {method.family for method in subject.methods} == {"baseline", "cells", "steps"}


@pytest.mark.thorough
def test_the_errors_of_a_path_over_dots_are_those_against_brute_force() -> None:
    shape = {"dot_diameter": "1.2 mm", "dot_top": "0.3 mm", "dot_height": "40 um"}
    texture = {"kind": "dots", "period": "1.5 mm", "row_distance": "1.5 mm", **shape}
    path = [[0.02 * n, 1.6e-3 * n, 0.5e-3 * n, 0.0, 0.3] for n in range(7)]
    output = OUTPUT | {"sample_rate": 4000, "bandwidth": 300}
    scene = parse_scene({
        "finger": {"contact_length": "2.2 mm"}, "texture": texture, "scan": {"trajectory": path}, "output": output,
        "accuracy": {"tolerance": 1e-2},
    })  # fmt: skip
    subject = subject_of(scene)
    found = check_errors(subject, oracle_along(scene, on_dots(scene), 4000, means=0), 1e-2)
    assert found[subject.chosen] <= 2e-2
    assert {"baseline", "cells", "steps"} == {method.family for method in subject.methods}


def test_a_live_voice_errs_in_the_band_by_what_an_oracle_shows() -> None:
    """The errors of the methods from the slowest to the fastest, against the oracle, below two thirds of the band."""
    scene = parse_scene({"finger": SHORT, "output": OUTPUT | {"duration": 1.0}})
    motion = rubbed(scene)
    subject = live_subject(prepare(motion), 0, prepare_hand(scene, (1.0,)), 0.0)
    truth, ringing = oracle_along(motion, of_comb(motion))[: len(subject.methods[0].set_up().values(0))], 800
    low = firwin(1601, 0.84 * 600, fs=8000)
    for method in (one for one in subject.methods if one.family != "baseline"):
        ready = method.set_up()
        assert ready.live
        apart = np.convolve(ready.values(0) - truth, low, "valid")
        told = subject.errors(ready).max_error
        assert told == pytest.approx(np.max(np.abs(apart)) / np.ptp(truth), rel=0.3, abs=1e-4), method.name
        assert len(apart) > 2 * ringing and told <= 2e-2
    assert subject.chosen in {method.name for method in subject.methods}


MOTIONS: dict[str, dict[str, Any]] = {
    "stroke": {"scan": STROKE},
    "landing": {"scan": {"trajectory": LANDING}},
    "full contact": {"scan": {"stroke": {"load": "5 N", "length": "8 mm", "turn_time": "50 ms"}}},
    "probe": {"finger": {"kind": "probe"}, "scan": {"trajectory": LANDING}},
    "contact that grows": {"effects": {"contact_growth": {}}, "scan": {"trajectory": LANDING}},
    "long surface": {"texture": {"kind": "rough", "period": "0.9 m", "longest": "1 mm", "shortest": "0.2 mm"}},
    "line over dots": {"texture": {"kind": "dots", "period": "2 mm"}, "scan": {"heading": 0.5}},
    "recording over dots": {"texture": {"kind": "dots", "period": "2 mm"}, "scan": {"trajectory": LANDING}},
    "turned finger": {"scan": {"direction": 0.3}},
    "mass": {"effects": {"inertia": {}}},
    "mass on a stroke": {"effects": {"inertia": {}}, "scan": STROKE},
    "skin": {"effects": {"viscous_skin": {}}},
    "adhesion": {"effects": {"adhesion": {}}},
    "shape": {"effects": {"curvature": {}}},
}
SHOWN = ("landing", "line over dots", "mass on a stroke", "skin", "shape")


@pytest.fixture(autouse=True)
def few_sizes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave the slowest sizes of the baseline out."""
    monkeypatch.setattr("synth.accuracy.baseline.SIZES", SIZES[:3])
    monkeypatch.setattr("synth.accuracy.baseline.AREA_SIZES", AREA_SIZES[:2])
    monkeypatch.setattr("synth.accuracy.simulated.BASELINE", BASELINE[:2])


@pytest.fixture
def in_haste(monkeypatch: pytest.MonkeyPatch) -> None:
    """Measure what takes no time; the others are left out."""
    monkeypatch.setattr("synth.accuracy.report.REPEATS", 1)
    monkeypatch.setattr("synth.accuracy.report.PATIENCE", 1.0)
    monkeypatch.setattr("synth.accuracy.motion.REFERENCE_SECONDS", 0.5)


@pytest.mark.usefixtures("in_haste")
@pytest.mark.parametrize(
    ("name", "live"),
    [
        *paired(SHOWN, [False, True]),
        *(thorough(name, live) for name in MOTIONS if name not in SHOWN for live in (0, 1)),
    ],
    ids=str,
)
def test_every_scene_gets_a_table(name: str, live: bool) -> None:
    output = OUTPUT | {"sample_rate": 4000, "bandwidth": 300}
    scene = parse_scene({"finger": SHORT, "output": output, "accuracy": {"tolerance": 1e-2}} | MOTIONS[name])
    made = measure_accuracy(scene, live=live).document()
    assert made["chosen"] in {row["method"] for row in made["methods"]} and len(made["methods"]) >= 2
    assert made["measured"].count("The errors are those") == 1 and made["peak_to_peak"] > 0.0
    assert 0.0 <= made["reference_error"] < 0.1
    for row in made["methods"]:
        assert 0.0 <= row["rms_error"] <= row["max_error"] and row["setup_seconds"] >= 0.0
        assert row["seconds_per_second"] > 0.0 and row["memory_bytes"] >= 0
    assert any(row["max_error"] < 0.1 for row in made["methods"])  # live, over dots: the mean is that of the area


def test_where_solutions_take_long_the_reference_and_the_methods_are_fewer(monkeypatch: pytest.MonkeyPatch) -> None:
    """A clock that no machine moves: each solution takes a millisecond."""
    monkeypatch.setattr(MotionCase, "seconds_a_solution", lambda _case, _heights: 1e-3)
    scene = parse_scene({"finger": SHORT, "scan": {"trajectory": LANDING}, "output": OUTPUT})
    case = MotionCase(prepare(scene), 0, 0.0)
    reference, finest = solved_reference(case)
    assert finest == FINEST // 4 and reference.error < 0.05
    methods = [*baseline_along(case), *file_methods(case, finest)]
    assert not any(
        f"{case.steps(ratio):.0f} steps a second" in one.name
        for one in methods
        for ratio in (2.0, 4.0)
        if one.family == "steps"
    )
    fewest = 1e-3 * case.solver(2000.0 / case.steps(1.0)).solutions
    assert fewest > 0.5
    assert all(one.seconds >= fewest for one in methods if one.family in ("baseline", "steps", "sampled"))


LONG: dict[str, dict[str, Any]] = {
    "a stroke": {"scan": STROKE},
    "a mass": {"effects": {"inertia": {}}},
    "a mass in a stroke": {"scan": STROKE, "effects": {"inertia": {}}},
    "a recording under one load": {"scan": {"trajectory": [[0, 0, 0.3], [0.5, 0.03, 0.3], [1.8, 0.12, 0.3]]}},
    "a recording": {"scan": {"trajectory": [[0, 0, 0.2], [0.5, 0.03, 0.5], [1.8, 0.12, 0.3]]}},
    "a landing": {"scan": {"trajectory": [[0, 0, 0], *([point[0] + 1.2, *point[1:]] for point in LANDING[1:])]}},
}


@pytest.mark.parametrize("name", LONG)
def test_of_a_long_motion_a_piece_is_measured(name: str) -> None:
    output = OUTPUT | {"duration": 1.8}
    scene = parse_scene({"finger": SHORT, "accuracy": {"tolerance": 1e-2}, "output": output, **LONG[name]})
    case = MotionCase(prepare(scene), 0, 0.0)
    first, frames = case.piece
    assert first >= 0 and frames > 0 and first + frames <= round(1.8 * case.rate)
    assert frames < 0.7 * 1.8 * case.rate
    assert not case.lands or first <= 1.22 * case.rate <= first + frames
