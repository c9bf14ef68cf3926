"""The tangential force in whole renders: integrals of the pressure, means, reversals, and with a mass."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from synth import Motion, open_voice, parse_scene
from synth.errors import SceneError
from synth.scene.scene import Scene
from tests.few import thorough
from tests.reference.adhesion_oracle import Path
from tests.reference.creeping_oracle import Creep, Solid
from tests.reference.moving_oracle import Finger, Harmonics, Profile, Reaction, elastic, steady_scan
from tests.reference.pressure_oracle import Surfaces, power_mean
from tests.reference.stiffness_oracle import Touch, stiffness
from tests.synth.effects.whole_renders import SHORT, errors_of, kept_band, named, scene_of
from tests.synth.engine_cases import Real, physical, touch_of

FORCE = "tangential_force"
PHASES = 2048
RATE = 8000
REACH = 2e-5  # m, of adhesion


def tangential(scene: Scene, seconds: float) -> tuple[Real, float]:
    """Return the force (N) in the first `seconds` of a scene, and the error that its plan reports."""
    voice = open_voice(scene)
    assert voice.quantities[-1] == FORCE
    return physical(voice, round(seconds * RATE))[:, -1], voice.plan.estimated_error[FORCE]


def slope_force(touch: Touch, theta: Real) -> Real:
    """Return -(k / L) times the integral of max(h - z, 0) dh_t/dx (N) at each theta (turns)."""
    profile, found = Profile(touch), stiffness(touch)
    heights = [elastic(profile, found.indentation, one) for one in theta.tolist()]
    reaction = Reaction(profile)
    return np.array([reaction.force(z, one, found.k) for z, one in zip(heights, theta.tolist(), strict=True)])


@pytest.mark.parametrize("name", named("default"))
def test_the_force_of_the_slopes_errs_by_no_more_than_the_plan_says(name: str) -> None:
    scene = scene_of(name, {"tangential": {"friction_coefficient": 0}}, finger=SHORT)
    sign = np.copysign(1.0, scene.scan.speed)
    force = slope_force(touch_of(scene), sign * np.arange(PHASES) / PHASES)
    wanted = Harmonics(np.fft.rfft(force) / PHASES, abs(scene.scan.speed) / scene.texture.period)
    voice = open_voice(scene)
    error = errors_of(scene, voice, {FORCE: (wanted, 0)})[FORCE]
    assert error <= voice.plan.estimated_error[FORCE] + 1e-5


@pytest.mark.parametrize("effects", [{}, {"adhesion": {}}], ids=str)
def test_slopes_alone_have_no_mean_over_a_period(effects: dict[str, Any]) -> None:
    scene = scene_of("default", {"tangential": {"friction_coefficient": 0}, **effects}, finger=SHORT)
    force, _told = tangential(scene, 0.1)
    assert abs(np.mean(force)) <= (1e-4 if effects else 1e-6) * np.ptp(force)


@pytest.mark.parametrize("speed", [0.08, -0.08])
def test_coulombs_friction_has_the_mean_mu_w_against_the_motion(speed: float) -> None:
    scene = scene_of("default", {"tangential": {"friction_coefficient": 1}}, scan={"speed": speed})
    force, _told = tangential(scene, 0.1)
    assert np.mean(force) == pytest.approx(np.copysign(0.3, speed), rel=1e-6)
    slower = scene_of("default", {"tangential": {"friction_coefficient": 1}}, scan={"speed": 1e-3})
    force, _told = tangential(slower, 0.8)
    assert np.mean(force) == pytest.approx(0.3 * np.tanh(1.0), rel=1e-5)


@pytest.mark.thorough
@pytest.mark.parametrize("exponent", [0.8, 1.2])
def test_friction_of_another_power_is_that_of_the_pressure(exponent: float) -> None:
    law = {"friction_coefficient": 0.6, "pressure_exponent": exponent, "reference_pressure": "20 kPa"}
    scene = scene_of("default", {"tangential": law})
    touch, count = touch_of(scene), 512  # places: what folds back is a tenth of what the plan states
    found, area, force = stiffness(touch), touch.contact_length**2, np.empty(count)
    theta, profile = np.arange(count) / count, Profile(touch)
    for i, one in enumerate(theta.tolist()):
        surfaces = Surfaces(
            touch.ridge_amplitude, touch.ridge_period, 0.0, touch.texture_amplitude, touch.texture_period, touch.phase,
            touch.contact_length, moved=one * touch.texture_period,
        )  # fmt: skip
        mean = power_mean(surfaces, elastic(profile, found.indentation, one), exponent)
        force[i] = 0.6 * 2e4 * area * (found.k / (area * 2e4)) ** exponent * mean
    force += slope_force(touch, theta)
    wanted = Harmonics(np.fft.rfft(force) / count, 100.0)
    voice = open_voice(scene)
    error = errors_of(scene, voice, {FORCE: (wanted, 0)})[FORCE]
    assert error <= voice.plan.estimated_error[FORCE] + 1e-5
    assert np.mean(physical(voice, 800)[:, -1]) == pytest.approx(np.mean(force), rel=1e-5)


def test_a_stroke_turns_without_a_step() -> None:
    stroke = {"speed": "80 mm/s", "length": "12 mm", "turn_time": "60 ms"}
    law = {"friction_coefficient": 1, "reversal_speed": "10 mm/s"}
    force, _told = tangential(scene_of("default", {"tangential": law}, scan={"stroke": stroke}), 1.0)
    slopes, _told = tangential(scene_of("default", {"tangential": {"friction_coefficient": 0}}), 0.1)
    assert np.max(force) > 0.28 and np.min(force) < -0.28, "it goes to and fro"
    turning = 0.3 * 3 * 0.08 / 0.06 / 0.01 / RATE  # mu w times the largest change of u / u0 from frame to frame
    assert np.max(np.abs(np.diff(force))) <= turning + np.max(np.abs(np.diff(slopes)))


@pytest.mark.parametrize("damping", [3.0, thorough(1.0)])
def test_with_a_mass_the_mean_is_the_power_of_the_damper(damping: float) -> None:
    whole = {"mass": 5e-3, "damping": damping, "stiffness": 0.0}
    effects = {"inertia": whole, "tangential": {"friction_coefficient": 0}}
    scene = scene_of("default", effects, finger=SHORT)
    force, told = tangential(scene, 0.1)
    touch = touch_of(scene)
    scan = steady_scan(Finger(touch, 5e-3, damping, lambda _t: 0.3, lambda t: 0.08 * t), 0.12 / damping, PHASES, 1e-8)
    lost = damping * float(np.mean(scan.motion[1] ** 2))
    assert lost > 1e-7
    assert abs(np.mean(force) * 0.08 - lost) <= min(told * np.ptp(force) * 0.08, 2e-3 * lost)


@pytest.mark.parametrize("stress", [0.0, 2e4])
def test_with_a_mass_the_force_errs_by_no_more_than_the_plan_says(stress: float) -> None:
    effects: dict[str, Any] = {"inertia": {}, "tangential": {"friction_coefficient": 0.5}}
    if stress:
        effects["adhesion"] = {"stress": stress, "reach": REACH}
    scene = scene_of("default", effects, finger=SHORT)
    touch = touch_of(scene)
    pull, rest = stress * touch.contact_length**2, None
    if stress:
        rest = float(np.mean(Path(touch, stress, REACH).followed(np.arange(-16, 64) / 64, np.full(80, 0.3)).z[16:]))
    finger = Finger(touch, 1e-4, 2.4, lambda _t: 0.3, lambda t: 0.08 * t, pull, REACH, spring=1e3, rest=rest)
    scan = steady_scan(finger, 0.005, PHASES, 1e-8)
    reaction, k = Reaction(Profile(touch), pull, REACH), stiffness(touch).k
    some = slice(None, None, 2)
    turns = 0.08 * scan.times[some] / touch.texture_period
    force = [
        reaction.force(z, theta, k) + 0.5 * reaction.at(z, theta, k)[1]
        for z, theta in zip(scan.motion[0][some].tolist(), turns.tolist(), strict=True)
    ]
    wanted = Harmonics(np.fft.rfft(force) / len(force), 100.0)
    voice = open_voice(scene)
    error = errors_of(scene, voice, {FORCE: (wanted, 0)})[FORCE]
    assert error <= voice.plan.estimated_error[FORCE]


@pytest.mark.parametrize("bandwidth", ["full", 1000.0])
def test_on_viscous_skin_the_force_errs_by_no_more_than_the_plan_says(bandwidth: float | str) -> None:
    effects = {"viscous_skin": {}, "tangential": {"friction_coefficient": 0}}
    finger, scan, output = {"contact_length": "1.5 mm"}, {"load": "75 mN"}, {"bandwidth": bandwidth}
    scene = scene_of("default", effects, finger=finger, scan=scan, output=output, accuracy={"tolerance": 1e-2})
    skin = Creep(touch_of(scene), scene.scan.speed, Solid((scene.effects["viscous_skin"].time_constant,)), 2400)
    runs = [skin.last_period(steps, 3, of_force=True) for steps in (512, 1024, 2048)]
    wanted, rougher = skin.extrapolated(*runs[1:]), skin.extrapolated(*runs[:2])
    signals = [one.signal(0, np.arange(800), RATE, kept_band(scene)) for one in (wanted, rougher)]
    own = float(np.max(np.abs(signals[1] - signals[0])) / np.ptp(signals[0]))
    voice = open_voice(scene)
    error = errors_of(scene, voice, {FORCE: (wanted, 0)})[FORCE]
    told = voice.plan.estimated_error[FORCE]
    assert own <= 0.2 * told, f"the oracle errs by {own:.2g}"
    assert error <= told + own <= 0.01


def test_the_error_of_a_simulated_force_contains_that_of_the_table() -> None:
    document = {
        "finger": {"kind": "probe", "tip_radius": "0.45 mm", "youngs_modulus": "288 MPa"},
        "texture": {"kind": "harmonics", "period": "1.08 mm", "amplitudes": ["11.3 um", "10.6 um"]},
        "scan": {"speed": "30.6 mm/s", "load": "0.967 N"},
        "effects": {"adhesion": {"stress": "3.4 kPa", "reach": "16.8 um"}, "tangential": {"friction_coefficient": 0.9}},
        "output": {"sample_rate": RATE},
    }
    force, told = tangential(parse_scene(document), 0.1)
    exact, _told = tangential(parse_scene({**document, "accuracy": {"tolerance": 2e-5}}), 0.1)
    assert np.max(np.abs(force - exact)) <= told * np.ptp(exact)


def test_no_load_is_no_force() -> None:
    scene = parse_scene({"effects": {"tangential": {}}, "scan": {"load": 0}, "output": {"sample_rate": RATE}})
    assert not np.any(open_voice(scene).render(500))


def test_a_texture_with_more_detail_than_a_table_holds_is_refused_unless_the_scan_is_constant() -> None:
    steps = np.random.default_rng(3).normal(0.0, 2e-7, 3000)
    heights = np.cumsum(steps - np.mean(steps)).tolist()
    texture = {"kind": "profile", "heights": heights, "spacing": "5 um", "ends": "join"}
    scene = {"texture": texture, "effects": {"tangential": {}}, "finger": {"contact_length": "2 mm"}}
    assert np.ptp(open_voice(parse_scene(scene)).render(960)[:, 1]) > 0.0
    with pytest.raises(SceneError, match="more detail than a table holds"):
        open_voice(parse_scene(scene), live=True).render(480, Motion.of(480, speed=0.08, load=0.3))


@pytest.mark.parametrize("length, period", [("1.5 mm", None), thorough("1 mm", "0.5 mm")])
def test_a_hand_plays_a_finger_whose_motion_cancels_in_full_contact(length: str, period: str | None) -> None:
    """z is then nearly still, so its relative error was above 1, and the scene was refused as too fine for a table."""
    finger, texture = {"kind": "fingertip", "contact_length": length}, {"period": period} if period else {}
    scene = parse_scene({"finger": finger, "texture": texture, "effects": {"tangential": {}}})
    voice = open_voice(scene, live=True)
    force = voice.render(4800, Motion.of(4800, speed=0.08, load=0.3))[2400:, -1] * voice.full_scale[-1]
    assert np.mean(force) == pytest.approx(0.5 * 0.3, rel=1e-3), "friction remains"


@pytest.mark.parametrize("mass", [{}, {"inertia": {}}], ids=["read", "simulated"])
def test_a_file_of_a_force_has_the_level_of_its_own_motion(mass: dict[str, Any]) -> None:
    """At full speed the texture has no line in the band."""
    points = [[0.0, 0.0, 0.2], [0.05, 0.003, 0.2], [0.1, 0.012, 0.2], [0.15, 0.03, 0.2]]
    scene = parse_scene(
        {
            "texture": {"period": 150e-6, "amplitude": 3e-6},
            "scan": {"trajectory": points},
            "effects": {"tangential": {"friction_coefficient": 0}, **mass},
            "output": {"sample_rate": RATE, "bandwidth": 1000},
        }
    )
    voice = open_voice(scene)
    peak = np.max(np.abs(voice.render(round(scene.output.duration * RATE))[:, -1]))
    assert 0.78 <= peak <= 0.82
    assert voice.plan.estimated_error[FORCE] <= 1e-2
