"""The tangential force of a measurement beside the model: against the slopes of a sinusoid, summed apart."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import ridgewave as rw
from synth.contact.scene_contact import contact_of
from synth.study.comparison import compared
from synth.study.simulated_outcome import force_lines

RATE = 10_000.0
SCENE: dict[str, Any] = {
    "texture": {"period": "1.3 mm", "amplitude": "20 um"},
    "scan": {"speed": "60 mm/s", "load": 0.4},
}


def slope_force(phases: int = 4096, places: int = 40_000) -> Any:
    """Return the force of the pressure on the slopes at each phase of a period, N: eq. 1 times dh2/dx, by sums."""
    scene = rw.parse_scene(SCENE)
    finger, texture, contact = scene.finger, scene.texture, contact_of(scene)
    x = (np.arange(places) + 0.5) / places * finger.contact_length
    k = contact.stiffness_at(0.4)
    forces = []
    for turn in np.arange(phases) / phases:
        angle = 2 * np.pi * (x / texture.period - turn) + texture.phase
        h = texture.amplitude * np.cos(angle) - finger.ridge_amplitude * np.cos(2 * np.pi * x / finger.ridge_period)
        low, high = h.min() - 1e-3, h.max()
        for _ in range(60):
            z = 0.5 * (low + high)
            low, high = (z, high) if k * np.mean(np.maximum(h - z, 0.0)) > 0.4 else (low, z)
        slope = -2 * np.pi / texture.period * texture.amplitude * np.sin(angle)
        forces.append(-k * np.mean(np.maximum(h - z, 0.0) * slope))
    return np.array(forces)


@pytest.fixture(scope="module")
def lines() -> Any:
    return 2.0 * np.abs(np.fft.rfft(slope_force(512, 8000))[1:21]) / 512


def test_lines_of_the_force_are_those_of_the_slopes(lines: Any) -> None:
    found = force_lines(rw.parse_scene(SCENE, output={"bandwidth": "full"}), 20)
    np.testing.assert_allclose(found, lines, atol=2e-3 * np.max(lines))


def test_a_force_with_noise_is_compared_within_half_a_decibel(lines: Any) -> None:
    f, t = 0.06 * 1.03 / 1.3e-3, np.arange(round(4 * RATE)) / RATE
    force = np.sum([size * np.cos(2 * np.pi * n * f * t + n) for n, size in enumerate(lines, 1)], axis=0)
    force = 0.2 + force + 0.1 * np.std(force) * np.random.default_rng(8).standard_normal(len(t))
    found = compared(rw.parse_scene(SCENE), force, RATE, "tangential_force", "force", scaled=True)
    assert found.speed == pytest.approx(0.0618, rel=5e-3)
    strong = [one for one in found.lines if one.measured.found and one.model > 0.2 * np.max(lines)]
    assert len(strong) >= 2
    assert all(abs(one.difference or 0.0) < 0.5 for one in strong)


def test_no_other_quantity_is_compared() -> None:
    with pytest.raises(rw.InvalidRequest, match="tangential_force"):
        compared(rw.parse_scene(SCENE), np.ones(9999), RATE, "normal_force", "force", scaled=True)
