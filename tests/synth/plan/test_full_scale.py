"""A float file peaks at 0.8 of its automatic full scale, whatever scan, finger, texture and quantity it has."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest

import ridgewave as rw
from synth.contact.area_grid import AreaGrid
from tests.few import paired, thorough

LOW, HIGH = 0.78, 0.82
FINGERS = {"comb": {}, "fingertip": {"kind": "fingertip", "contact_length": "6 mm"}, "probe": {"kind": "probe"}}
TEXTURES: dict[str, dict[str, Any]] = {
    "sinusoid": {"period": "1.1 mm"},
    "harmonics": {"kind": "harmonics", "period": "3 mm", "amplitudes": [1e-5, 8e-6, 6e-6], "phases": [0.1, 1.0, 2.0]},
    "grating": {"kind": "grating", "period": "1.3 mm", "height": "60 um", "duty": 0.4},
    "rough": {"kind": "rough", "period": "12 mm", "rms_height": "8 um", "shortest": "0.3 mm", "seed": 3},
    "profile": {"kind": "profile", "heights": [0, 3e-5, 1e-5, -2e-5, 0, 4e-5, -1e-5], "spacing": "0.31 mm"},
    "dots": {"kind": "dots"},
    "heightmap": {"kind": "heightmap", "rows": [[0, 2e-5, 1e-5], [3e-5, 0, -1e-5]], "spacing": "0.5 mm"},
}
SCANS: dict[str, dict[str, Any]] = {
    "constant": {"speed": "73 mm/s", "load": "0.4 N"},
    "stroke": {"stroke": {"length": "21 mm", "speed": "67 mm/s", "load": "0.25 N"}},
    "pressed": {"trajectory": [[0, 0, 0.3], [0.1, 0.005, 0.3], [0.2, 0.014, 0.3], [0.45, 0.03, 0.3]]},
    "varying": {"trajectory": [[0, 0, 0.2], [0.11, 0.006, 0.6], [0.21, 0.015, 0.4], [0.4, 0.03, 0.9]]},
    "landing": {"trajectory": [[7, 0, 0], [7.05, 0.003, 0], [7.1, 0.006, 0.4], [7.3, 0.02, 0.5], [7.4, 0.026, 0]]},
    "two points": {"trajectory": [[0, 0, 0.3], [0.4, 0.03, 0.5]]},
}
QUANTITIES = ("approach", "displacement", "velocity", "acceleration")
RATES = (8000, 48000)
EFFECTS = ("adhesion", "inertia", "tangential", "viscous_skin")
CASES = [
    (finger, texture, scan, QUANTITIES[number % 4], RATES[number % 2])
    for number, (finger, texture, scan) in enumerate(product(FINGERS, TEXTURES, SCANS))
]
QUICK_CASES = (0, 14, 28, 42, 56, 85, 99, 113)
"""All fingers and scans, with one of the textures over an area, which are slow."""


def peak_of(scene: dict[str, Any]) -> tuple[np.ndarray, tuple[str, ...]]:
    """Return the largest magnitude of each channel of a float file, and the warnings of its plan."""
    sound = rw.render(scene)
    return np.max(np.abs(sound.frames), axis=0), sound.warnings


def check(scene: dict[str, Any]) -> None:
    """Assert that every channel of the float file of `scene` peaks at four fifths."""
    found, warnings = peak_of(scene)
    assert np.all(found >= LOW) and np.all(found <= HIGH), (scene, found, warnings)


@pytest.mark.parametrize(
    "case", [case if number in QUICK_CASES else thorough(case) for number, case in enumerate(CASES)]
)
def test_every_pair_of_a_finger_and_a_texture_under_every_scan(case: tuple[str, str, str, str, int]) -> None:
    finger, texture, scan, quantity, rate = case
    output: dict[str, Any] = {"quantity": quantity, "sample_rate": rate}
    if "trajectory" not in SCANS[scan]:
        output["duration"] = 0.41
    check({"finger": FINGERS[finger], "texture": TEXTURES[texture], "scan": SCANS[scan], "output": output})


QUICK_SEEDS = (2, 3, 4, 5)
"""One of each kind of recording, and each finger at least once."""


def random_recording(seed: int) -> list[list[float]]:
    """Return points whose loads are constant, vary, or land and lift inside; all kinds may end pressed."""
    random = np.random.default_rng([38, seed])
    count = int(random.integers(2, 25))
    times = random.uniform(0.0, 50.0) + np.cumsum(random.uniform(0.02, 0.2, count))
    places = np.cumsum(random.uniform(-0.004, 0.012, count))
    kind = seed % 4
    loads = np.full(count, random.uniform(0.05, 1.0)) if kind == 0 else random.uniform(0.1, 1.2, count)
    if kind >= 2 and count > 6:
        lifted = int(random.integers(2, count - 3))
        loads[lifted : lifted + 2] = 0.0
        if kind == 3:
            loads[0] = 0.0
    return [[float(t), float(p), float(w)] for t, p, w in zip(times, places, loads, strict=True)]


@pytest.mark.parametrize("seed", [seed if seed in QUICK_SEEDS else thorough(seed) for seed in range(100)])
def test_random_recordings(seed: int) -> None:
    finger = FINGERS[("comb", "fingertip", "probe")[seed % 3]]
    texture = TEXTURES[("grating", "sinusoid", "harmonics", "profile")[seed // 3 % 4]]
    output = {"sample_rate": 8000, "quantity": QUANTITIES[1 + seed // 2 % 3]}
    check({"finger": finger, "texture": texture, "scan": {"trajectory": random_recording(seed)}, "output": output})


@pytest.mark.parametrize(("scan", "duration"), paired(["constant", "stroke", "varying"], [0.3, 0.03, 0.004]))
def test_an_output_shorter_than_its_motion_is_as_loud_as_its_own_frames(scan: str, duration: float) -> None:
    output = {"duration": duration, "sample_rate": 8000}
    finger = {"contact_length": "3 mm"}
    check({"finger": finger, "texture": {"period": "2 mm"}, "scan": SCANS[scan], "output": output})


@pytest.mark.parametrize(("scan", "quantity"), paired(["constant", "stroke", "varying", "landing"], QUANTITIES))
def test_fades_count(scan: str, quantity: str) -> None:
    output = {"quantity": quantity, "duration": 0.3, "fade": 0.15, "sample_rate": 8000}
    check({"texture": {"kind": "grating"}, "scan": SCANS[scan], "output": output})


@pytest.mark.parametrize(("name", "scan"), paired(EFFECTS, ["landing", "stroke"]))
def test_a_level_that_effects_decide_is_within_bounds_or_the_plan_says_why_not(name: str, scan: str) -> None:
    output = {"duration": 0.2, "sample_rate": 8000}
    quick = {"finger": {"contact_length": "2.5 mm"}, "accuracy": {"tolerance": 1e-2}}
    scene = {**quick, "texture": {"kind": "grating"}, "scan": SCANS[scan], "effects": {name: {}}, "output": output}
    found, warnings = peak_of(scene)
    assert any("may peak above or below 0.8" in one for one in warnings) == (name != "tangential"), found
    assert name != "tangential" or np.all((found >= LOW) & (found <= HIGH)), "the peak of its own motion"
    own = {"effects": {name: {"full_scale": 1.0} if name == "tangential" else {}}, "output": output | {"full_scale": 1}}
    assert not any("may peak" in one for one in peak_of(scene | own)[1])


def test_a_lift_that_is_not_rendered_is_not_heard_in_the_full_scale() -> None:
    points = [[0, 0, 0.3], [0.5, 0.03, 0.3], [1, 0.07, 0.3], [1.5, 0.1, 0.3], [2, 0.13, 0.3]]
    texture = {"kind": "grating-1mm-31um"}
    scene: dict[str, Any] = {"texture": texture, "scan": {"trajectory": points}, "output": {"sample_rate": 8000}}
    check(scene)
    lasting = {**scene, "output": {"sample_rate": 8000, "duration": 2.1}}
    assert rw.render(lasting).full_scale[0] > 1.1 * rw.render(scene).full_scale[0], "the lift is the loudest part"


def test_the_first_seconds_are_the_same_whatever_follows() -> None:
    points = [[0.1 * n, 0.004 * n + 0.001 * np.sin(n), 0.3 + 0.1 * np.cos(n)] for n in range(6)]
    output = {"duration": 0.5, "sample_rate": 8000}
    for more in ([[60.0, 0.5, 8.0]], [[0.5001, 0.0196, 0.0], [1800.0, 0.0, 0.0]]):
        here, there = (rw.render({"scan": {"trajectory": one}, "output": output}) for one in (points, [*points, *more]))
        assert np.array_equal(here.frames, there.frames) and here.full_scale == there.full_scale
        assert here.plan is not None and there.plan is not None
        assert here.plan.estimated_error == there.plan.estimated_error


def tracked(lift: float, at: float, seconds: float, speed: float, load: float, stop: float = 1e3) -> list[list[float]]:
    """Return points of a tracker at 1 kHz; the finger stops at `stop` and lifts from `at` on, within `lift` (s)."""
    times = [round(0.001 * number, 6) for number in range(round(1000.0 * seconds) + 1)]
    return [[t, speed * min(t, stop), load * min(max(1.0 - (t - at) / lift, 0.0), 1.0)] for t in times]


QUICK: dict[str, dict[str, Any]] = {
    "a comb moves": {"scan": {"trajectory": tracked(2e-3, 0.05, 0.1, 0.05, 1.0)}},
    "a comb stops": {"scan": {"trajectory": tracked(1e-3, 0.044, 0.05, 0.5, 1.0, stop=0.025)}},
    "a fingertip stops": {
        "finger": {"kind": "fingertip"},
        "scan": {"trajectory": tracked(1e-3, 0.09, 0.1, 0.2, 1.0, stop=0.05)},
    },
    "a fingertip on sandpaper": {
        "finger": {"kind": "fingertip"},
        "texture": {"kind": "sandpaper-p120"},
        "scan": {"trajectory": tracked(2e-3, 0.1815, 0.3, 0.02, 1.5)},
        "output": {"sample_rate": 48000},
    },
    "velocity": {
        "finger": {"kind": "fingertip"},
        "scan": {"trajectory": tracked(4e-3, 0.2386, 0.3, 0.02, 1.5)},
        "output": {"sample_rate": 8000, "quantity": "velocity"},
    },
}


def quickly(name: str) -> dict[str, Any]:
    return {"texture": {"kind": "grating-1mm-31um"}, "output": {"sample_rate": 8000}, **QUICK[name]}


@pytest.mark.parametrize("name", ["a comb moves", "a comb stops", *map(thorough, list(QUICK)[2:])])
def test_a_quick_lift(name: str) -> None:
    check(quickly(name))


@pytest.mark.thorough
def test_a_light_load_in_larger_steps() -> None:
    """Four solutions per stride were 18 % too loud throughout."""
    ramp = [[n / 60, n / 120, n / 600] for n in range(31)]
    check({"scan": {"trajectory": ramp}, "output": {"sample_rate": 8000}})


def test_the_error_of_a_lift_is_told_though_the_texture_cancels_at_the_own_speed() -> None:
    plan = rw.render(quickly("a comb stops")).plan
    assert plan is not None and 0.0 < plan.estimated_error["acceleration"] < 1e-3


@pytest.mark.parametrize("seconds", [0.05, thorough(0.02)])
def test_a_quick_lift_is_solved_again_where_the_whole_would_take_too_long(
    seconds: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("synth.plan.motion_peak.PATIENCE", seconds)
    check(quickly("a comb moves") | {"scan": {"trajectory": tracked(2e-3, 0.05, 0.1, 0.05, 1.0 + seconds)}})


def test_a_recording_that_is_read_has_an_uncertain_level(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("synth.plan.frame_plan.PATIENCE", 0.0)
    scene = {"scan": {"trajectory": tracked(2e-3, 0.05, 0.1, 0.05, 1.3)}, "output": {"sample_rate": 8000}}
    assert any("level of the acceleration is uncertain" in one for one in peak_of(scene)[1])
    given = scene | {"output": {"sample_rate": 8000, "full_scale": 20}}
    assert not any("level of" in one for one in peak_of(given)[1])


@pytest.mark.parametrize("start", [0.0, 0.01])
@pytest.mark.parametrize("moves", [False, True], ids=["rests", "moves later"])
def test_a_finger_at_rest_is_silent_and_no_rounding_is_raised(start: float, moves: bool) -> None:
    """Rounding at 0.8 of full scale would be noise at full strength."""
    points = [[0.0, start, 0.3], [0.2, start, 0.3]]
    points += [[0.3, start + 0.01, 0.3], [0.6, start + 0.05, 0.3]] if moves else []
    output = {"sample_rate": 16_000, "duration": 0.1}
    with pytest.warns(rw.RenderWarning, match="rests"):
        sound = rw.render({"scan": {"trajectory": points}, "output": output})
    assert sound.full_scale == (1.0,) and not sound.values.any()


def test_a_finger_at_rest_over_an_area_is_planned_at_once() -> None:
    points = [[0.0, 0.0, 0.0, 0.0, 0.3], [0.2, 0.0, 0.0, 0.0, 0.3]]
    plan = rw.explain({"texture": {"kind": "dots"}, "scan": {"trajectory": points}})
    assert any("rests" in text for text in plan.warnings)


def test_a_recording_whose_harmonics_are_above_the_band_is_not_said_to_rest() -> None:
    scene = {"scan": {"trajectory": [[0.0, 0.0, 0.3], [0.02, 0.02, 0.3]]}, "output": {"sample_rate": 16_000}}
    warnings = rw.explain(scene).warnings
    assert any("above the band" in text for text in warnings) and not any("rests" in text for text in warnings)


@pytest.mark.parametrize("effect", ["inertia", "viscous_skin", "adhesion"])
def test_a_simulated_constant_scan_has_the_level_of_its_own_frames(effect: str) -> None:
    quick = {"finger": {"contact_length": "3 mm"}, "accuracy": {"tolerance": 1e-2}}
    scene = {**quick, "texture": {"period": 5e-3, "amplitude": 20e-6}, "effects": {effect: {}}}
    for seconds in (0.013, 0.05, 0.075):  # a period takes 0.0625 s
        sound = rw.render({**scene, "output": {"duration": seconds, "sample_rate": 8000, "fade": 0.0025}})
        assert sound.plan is not None
        assert not any("may peak above or below 0.8" in one for one in sound.plan.warnings)
        assert np.max(np.abs(sound.values)) / sound.full_scale[0] == pytest.approx(0.8, rel=1e-5)


@pytest.mark.filterwarnings("ignore::ridgewave.RenderWarning")
@pytest.mark.parametrize("loads", [(0.3, 0.3, 0.3, 0.3), thorough((0.3, 0.5, 0.02, 0.3))])
def test_the_peak_to_peak_of_a_recording_whose_fastest_part_is_above_the_band_is_its_own(loads: Any) -> None:
    """Its steady motion at that speed has one harmonic, at ten times the band."""
    points = [[t, x, load] for t, x, load in zip((0.0, 0.02, 0.04, 0.1), (0.0, 0.09, 0.0, 0.5), loads, strict=True)]
    sound = rw.render({"scan": {"trajectory": points}, "output": {"channels": ["displacement", "acceleration"]}})
    assert sound.plan is not None
    told = [one["peak_to_peak"] for one in sound.plan.response["channels"]]
    np.testing.assert_allclose(told, np.ptp(sound.values, axis=0), rtol=0.3)


@pytest.mark.thorough
def test_pieces_are_not_solved_more_finely_than_the_cells_allow(monkeypatch: pytest.MonkeyPatch) -> None:
    """The cells leave a tenth of the peak-to-peak: a landing to 1e-4 took ten minutes."""
    solved: list[int] = []
    solve = AreaGrid.solve_places

    def counted(self: AreaGrid, places: Any, *rest: Any, **named: Any) -> Any:
        solved.append(len(places))
        return solve(self, places, *rest, **named)

    monkeypatch.setattr(AreaGrid, "solve_places", counted)
    points = [[0.0, 1e-3, 2e-3, 0.3, 0.2], [0.2, 6e-3, 1e-3, 1.2, 0.4], [0.35, 7e-3, -3e-3, -2.0, 0.1]]
    texture = {"kind": "dots", "period": 2.1e-3}
    plan = rw.explain(
        {
            "finger": {"kind": "fingertip"},
            "texture": texture,
            "scan": {"trajectory": points},
            "output": {"sample_rate": 22_050},
        }
    )
    assert sum(solved) < 150_000 and 0.05 < plan.estimated_error["acceleration"] < 0.3
