"""What a study records of a scene: beside renders, and beside a contact that is summed over points."""

from __future__ import annotations

import math
import warnings
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

import ridgewave as rw
from synth.contact.scene_contact import contact_of
from synth.study.steady_outcome import outcome_of
from tests.few import thorough
from tests.synth.surfaces.texture_cases import random_texture

KINDS = ("sinusoid", "harmonics", "grating", "rough", "profile")
RATE, SECONDS = 8000, 1.0
LIGHT = {"mass": 1e-6, "damping": 0.0, "stiffness": 0.0}


def random_scene(seed: int) -> dict[str, Any]:
    """Return a random steady scene of one of three fingers."""
    random = np.random.default_rng([8, seed])
    kind, finger = KINDS[seed % len(KINDS)], ("comb", "fingertip", "probe")[seed % 3]
    sinusoid = {"period": float(random.uniform(0.3e-3, 4e-3)), "amplitude": float(random.uniform(2e-6, 4e-5))}
    return {
        "finger": {"kind": finger},
        "texture": sinusoid if kind == "sinusoid" else random_texture(kind, random),
        "scan": {"speed": float(random.uniform(0.03, 0.15)), "load": float(random.uniform(0.05, 1.5))},
        "output": {"sample_rate": RATE, "duration": SECONDS, "quantity": "displacement"},
    }


@pytest.mark.parametrize("seed", [seed if seed < 12 else thorough(seed) for seed in range(200)])
def test_every_line_is_that_of_the_render_within_the_told_errors(seed: int) -> None:
    document = random_scene(seed)
    scene = rw.parse_scene(document)
    found = outcome_of(scene, 1024, 16)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rw.RenderWarning)
        sound = rw.render(document)
    values, f = sound.values[:, 0], scene.scan.speed / scene.texture.period
    count = min(max(1, math.ceil(scene.output.band_limit / f) - 1), 400)
    waves = np.outer(2.0 * math.pi * f * np.arange(len(values)) / RATE, np.arange(1, count + 1))
    fitted = np.linalg.lstsq(np.hstack([np.cos(waves), np.sin(waves)]), values, rcond=None)[0]
    lines = fitted[:count] - 1j * fitted[count:]
    extent = float(np.ptp(values))
    assert sound.plan is not None
    told = float(found["error"][0]) + sound.plan.estimated_error["displacement"]
    ours = found["line_amplitude"] * np.exp(1j * np.nan_to_num(found["line_phase"]))
    seen = min(count, 16)
    assert np.max(np.abs(ours[:seen] - lines[:seen])) <= told * extent
    assert not np.any(ours[count:])
    assert found["rms"][0] == pytest.approx(np.std(values), abs=2.0 * told * extent + 0.02 * extent)


def summed(scene: rw.Scene, count: int = 40_001) -> tuple[Any, Any, float]:
    """Return h - z (m) at points of a comb on a sinusoid, at 48 phases, and the stiffness per area (Pa/m)."""
    finger, texture = scene.finger, scene.texture
    x = np.linspace(0.0, finger.contact_length, count)
    contact = contact_of(scene)
    pressed, gaps = contact.indentation(scene.scan.load), []
    for phase in np.arange(48) / 48:
        angle = 2.0 * math.pi * (x / texture.period - phase) + texture.phase
        h = texture.amplitude * np.cos(angle) - finger.ridge_amplitude * np.cos(2.0 * math.pi * x / finger.ridge_period)
        area = lambda z, h=h: float(np.trapezoid(np.maximum(h - z, 0.0), x)) / finger.contact_length - pressed  # noqa: E731
        gaps.append(h - brentq(area, h.min() - 2.0 * pressed, h.max(), xtol=1e-16))
    return np.array(gaps), x, contact.stiffness_at(scene.scan.load) / finger.contact_length**2


@pytest.mark.parametrize("texture", [{}, {"period": "2.3 mm", "amplitude": "8 um"}, {"period": "0.21 mm"}])
def test_contact_patches_and_pressures_are_those_of_points(texture: dict[str, Any]) -> None:
    scene = rw.parse_scene({"texture": texture, "scan": {"load": 0.5}})
    gaps, _x, foundation = summed(scene)
    touching = gaps > 0.0
    begun = np.count_nonzero(touching[:, 1:] & ~touching[:, :-1], axis=1) + touching[:, 0]
    found = outcome_of(scene, 256, 4)
    assert found["contact_fraction"] == pytest.approx(np.mean(touching), rel=2e-3)
    assert found["patches"] == pytest.approx(np.mean(begun), rel=0.02)
    assert found["largest_pressure"] == pytest.approx(foundation * np.max(gaps), rel=0.01)
    area = np.mean(touching) * scene.finger.contact_length**2
    assert found["mean_pressure"] == pytest.approx(0.5 / area, rel=2e-3)


def test_the_told_error_covers_few_phases() -> None:
    worst = 0.0
    for seed in range(40):
        random = np.random.default_rng([9, seed])
        texture = {"period": float(random.uniform(0.3e-3, 4e-3)), "amplitude": float(random.uniform(2e-6, 4e-5))}
        scene = rw.parse_scene({"texture": texture, "scan": {"load": float(random.uniform(0.05, 1.5))}})
        few, many = (outcome_of(scene, phases, 64) for phases in (128, 8192))
        apart = few["line_amplitude"] * np.exp(1j * np.nan_to_num(few["line_phase"]))
        apart = apart - many["line_amplitude"] * np.exp(1j * np.nan_to_num(many["line_phase"]))
        worst = max(worst, float(np.max(np.abs(apart))) / (2.0 * many["peak"][0] * few["error"][0]))
    assert 0.01 < worst <= 1.0


def test_what_moves_nothing_is_zero_and_what_is_unknown_is_nan() -> None:
    flat = outcome_of(rw.parse_scene({"texture": {"amplitude": 0.0}}), 64, 4)
    lifted = outcome_of(rw.parse_scene({"scan": {"load": 0.0}}), 64, 4)
    for found in (flat, lifted):
        assert not found["rms"].any() and not found["line_amplitude"].any() and math.isnan(found["patches"])
    still = outcome_of(rw.parse_scene({"scan": {"speed": 0.0}}), 64, 4)
    assert still["line_amplitude"][0] > 0.0 and still["rms"][1] == 0.0 and math.isnan(still["sensation_level"])
    dots = outcome_of(rw.parse_scene({"texture": {"kind": "dots"}, "finger": {"contact_length": "3 mm"}}), 64, 4)
    assert math.isnan(dots["patches"]) and dots["rms"][0] > 0.0


def test_a_simulated_effect_is_rendered() -> None:
    plain = outcome_of(rw.parse_scene({"scan": {"speed": 0.05}}), 256, 8)
    light = outcome_of(rw.parse_scene({"scan": {"speed": 0.05}, "effects": {"inertia": LIGHT}}), 256, 8)
    assert light["rms"][0] == pytest.approx(plain["rms"][0], rel=0.02)
    assert light["line_amplitude"][0] == pytest.approx(plain["line_amplitude"][0], rel=0.02)


@pytest.mark.parametrize(
    "change", [{"scan": {"stroke": {}}}, {"effects": {"tangential": {}}}], ids=["stroke", "channel"]
)
def test_what_is_not_steady_is_refused(change: dict[str, Any]) -> None:
    with pytest.raises(rw.SceneError):
        outcome_of(rw.parse_scene(change), 64, 4)
