"""Viscous skin in whole renders: an oracle of separate places of skin, slow scans, the relaxed contact."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from synth import LiveVoice, Voice, open_voice, parse_scene
from synth.plan.prepare import prepare
from synth.scene.scene import Scene
from synth.surfaces import profile_of
from tests.few import paired, thorough
from tests.reference.creeping_oracle import Creep, Solid
from tests.reference.moving_oracle import Harmonics
from tests.reference.stiffness_oracle import contact_in_metres
from tests.synth.effects.whole_renders import (
    SHORT,
    WITH_BANDWIDTH,
    check_quantities,
    errors_of,
    kept_band,
    named,
    scene_of,
)
from tests.synth.engine_cases import QUANTITIES, physical, touch_of

PLACES, STEPS = 8000, 1024  # more places than steps can resolve: a step moves the surface by half their distance
PERIODS = 3  # of which the last is compared: after 20 ms a start is left with 1e-5 of the acceleration
FORGOTTEN = {"wide": 1.25}  # periods of 62 ms
LOOSE = {"tolerance": 1e-2}  # for few steps per frame
SMALL: dict[str, Any] = {"finger": {"contact_length": "1.5 mm"}, "scan": {"load": "75 mN"}}
"""Three ridges, of which as much touches as of SHORT at 0.3 N."""
FEW = 2400  # places on a short contact, as close as PLACES on the default
THREE = {
    "model": "three_time_constants", "short_time": 1e-3, "middle_time": 2e-3, "long_time": 4e-3,
    "short_weight": 0.1, "middle_weight": 0.3, "long_weight": 0.2,
}  # fmt: skip


def mean_z(scene: Scene) -> float:
    """Return the mean of z (m) over a period of the elastic contact."""
    return float(np.mean(np.asarray(contact_in_metres(touch_of(scene), np.arange(256) / 256).approach, dtype=float)))


def creep_of(scene: Scene, places: int) -> Creep:
    """Return the oracle's finger of `scene`."""
    skin, scan, mass = scene.effects["viscous_skin"], scene.scan, scene.effects.get("inertia")
    solid = Solid((skin.time_constant,)) if skin.model == "kelvin_voigt" else Solid(
        (skin.short_time, skin.middle_time, skin.long_time), (skin.short_weight, skin.middle_weight, skin.long_weight)
    )  # fmt: skip
    moving = (0.0, 0.0, 0.0, 0.0) if mass is None else (mass.mass, mass.damping, mass.stiffness, mean_z(scene))
    if scene.texture.kind == "sinusoid":
        return Creep(touch_of(scene), scan.speed, solid, places, *moving)
    profile = profile_of(scene)
    equal = profile.equivalent()
    touch = replace(touch_of(parse_scene({})), texture_period=equal.period, texture_amplitude=equal.amplitude)
    touch = replace(touch, contact_length=scene.finger.contact_length, load=scan.load)
    return replace(Creep(touch, scan.speed, solid, places, *moving), profile=profile)


