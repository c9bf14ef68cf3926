"""Inertia in whole renders: SciPy's integrator on the exact reaction, slow scans, light masses, a hand."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from synth import Motion, open_voice, parse_scene
from synth.scene.scene import Scene
from tests.few import thorough
from tests.reference.moving_oracle import Finger, Scan, steady_scan
from tests.reference.spectral_checks import fit_harmonics
from tests.reference.stiffness_oracle import contact_in_metres, stiffness
from tests.synth.effects.whole_renders import SHORT, WITH_BANDWIDTH, check_quantities, kept_band, named, scene_of
from tests.synth.engine_cases import QUANTITIES, Real, physical, touch_of

SETTLED = 0.03  # s, after which e^-9 of a start is left with 5 g and 3 N s/m; it is 1e-6 in the end
PULP_SETTLED = 0.005  # s: the damper and the spring of a pulp forget a start in a millisecond
LOOSE = {"tolerance": 1e-2}
WHOLE = {"mass": "5 g", "damping": 3.0, "stiffness": 0.0}  # a free finger on its contact
OWN_ERROR = 5e-6  # of the oracle
RATE = 8000  # Hz
QUICK = (2048, 1e-8)  # samples of a period and tolerance of the integrator: enough at RATE


def oracle(scene: Scene, settled: float) -> Scan:
    """Return the steady motion of the finger of `scene`."""
    inertia, scan = scene.effects["inertia"], scene.scan
    moving = (inertia.mass, inertia.damping, lambda _t: scan.load, lambda t: scan.speed * t)
    finger = Finger(touch_of(scene), *moving, spring=inertia.stiffness)
    found = steady_scan(finger, settled, *(QUICK if scene.output.sample_rate <= RATE else ()))
    assert found.rest <= 1e-4, "the motion does not repeat itself"
    return found


@pytest.mark.parametrize("settings", [{}, WHOLE], ids=["pulp", "whole finger"])
@pytest.mark.parametrize("name", named("default"))
def test_a_steady_render_errs_by_no_more_than_the_plan_says(name: str, settings: dict[str, Any]) -> None:
    scene = scene_of(name, {"inertia": settings}, finger=SHORT)
    check_quantities(scene, oracle(scene, 0.04 if settings else PULP_SETTLED).harmonics, OWN_ERROR)


@pytest.mark.thorough
@pytest.mark.parametrize(("name", "bandwidth"), WITH_BANDWIDTH)
def test_so_it_does_at_48_khz(name: str, bandwidth: float | str) -> None:
    settings = WHOLE if name in ("default", "wide", "heavy") else {}  # pulp
    scene = scene_of(name, {"inertia": settings}, 48000, output={"bandwidth": bandwidth})
    check_quantities(scene, oracle(scene, SETTLED if settings else PULP_SETTLED).harmonics, OWN_ERROR)


def test_a_light_mass_that_rings_errs_by_no_more_than_the_plan_says() -> None:
    light = {"mass": "1 g", "damping": 0.5, "stiffness": 0.0}
    scene = scene_of("default", {"inertia": light}, texture={"amplitude": "60 um"}, finger=SHORT)
    check_quantities(scene, oracle(scene, 0.05).harmonics, OWN_ERROR)


@pytest.mark.parametrize(("damping", "spring"), [(0.2, 0.0), (0.2, 2e4), thorough(3.0, 0.0)])
def test_in_full_contact_it_is_a_driven_oscillator(damping: float, spring: float) -> None:
    """m z'' + c z' + k (z - mean of h) + k_p (z - z_w) = -w, driven by a2 |sinc(L / lambda2)|.

    The effect of the mass grows as u^2, beside that of the spring.
    """
    mass, changed = 2e-3, []
    for speed in (0.04, 0.02, 0.01):
        scene = parse_scene(
            {
                "scan": {"speed": speed, "load": 50.0},
                "finger": {"contact_length": "2.3 mm"},
                "effects": {"inertia": {"mass": mass, "damping": damping, "stiffness": spring}},
                "output": {"quantity": "displacement", "sample_rate": 8000},
                "accuracy": {"tolerance": 1e-4},
            }
        )
        frequency, touch = speed / 0.8e-3, touch_of(scene)
        k, omega = stiffness(touch).k, 2 * np.pi * frequency
        wanted = k / (k + spring - mass * omega**2 + 1j * omega * damping)
        found = fit_harmonics(physical(open_voice(scene), 8000)[:, 0], 8000, frequency, 3000.0).coefficients[1]
        phases = np.arange(256) / 256
        still = np.fft.fft(np.asarray(contact_in_metres(touch, phases).approach, dtype=float))[1] / 256
        assert abs(found / still - wanted) <= 2e-4
        assert 2 * abs(still) == pytest.approx(20e-6 * abs(np.sinc(2.3 / 0.8)), rel=1e-9)
        changed.append(1 + spring / k - (1 / (found / still)).real)
    assert changed[0] / changed[1] == pytest.approx(4.0, rel=0.05)
    assert changed[1] / changed[2] == pytest.approx(4.0, rel=0.2)


def test_a_mass_of_a_milligram_leaves_the_render() -> None:
    plain = scene_of("default", {}, output={"channels": ["displacement"]})
    light = scene_of(
        "default", {"inertia": {"mass": 1e-6, "damping": 0.0, "stiffness": 0.0}}, output={"channels": ["displacement"]}
    )
    kept, wanted = (
        (fit_harmonics(physical(open_voice(one), 2000)[:, 0], 8000, 100.0, 3900.0)) for one in (light, plain)
    )
    signals = [one.signal(np.arange(2000), kept_band(plain)) for one in (kept, wanted)]
    assert np.max(np.abs(signals[0] - signals[1])) <= 2e-3 * np.ptp(signals[1])


def test_auto_leaves_a_slow_scan_alone_and_puts_a_fast_one_in() -> None:
    """A stiff finger, of whose motion the spring takes little. Of the default one it takes 3 % at any speed."""
    for speed, chosen in ((2e-3, False), (0.08, True)):
        scene = parse_scene(
            {"scan": {"speed": speed}, "effects": {"inertia": "auto"},
             "output": {"quantity": "displacement", "sample_rate": 8000}, "accuracy": {"tolerance": 3e-2},
             "finger": {"youngs_modulus": "2 MPa"}}
        )  # fmt: skip
        document = open_voice(scene).plan.document()
        part = "simulated" if chosen else "left_out"
        (found,) = (one for one in document[part] if one["name"] == "inertia")
        told = r"moves the displacement by \S+ of its peak-to-peak at \S+ Hz, tolerance 0.03"
        assert chosen or re.search(told, found["reason"])


def test_the_whole_finger_of_before_is_reached_by_its_three_settings() -> None:
    """It overshoots near 400 Hz where the pulp does not: harmonics of the default scene over those of eq. 1."""
    cases: list[dict[str, Any]] = [{}, {"inertia": {}}, {"inertia": WHOLE}]
    found = []
    for effects in cases:
        voice = open_voice(scene_of("default", effects, output={"channels": ["displacement"]}, accuracy=LOOSE))
        found.append(np.abs(fit_harmonics(physical(voice, 2000)[:, 0], 8000, 100.0, 3900.0).coefficients[1:9]))
    still, pulp, whole = found
    assert np.max(pulp / still) <= 1.05
    assert np.max((whole / still)[2:6]) >= 3.0 and (whole / still)[7] <= 0.5


def swing(t: Real) -> tuple[Real, Real]:
    """Return position (m) and speed (m/s) of a hand that moves back and forth."""
    return 3e-3 * (1 - np.cos(20.0 * t)) / 2, 3e-2 * np.sin(20.0 * t)


def test_a_hand_is_late_by_what_the_plan_says_and_else_the_trajectory() -> None:
    rate, count = 8000, 3000
    t = np.arange(count + 400) / rate
    place, speed = swing(t)
    points = [[float(a), float(b), 0.3] for a, b in zip(t, place, strict=True)]
    sections: dict[str, Any] = {
        "effects": {"inertia": {}}, "accuracy": {"tolerance": 1e-3}, "finger": SHORT,
        "output": {"channels": [{"quantity": one, "full_scale": 1e-5} for one in QUANTITIES[:1]], "sample_rate": rate},
    }  # fmt: skip
    recorded = physical(open_voice(parse_scene({**sections, "scan": {"trajectory": points}})), count)[:, 0]
    voice = open_voice(parse_scene(sections))
    motion = Motion.of(count, speed=speed[:count], speed_rate=0.6 * np.cos(20.0 * t[:count]), load=0.3)
    live = voice.render(count, motion).astype(float)[:, 0] * voice.full_scale[0]
    late = voice.late
    assert 1 <= late <= 0.01 * rate
    apart = live[late + 400 :] - recorded[400 : count - late]
    assert np.max(np.abs(apart - np.mean(apart))) <= 2e-3 * np.ptp(recorded)


@pytest.mark.parametrize("live", [False, True])
def test_a_finger_that_all_cancels_under_stays_where_it_stands(live: bool) -> None:
    """Two whole periods and four ridges are all pressed flat: nothing drives the mass, not even rounding."""
    texture = {"kind": "sinusoid", "period": "1 mm", "amplitude": "20 um"}
    finger, scan = {"contact_length": "2 mm"}, {"speed": "300 mm/s", "load": "20 N"}
    document = {"finger": finger, "texture": texture, "scan": scan, "effects": {"inertia": {}}}
    voice = open_voice(document, live=live)
    assert np.max(np.abs(voice.render(4800))) == 0.0
    assert live or "less than 1 nm" in voice.warnings[0]
