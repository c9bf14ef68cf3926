"""Adhesion in whole renders: an oracle that follows the finger in small moves, pull-off, release, and return."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from synth import open_voice, parse_scene
from synth.motion.scan_motion import LIFT_TIME
from synth.scene.scene import Scene
from tests.reference.adhesion_oracle import Held, Path
from tests.reference.moving_oracle import Harmonics
from tests.reference.stiffness_oracle import Touch
from tests.reference.synthesis_oracle import mean_approach
from tests.synth.effects.whole_renders import SHORT, below, check_quantities, kept_band, named, scene_of
from tests.synth.engine_cases import QUANTITIES, Real, physical, touch_of

PHASES = 1024
RATE = 8000
LIFT = 1e-3  # N
QUICK: dict[str, Any] = {"finger": SHORT, "accuracy": {"tolerance": 1e-2}}
STRONG = {"stress": "20 kPa", "reach": "20 um"}  # a finger of 3 mm lets go at a pull of 0.010 to 0.016 N


def path_of(scene: Scene) -> Path:
    """Return the oracle's finger of `scene`."""
    adhesion = scene.effects["adhesion"]
    touch = replace(touch_of(scene), load=max(scene.scan.load, LIFT))
    return Path(touch, adhesion.stress, adhesion.reach, LIFT)


