"""Random scenes with effects, over the whole range of their fields: finite samples, or a refusal in words."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from synth import open_voice, parse_scene
from synth.errors import SceneError
from synth.scene.effects_section import declaration
from tests.few import thorough
from tests.synth.effects.effect_cases import ALONE
from tests.synth.engine_cases import spread

WIDE = 0.15  # part of the fields that lie anywhere in their range; the others are near those of a fingertip
FRAMES = 400
SHOWN = (1, 3, 5, 10, 11, 17, 19)
"""Seeds whose scenes have every effect, a constant scan, a stroke and a recording; two of them are refused."""


@pytest.fixture(autouse=True)
def little_patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a plan end with fewer steps and points, and tell the error that remains: exactness is not shown here."""
    monkeypatch.setattr("synth.plan.simulation_plan.PATIENCE_FILE", 0.03)


class Draws:
    """Random numbers for the fields of one scene."""

    def __init__(self, seed: int) -> None:
        self.random = np.random.default_rng(seed)

    def one(self, low: float, high: float, usual: tuple[float, float]) -> float:
        """Return a number in the range `usual`, or sometimes between `low` and `high`."""
        return spread(self.random, low, high) if self.random.random() < WIDE else spread(self.random, *usual)

    def chance(self, part: float) -> bool:
        return bool(self.random.random() < part)

    def settings(self, name: str) -> Any:
        """Return settings of the effect `name`."""
        one = self.one
        if not declaration(name).without_auto and self.chance(0.15):
            return "auto"
        if name == "inertia":
            damping = 0.0 if self.chance(0.2) else one(1e-3, 1e3, (0.1, 10.0))
            stiffness = 0.0 if self.chance(0.4) else one(1.0, 1e6, (2e2, 5e3))
            return {"mass": one(1e-6, 1.0, (1e-4, 2e-2)), "damping": damping, "stiffness": stiffness}
        if name == "viscous_skin":
            if self.chance(0.5):
                return {"time_constant": one(1e-6, 100.0, (1e-4, 1e-2))}
            return {"model": "three_time_constants", "short_time": one(1e-6, 100.0, (1e-4, 1e-2))}
        if name == "adhesion":
            return {"stress": one(1.0, 1e7, (500.0, 5e4)), "reach": one(1e-9, 1e-3, (5e-7, 5e-5))}
        if name == "contact_growth":
            return {"exponent": float(self.random.uniform(0, 1)), "reference_load": one(1e-3, 1e3, (0.1, 2.0))}
        if name == "curvature":
            return {"reference_load": one(1e-3, 1e3, (0.1, 2.0))}
        if name == "propagation":
            place = str(self.random.choice(["nail", "skin", "wrist"]))
            return {"place": place, "distance": one(1e-6, 0.5, (1e-3, 0.2))}
        exponent = float(self.random.choice([1.0, 1.0, 0.8, 1.2]))
        return {"friction_coefficient": float(self.random.choice([0.0, 0.5, 1.0])), "pressure_exponent": exponent}

    def scan(self) -> dict[str, Any]:
        """Return a constant scan, a stroke or a recording."""
        kind = self.random.random()
        if kind < 0.12:
            return {"stroke": {"length": float(self.random.uniform(0.01, 0.1))}}
        if kind < 0.3:
            steps = self.random.uniform([0.01, -0.01, -0.2], [0.2, 0.01, 1.0], (5, 3))
            steps[:, :2] = np.cumsum(steps[:, :2], axis=0)
            return {"trajectory": np.maximum(steps, [0.0, -1.0, 0.0]).tolist()}
        speed = self.one(1e-6, 10.0, (5e-3, 0.4)) * float(self.random.choice([-1, 1]))
        return {"speed": 0.0 if self.chance(0.05) else speed, "load": 0.0 if self.chance(0.07) else self.load()}

    def load(self) -> float:
        return self.one(1e-9, 1e3, (1e-2, 3.0))


def random_scene(seed: int) -> dict[str, Any]:
    """Return the document of a scene, which may be refused."""
    draws = Draws(seed)
    ridge = draws.one(1e-5, 1e-2, (3e-4, 1e-3))
    finger = {
        "ridge_period": ridge,
        "ridge_amplitude": 0.0 if draws.chance(0.05) else draws.one(1e-9, 1e-3, (5e-6, 8e-5)),
        "contact_length": draws.one(1e-5, 0.1, (2e-3, 5e-3)),
        "youngs_modulus": draws.one(1e3, 1e9, (4e4, 1e6)),
    }
    texture = {
        "period": ridge if draws.chance(0.15) else draws.one(2e-5, 1.0, (2e-4, 5e-3)),
        "amplitude": 0.0 if draws.chance(0.05) else draws.one(1e-9, 1e-3, (2e-6, 1e-4)),
        "phase": float(draws.random.uniform(0, 6)),
    }
    names = draws.random.permutation(ALONE)[: int(draws.random.integers(1, 4))].tolist()
    channels = ["displacement", "velocity", "acceleration"] if draws.chance(0.5) else ["displacement"]
    return {
        "finger": finger,
        "texture": texture,
        "scan": draws.scan(),
        "effects": {name: draws.settings(name) for name in names},
        "output": {"sample_rate": 8000, "bandwidth": "full", "channels": channels},
        "accuracy": {"tolerance": 1e-2},
    }


def outcome(document: dict[str, Any]) -> tuple[str, str]:
    """Return "refused" or "renders", and the message. Raise AssertionError for a forbidden result."""
    try:
        scene = parse_scene(document)
        voice = open_voice(scene)
        block = voice.render(FRAMES)
        plan = voice.plan.document()
    except SceneError as error:
        assert all(fault.pointer and fault.allowed and fault.hint for fault in error.faults)
        return "refused", str(error)
    assert np.all(np.isfinite(block)), document
    assert all(0.0 <= error < np.inf for error in plan["estimated_error"].values()), plan["estimated_error"]
    quiet = document["texture"]["amplitude"] == 0.0 or document["scan"].get("load") == 0.0
    assert not (quiet and np.any(block)), document
    return "renders", ", ".join(f"{one:.1g}" for one in plan["estimated_error"].values())


@pytest.mark.parametrize("seed", [seed if seed in SHOWN else thorough(seed) for seed in range(20)])
def test_a_random_scene_renders_or_is_refused_in_words(seed: int) -> None:
    kind, words = outcome(random_scene(seed))
    assert kind in ("renders", "refused")
    assert words
