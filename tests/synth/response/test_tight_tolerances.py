"""Combs at tight tolerances: the told error is a bound, against brute force at phases that no solver has."""

from __future__ import annotations

import math
import warnings
from typing import Any

import numpy as np
import pytest

import ridgewave as rw
from synth.contact.stiffness import Stiffness
from synth.surfaces import profile_of
from tests.few import thorough
from tests.reference.comb_oracle import FEWER, LEFT, Comb
from tests.synth.surfaces.texture_cases import random_texture

KINDS = ("sinusoid", "harmonics", "grating", "rough", "profile")
QUANTITIES = ("displacement", "velocity", "acceleration")
MOST_HARMONICS = 12
PIECES = 5000
GRATING = {
    "finger": {"contact_length": 10.125997e-3},
    "texture": {
        "kind": "grating",
        "period": 2.1893832e-3,
        "duty": 0.3297,
        "height": 27.55e-6,
        "ramp": 0.656421e-3,
    },
    "scan": {"speed": -10.548798e-3, "load": 0.3595743},
}
SINUSOID = {
    "finger": {"ridge_period": 0.42047e-3, "ridge_amplitude": 17.246e-6, "contact_length": 12.0869e-3},
    "texture": {"period": 0.104228e-3, "amplitude": 73.6695e-6, "phase": math.sqrt(2.0)},
    "scan": {"speed": 9.067877e-3, "load": 0.197301},
}


def random_comb(seed: int) -> dict[str, Any]:
    """Return a random comb on a random texture of kind number `seed` modulo their number."""
    random = np.random.default_rng([39, seed])
    kind = KINDS[seed % len(KINDS)]
    finger = {
        "ridge_period": float(random.uniform(0.3e-3, 0.7e-3)),
        "ridge_amplitude": float(random.uniform(10e-6, 60e-6)),
        "contact_length": float(random.uniform(3e-3, 12e-3)),
    }
    sinusoid = {"period": float(random.uniform(0.1e-3, 4e-3)), "amplitude": float(random.uniform(2e-6, 60e-6))}
    texture = sinusoid if kind == "sinusoid" else random_texture(kind, random)
    scan = {"load": float(10.0 ** random.uniform(-2.0, 0.5)), "speed": float(random.uniform(0.01, 0.2))}
    return {"finger": finger, "texture": texture, "scan": scan}


def check(asked: dict[str, Any], quantity: str, tolerance: float) -> None:
    """Compare a render at `tolerance` with brute force."""
    scene = rw.parse_scene(asked)
    turns = abs(scene.scan.speed) / scene.texture.period
    rate = min(48000, max(2000, math.ceil(2.0 * MOST_HARMONICS * turns)))
    bandwidth = min(0.4 * rate, (MOST_HARMONICS + 0.5) * turns)
    output = {"quantity": quantity, "sample_rate": rate, "duration": 400 / rate, "bandwidth": bandwidth}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rw.RenderWarning)
        sound = rw.render({**asked, "output": output, "accuracy": {"tolerance": tolerance}})
    assert sound.plan is not None
    highest = max(1, math.ceil(bandwidth / turns) - 1)
    tight = tolerance <= 1e-5
    phases = (4 if tight else 1) * 3 * 5 * 16 * highest + 1  # no power of two
    profile, law = profile_of(scene), Stiffness.of_scene(scene)
    comb = Comb(
        scene.finger.ridge_amplitude, scene.finger.ridge_period, scene.finger.contact_length or 0.0,
        law.indentation(scene.scan.load), profile.heights, profile.period,
    )  # fmt: skip
    n = np.arange(1, highest + 1)
    factor = (2j * math.pi * scene.scan.speed / profile.period * n) ** QUANTITIES.index(quantity)
    places = scene.scan.speed / profile.period * np.arange(len(sound.values)) / rate
    over = np.exp(2j * math.pi * np.outer(np.arange(16 * highest) / (16 * highest), n))
    for more in (1, 4):
        pieces = more * (4 if tolerance < 1e-5 else 1) * PIECES * max(1, math.ceil(0.5e-3 / profile.period))
        fine, rough = (comb.series(highest, phases, round(number)) for number in (FEWER * pieces, pieces))
        extent = float(np.ptp(2.0 * (over @ (fine[1:] * factor)).real))
        doubt = 2.0 * LEFT * float(np.max(np.abs(over @ ((fine - rough)[1:] * factor)))) / extent
        if doubt < 10.0 * tolerance:
            break
    wanted = 2.0 * (np.exp(2j * math.pi * np.outer(places, n)) @ (fine[1:] * factor)).real
    true, told = float(np.max(np.abs(sound.values[:, 0] - wanted))) / extent, sound.plan.estimated_error[quantity]
    assert doubt < 10.0 * tolerance
    assert true <= told + 2.0 * doubt + 2.0**-24, f"true {true:.2e}, told {told:.2e}, doubt {doubt:.2e}"


@pytest.mark.parametrize(("asked", "quantity"), [(GRATING, "acceleration"), thorough(SINUSOID, "displacement")])
def test_combs_that_erred_are_within_the_told_error(asked: dict[str, Any], quantity: str) -> None:
    """Segments and phases were both powers of two, so the segments erred least where they were judged."""
    check(asked, quantity, 1e-5)


@pytest.mark.parametrize("seed", [1, 2, *(thorough(seed) for seed in (0, *range(3, 100)))])
def test_a_random_comb_is_within_the_told_error(seed: int) -> None:
    check(random_comb(seed), QUANTITIES[seed % 3], (1e-5, 1e-3, 1e-4, 1e-6)[seed % 4])