def oracle(scene: Scene) -> tuple[Harmonics, dict[str, float]]:
    """Return z of the steady scan, and the change of each quantity with half as many phases."""
    several, count = [], PHASES
    for count in (PHASES, PHASES // 2):
        theta = np.copysign(1.0, scene.scan.speed) * np.arange(-count // 4, count) / count
        found = path_of(scene).followed(theta, np.full(len(theta), scene.scan.load))
        assert np.all(found.held == 1.0)
        z = found.z[count // 4 :]
        several.append(Harmonics(np.fft.rfft(z) / count, abs(scene.scan.speed) / scene.texture.period))
    frames, limit, apart = np.arange(800), kept_band(scene), {}
    for order, quantity in enumerate(QUANTITIES):
        fine, coarse = (one.signal(order, frames, RATE, limit) for one in several)
        apart[quantity] = float(np.max(np.abs(fine - coarse)) / np.ptp(fine))
    return several[0], apart


@pytest.mark.parametrize("name", named("default"))
def test_a_steady_render_errs_by_no_more_than_the_plan_says(name: str) -> None:
    scene = scene_of(name, {"adhesion": {}}, finger=SHORT)
    wanted, own = oracle(scene)
    check_quantities(scene, (wanted,), own)


@pytest.mark.thorough
def test_an_attraction_that_sinks_the_finger_far_is_within_the_table() -> None:
    """The pull is up to 2 N at a load of 0.3 N. A table down to the mean indentation of the pull erred by 9e-2."""
    scene = scene_of("default", {"adhesion": STRONG})
    wanted, own = oracle(scene)
    assert own["acceleration"] <= 1e-3
    check_quantities(scene, (wanted,), own)


def test_a_constant_pull_is_held_where_there_is_a_root() -> None:
    scene = scene_of("default", {"adhesion": STRONG}, scan={"load": "-0.005 N"}, **QUICK)
    wanted, own = oracle(scene)
    check_quantities(scene, (wanted,), own)


def test_a_constant_pull_beyond_the_pull_off_is_silence() -> None:
    scene = scene_of("default", {"adhesion": STRONG}, scan={"load": "-0.04 N"}, **QUICK)
    assert not np.any(open_voice(scene).render(1000))


@pytest.mark.parametrize("shape", ["contact_growth", "curvature"])
def test_a_contact_whose_shape_follows_the_load_may_be_pulled(shape: str) -> None:
    scene = scene_of("default", {"adhesion": STRONG, shape: {}}, scan={"load": "-0.005 N"}, **QUICK)
    voice = open_voice(scene)
    assert shape in [one.name for one in voice.plan.simulated]
    assert np.isfinite(voice.render(1000)).all()


def pulled(lowest: float, seconds: float) -> tuple[dict[str, Any], Real, Real]:
    """Return a recording that presses, pulls down to `lowest` (N) and presses again; its positions and its loads.

    Positions and loads are at twice the rate. Nothing moves in the first 0.05 s; the texture is fastest at the end.
    """

    def at(t: Real) -> tuple[Real, Real]:
        s = np.maximum(t - 0.05, 0.0) / (seconds - 0.1)
        load = 0.02 + (lowest - 0.02) * (1 - np.cos(2 * np.pi * np.minimum(s, 1.0))) / 2
        return 3e-3 * s**2, load

    points = np.arange(round(seconds * 2000) + 1) / 2000
    place, load = at(points)
    document = {"trajectory": np.stack([points, place, load], axis=1).tolist()}
    return document, *at(np.arange(2 * round(seconds * RATE)) / (2 * RATE))


def rendered(lowest: float, seconds: float = 0.15) -> tuple[Real, Held, Real, Touch]:
    """Return the displacement (m), the motion of the oracle at twice the rate, the loads, and the touch."""
    scan, place, load = pulled(lowest, seconds)
    output = {"quantity": "displacement", "sample_rate": RATE, "bandwidth": "full"}
    sections: dict[str, Any] = {"scan": scan, "output": output, "finger": SHORT}
    scene = parse_scene({**sections, "effects": {"adhesion": STRONG}, "accuracy": {"tolerance": 3e-3}})
    found = path_of(scene).followed(place / scene.texture.period, load)
    return physical(open_voice(scene), len(load) // 2)[:, 0], found, load, touch_of(scene)


def test_it_pulls_lets_go_is_silent_and_comes_back_as_the_oracle_does() -> None:
    found, wanted, load, touch = rendered(-0.03)
    held = np.flatnonzero(np.diff(wanted.held)) // 2
    assert len(held) == 2, "it lets go once, and comes back once"
    off, on = held.tolist()
    assert -0.02 < load[2 * off] < -0.008, "it was held against a pull"
    fade, near = round(LIFT_TIME * RATE), 60
    assert not np.any(found[off + fade + near : on - near])
    assert np.all(found[on + near :] != 0.0) and np.all(found[near : off - near] != 0.0)
    silent = np.flatnonzero(found == 0.0)
    silent = silent[silent > near]
    assert np.all(np.diff(silent) == 1), "no chatter: one silence"
    about = np.asarray(wanted.z - mean_approach(touch, np.maximum(load, 0.0), phases=32))
    reach = 24
    truth = below(about, 2, reach=reach)
    ours = below(found, 1, reach=reach)
    parts = [slice(near, off - near - 2 * reach), slice(on + fade + near, len(ours) - near)]
    level = np.mean(np.concatenate([ours[part] - truth[part] for part in parts]))
    for part in parts:
        assert np.max(np.abs(ours[part] - truth[part] - level)) <= 5e-3 * np.ptp(truth[part])


@pytest.mark.thorough
def test_a_pull_that_is_held_all_the_time_is_never_silent() -> None:
    found, wanted, load, _touch = rendered(-0.005)
    assert np.all(wanted.held == 1.0) and np.min(load) < 0.0
    assert np.all(found[60:] != 0.0)


def test_a_band_of_many_harmonics_errs_by_no_more_than_the_plan_says() -> None:
    document: dict[str, Any] = {
        "finger": {"contact_length": "1.2 mm", "ridge_period": "0.43 mm", "ridge_amplitude": "8 um"},
        "texture": {"kind": "grating", "period": "3.2 mm", "height": "17 um", "duty": 0.7, "ramp": "0.25 mm"},
        "scan": {"speed": "0.22 m/s", "load": "0.09 N"},
        "effects": {"adhesion": {"stress": "10 kPa", "reach": "16 um"}},
        "output": {"channels": list(QUANTITIES), "sample_rate": 48000, "bandwidth": "full"},
    }
    voice, exact = (open_voice({**document, "accuracy": {"tolerance": one}}) for one in (1e-3, 2e-5))
    found, wanted = (physical(one, 2400) for one in (voice, exact))
    errors = np.max(np.abs(found - wanted), axis=0) / np.ptp(wanted, axis=0)
    told = [voice.plan.estimated_error[one] for one in QUANTITIES]
    assert np.all(errors <= told), f"errs by {errors}, reported {told}"
    assert errors[2] <= 1e-4