def oracle(
    scene: Scene, periods: float, places: int = PLACES, steps: int = STEPS
) -> tuple[Harmonics, dict[str, float]]:
    """Return z of the steady scan, and the change of each quantity with half the places plus with half the steps."""
    creep, fewer = creep_of(scene, places), creep_of(scene, places // 2)
    runs = [creep.last_period(count, periods) for count in (steps // 2, steps, 2 * steps)]
    fine = creep.extrapolated(*runs[1:])
    others = [fewer.steady(steps, periods), creep.extrapolated(*runs[:2])]
    frames, rate, limit, apart = np.arange(800), scene.output.sample_rate, kept_band(scene), {}
    for order, quantity in enumerate(QUANTITIES):
        signals = [one.signal(order, frames, rate, limit) for one in (fine, *others)]
        extent = np.ptp(signals[0])
        apart[quantity] = float(sum(np.max(np.abs(one - signals[0])) / extent for one in signals[1:]))
    return fine, apart


GRATING = {"kind": "grating", "period": "1.5 mm", "height": "40 um", "duty": 0.4, "ramp": "0.3 mm"}
WAVES = {"kind": "harmonics", "period": "1.2 mm", "amplitudes": ["12 um", "0 um", "3 um"], "phases": [0.3, 0.0, 1.0]}
OTHERS: dict[str, dict[str, Any]] = {"grating": {"texture": GRATING}, "harmonics": {"texture": WAVES}}


@pytest.mark.parametrize("name", [*named("default"), *map(thorough, OTHERS)])
def test_a_steady_render_errs_by_no_more_than_the_plan_says(name: str) -> None:
    sections: dict[str, Any] = SMALL if name == "default" else {"finger": SHORT, **OTHERS.get(name, {})}
    scene = scene_of("default" if name in OTHERS else name, {"viscous_skin": {}}, accuracy=LOOSE, **sections)
    wanted, own = oracle(scene, FORGOTTEN.get(name, PERIODS), FEW // 2 if name == "default" else FEW)
    assert own["displacement"] <= 0.02
    check_quantities(scene, (wanted,), own)


def test_relaxing_skin_errs_by_no_more_than_the_plan_says() -> None:
    scene = scene_of("default", {"viscous_skin": THREE}, accuracy=LOOSE, **SMALL)
    wanted, own = oracle(scene, 8, 500)
    assert own["acceleration"] <= 0.02
    check_quantities(scene, (wanted,), own)


@pytest.mark.thorough
def test_skin_with_a_mass_errs_by_no_more_than_the_plan_says() -> None:
    scene = scene_of("default", {"viscous_skin": {}, "inertia": {}})
    wanted, own = oracle(scene, 5)
    check_quantities(scene, (wanted,), own)


@pytest.mark.thorough
@pytest.mark.parametrize(("name", "bandwidth"), WITH_BANDWIDTH)
def test_so_it_does_at_48_khz(name: str, bandwidth: float | str) -> None:
    full = bandwidth == "full"
    accuracy = LOOSE if full else {}  # in the full band the error of the oracle is larger than that too
    scene = scene_of(name, {"viscous_skin": {}}, 48000, output={"bandwidth": bandwidth}, accuracy=accuracy)
    finer = 1 if not full else 4 if name == "wide" else 2  # for wide: below, halves do not tell its error
    wanted, own = oracle(scene, FORGOTTEN.get(name, PERIODS), 2 * finer * PLACES, finer * STEPS)
    check_quantities(scene, (wanted,), own)


def test_a_file_takes_the_steps_and_points_that_its_tolerance_asks_for() -> None:
    """A stream of the same scan has them, too, since its period is solved once. A hand has no time for so many."""
    scene = parse_scene(
        {
            "finger": SHORT,
            "effects": {"viscous_skin": {}},
            "output": {"quantity": "acceleration", "sample_rate": 8000},
        }
    )
    hand = Voice(prepare(scene, by_hand=True))
    for voice in (open_voice(scene), LiveVoice(scene)):
        assert voice.plan.estimated_error["acceleration"] <= 1e-3 < hand.plan.estimated_error["acceleration"]
        assert not voice.plan.warnings
        assert voice.plan.response["simulation"]["processor_seconds_a_second"] == 0.0
    assert hand.plan.warnings and 0.0 < hand.plan.response["simulation"]["processor_seconds_a_second"] <= 0.25


@pytest.mark.thorough
def test_acceleration_of_a_file_is_within_a_thousandth() -> None:
    """The oracle of separate places is extrapolated from three runs; its remaining error is added."""
    scene = scene_of("default", {"viscous_skin": {}})
    runs = [creep_of(scene, PLACES << finer).steady(STEPS << finer, PERIODS) for finer in range(3)]
    rough, fine = (Harmonics(2.0 * b.values[: len(a.values)] - a.values, a.fundamental_hz) for a, b in pairwise(runs))
    frames, limit = np.arange(800), kept_band(scene)
    signals = [one.signal(2, frames, 8000, limit) for one in (fine, rough)]
    own = float(np.max(np.abs(signals[0] - signals[1])) / np.ptp(signals[0]))
    error = errors_of(scene, open_voice(scene), {"acceleration": (fine, 2)})["acceleration"]
    assert error + own <= 1e-3


@pytest.mark.parametrize(
    ("name", "effects"), paired(["default", "light", "wide"], [{}, {"time_constant": 0.01}, THREE]), ids=str
)
def test_displacement_is_about_its_mean(name: str, effects: dict[str, Any]) -> None:
    output = {"channels": ["displacement"]}
    scene = scene_of(name, {"viscous_skin": effects}, accuracy=LOOSE, finger=SHORT, output=output)
    period = scene.texture.period / scene.scan.speed
    block = physical(open_voice(scene), round(2 * max(1, round(0.05 / period)) * period * 8000))
    assert abs(np.mean(block)) <= 2e-3 * np.ptp(block)


def test_slow_scans_are_elastic() -> None:
    changes = []
    for speed in (0.08, 0.02, 0.005):
        output = {"quantity": "displacement", "sample_rate": 8000}
        sections: dict[str, Any] = {"finger": SHORT, "output": output, "scan": {"speed": speed}}
        viscous = parse_scene({**sections, "effects": {"viscous_skin": {"time_constant": 5e-4}}})
        count = round(8000 * 0.8e-3 / speed)
        moved, still = (physical(open_voice(one), count)[:, 0] for one in (viscous, parse_scene(sections)))
        changes.append(np.max(np.abs(moved - still)) / np.ptp(still))
    assert changes[0] > 5e-3
    assert changes[0] > 1.5 * changes[1] > 2.25 * changes[2] or changes[2] <= 2e-3


@pytest.mark.parametrize("length", ["1.6 mm", thorough("3.15 mm")])
def test_on_corners_the_error_of_the_points_is_told(length: str) -> None:
    document: dict[str, Any] = {
        "finger": {"ridge_period": "0.44 mm", "ridge_amplitude": "24 um", "contact_length": length},
        "texture": {"kind": "grating", "period": "0.5 mm", "height": "31 um", "duty": 0.7, "ramp": "86 um"},
        "scan": {"speed": "125 mm/s", "load": "0.17 N"},
        "effects": {"viscous_skin": {"time_constant": "1.2 ms"}},
        "output": {"channels": list(QUANTITIES), "sample_rate": 8000},
    }
    voice, exact = (open_voice({**document, "accuracy": {"tolerance": one}}) for one in (1e-2, 1e-3))
    found, wanted = (physical(one, 800) for one in (voice, exact))
    errors = np.max(np.abs(found - wanted), axis=0) / np.ptp(wanted, axis=0)
    told = [voice.plan.estimated_error[one] for one in QUANTITIES]
    assert np.all(errors <= told), f"errs by {errors}, reported {told}"
