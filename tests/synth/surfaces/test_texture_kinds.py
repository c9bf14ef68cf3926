"""Renders of every kind of texture: against quadrature on the true heights, against the sinusoid, and by their lines.

The oracle is independent of the solver: heights at 20,000 points of the contact, and a root search for z.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest

import ridgewave as rw
from synth import LiveVoice
from synth.contact.scene_contact import contact_of
from synth.contact.stiffness import Stiffness
from synth.response.demand import Demand, curves
from synth.response.spectrum import solve_spectrum
from synth.surfaces import profile_of
from synth.voice.hand_voice import HandVoice
from tests.few import thorough
from tests.reference.kinds_oracle import Tabled
from tests.synth.surfaces.texture_cases import random_texture

FEW = 1
KINDS = ("harmonics", "grating", "rough", "profile")
RATE = 8000
SETTLED = 1e-4
Real = np.ndarray[Any, np.dtype[np.float64]]
Complex = np.ndarray[Any, np.dtype[np.complex128]]


def settled_series(z: Callable[[Real], Real], highest: int) -> Complex:
    """Return the lines 0 to `highest` of z (m) at phases in turns, without the mean.

    The phases are doubled until that moves the curve of the lines by less than SETTLED of its peak-to-peak.
    """
    count = max(256, 1 << (4 * highest).bit_length())
    points = 1 << (4 * highest).bit_length()
    found = z(np.arange(count) / count)
    kept = lines(found, highest)
    while True:
        found = np.stack([found, z((np.arange(len(found)) + 0.5) / len(found))], axis=1).ravel()
        before, kept = kept, lines(found, highest)
        if np.ptp(curves(kept - before, 0, points)) < SETTLED * np.ptp(curves(kept, 0, points)):
            return kept


def lines(z: Real, highest: int) -> Complex:
    """Return the lines 0 to `highest` of z at equal phases of a period, without the mean."""
    kept = np.fft.rfft(z)[: highest + 1] / len(z)
    kept[0] = 0.0
    return kept


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    "seeds", [range(FEW), *(thorough(range(first, min(first + 25, 100))) for first in range(FEW, 100, 25))]
)
def test_a_file_is_the_quadrature_on_the_true_heights(kind: str, seeds: range) -> None:
    """The error is within the tolerance or, where a warning reports that it was not reached, within that reported."""
    for seed in seeds:
        random = np.random.default_rng([KINDS.index(kind), seed])
        texture = random_texture(kind, random)
        load, speed = float(10.0 ** random.uniform(-1.5, 0.5)), float(random.uniform(0.05, 0.2))
        output = {"quantity": "displacement", "sample_rate": RATE, "duration": 0.1}
        sound = rw.render({"texture": texture, "scan": {"load": load, "speed": speed}, "output": output})
        scene = rw.parse_scene(sound.scene)
        profile = profile_of(scene)
        highest = max(1, math.ceil(1000.0 / (speed / profile.period)) - 1)
        pressed = load / Stiffness.of_scene(scene).stiffness(load)
        of_turns = partial(Tabled(profile).approach, scene.finger, indentation=pressed)
        kept = settled_series(of_turns, highest)
        extent = float(np.ptp(curves(kept, 0, 1 << (4 * highest).bit_length())))
        places = speed / profile.period * np.arange(len(sound.values)) / RATE
        n = np.arange(1, len(kept))
        wanted = 2.0 * (np.exp(2j * math.pi * np.outer(places, n)) @ kept[1:]).real
        error = float(np.max(np.abs(sound.values[:, 0] - wanted))) / extent
        told = sound.plan.estimated_error["displacement"] if sound.plan else 0.0
        assert error <= max(1e-3, told) + 2e-4, (seed, texture, error)  # 2e-4: error of the oracle, by halving its step


EFFECTS: dict[str, dict[str, Any]] = {
    "no effect": {}, "curvature": {"curvature": {}}, "viscous skin": {"viscous_skin": {}, "tangential": {}},
}  # fmt: skip


@pytest.mark.parametrize("name", EFFECTS)
def test_a_sinusoid_by_another_name_is_one(name: str) -> None:
    """With viscous skin, whose steps are coarser, within the errors that both plans report."""
    channels = ["displacement", "acceleration"]
    tolerance = 1e-2 if name == "viscous skin" else 1e-3
    scene: dict[str, Any] = {"effects": EFFECTS[name], "accuracy": {"tolerance": tolerance}}
    scene["finger"] = {"contact_length": "3 mm"}
    scene["output"] = {"channels": channels, "sample_rate": RATE, "duration": 0.05}
    wanted = rw.render(scene)
    cosine = 20e-6 * np.cos(2.0 * math.pi * np.arange(512) / 512)
    textures: list[dict[str, Any]] = [
        {"kind": "harmonics", "period": "0.8 mm", "amplitudes": ["20 um", "0.001 nm"], "phases": [0.0, 0.0]},
        {"kind": "profile", "heights": cosine.tolist(), "spacing": 0.8e-3 / 512},
    ]
    for texture in textures[: 1 if EFFECTS[name] else 2]:
        found = rw.render(scene | {"texture": texture})
        assert wanted.plan is not None and found.plan is not None
        names = [*channels, *(["tangential_force"] if "tangential" in EFFECTS[name] else [])]
        for channel, ours, theirs in zip(names, found.values.T, wanted.values.T, strict=True):
            told = [plan.estimated_error[channel] for plan in (wanted.plan, found.plan)]
            assert max(told) <= 2.0 * tolerance
            allowed = sum(told) if name == "viscous skin" else 1e-3
            assert np.max(np.abs(ours - theirs)) <= allowed * np.ptp(theirs)


@pytest.mark.parametrize("speed", [0.01, 0.05, 0.3])
def test_the_lines_of_a_grating_are_multiples_of_speed_over_period(speed: float) -> None:
    texture = {"kind": "grating", "period": "1.5 mm", "height": "40 um", "duty": 0.5, "ramp": "0.2 mm"}
    seconds = 50.0 * 1.5e-3 / speed
    output = {"quantity": "displacement", "sample_rate": RATE, "duration": seconds}
    values = rw.render({"texture": texture, "scan": {"speed": speed}, "output": output}).values[:, 0]
    sizes = np.abs(np.fft.rfft(values))
    lines = np.arange(0, len(sizes), 50)
    between = np.setdiff1d(np.arange(len(sizes)), lines)
    assert np.max(sizes[between]) < 1e-5 * np.max(sizes[lines])


def test_in_full_contact_a_rough_surface_keeps_the_slope_of_its_hurst_exponent() -> None:
    """In full contact z is the mean of the heights over the length: the surface through a filter sinc(L / lambda)."""
    texture = {"kind": "rough", "period": "40 mm", "hurst": 0.8, "rms_height": "1 um", "longest": "20 mm"}
    texture |= {"shortest": "1.6 mm", "seed": 5}
    finger = {"ridge_amplitude": "1 um", "contact_length": "0.1 mm", "ridge_period": "0.1 mm"}
    scene = rw.parse_scene({"finger": finger, "texture": texture, "scan": {"load": 100.0}})
    found = np.abs(solve_spectrum(contact_of(scene), 100.0, Demand(25, (0,), 1e-4)).harmonics[2:26])
    n = np.arange(2, 26)
    sinc = np.abs(np.sinc(n * 0.1 / 40.0))
    slope = np.polyfit(np.log(n), 2.0 * np.log(found / sinc), 1)[0]
    assert slope == pytest.approx(-(1.0 + 2.0 * 0.8), abs=0.02)


def test_a_grating_is_felt_live_and_by_hand() -> None:
    scene = rw.parse_scene({"texture": random_texture("grating", np.random.default_rng(0))})
    assert np.any(LiveVoice(scene).render(4800))
    assert np.any(HandVoice(scene).render(4800))
