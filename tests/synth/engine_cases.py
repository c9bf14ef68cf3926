"""Shared by the tests of the engine: scenes from documents, the same touch for the oracles, random documents."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from synth.arrays import Block
from synth.contact.stiffness import Stiffness
from synth.scene.scene import Scene, parse_scene
from synth.voice.voice import Voice
from tests.reference.stiffness_oracle import Touch

QUANTITIES = ("displacement", "velocity", "acceleration")
RATES = (8000, 44100, 48000, 96000)

Real = npt.NDArray[np.float64]


def scene_of(**sections: Any) -> Scene:
    """Return the scene of the given sections. Without a bandwidth it has the full band, which is the hardest case."""
    return parse_scene(sections | {"output": {"bandwidth": "full"} | sections.get("output", {})})


def load_of(law: Stiffness, indentation: float) -> float:
    """Return the load (N) whose mean indentation w / k is `indentation` (m)."""
    return float((indentation / law.indentation(1.0)) ** (1.0 / law.load_exponent))


def touch_of(scene: Scene) -> Touch:
    """Return the touch of `scene` for the oracles."""
    finger, texture = scene.finger, scene.texture
    return Touch(
        load=scene.scan.load,
        contact_length=finger.contact_length,
        ridge_period=finger.ridge_period,
        texture_period=texture.period,
        ridge_amplitude=finger.ridge_amplitude,
        texture_amplitude=texture.amplitude,
        finger_modulus=finger.youngs_modulus,
        finger_poisson=finger.poisson_ratio,
        texture_modulus=texture.youngs_modulus,
        texture_poisson=texture.poisson_ratio,
        phase=texture.phase,
    )


def spread(random: np.random.Generator, low: float, high: float) -> float:
    """Return a number between `low` and `high`, uniform on a logarithmic scale."""
    return math.exp(random.uniform(math.log(low), math.log(high)))


def random_document(random: np.random.Generator, rate: int, tolerance: float = 1e-3) -> dict[str, Any]:
    """Return a steady scene of all three quantities whose oracle takes well under a second."""
    period = spread(random, 3e-4, 3e-3)
    fundamental = spread(random, rate / 150, rate / 12)
    return {
        "finger": {
            "ridge_period": spread(random, 3e-4, 1e-3),
            "ridge_amplitude": spread(random, 5e-6, 8e-5),
            "contact_length": spread(random, 3e-3, 8e-3),
            "youngs_modulus": spread(random, 4e4, 1e6),
        },
        "texture": {
            "period": period,
            "amplitude": spread(random, 2e-6, 1e-4),
            "phase": float(random.uniform(0, 6.28)),
        },
        "scan": {
            "speed": min(fundamental * period, 10.0) * float(random.choice([-1, 1])),
            "load": spread(random, 1e-2, 3),
        },
        "output": {"channels": list(QUANTITIES), "sample_rate": rate, "duration": 0.25, "bandwidth": "full"},
        "accuracy": {"tolerance": tolerance},
    }


def physical(voice: Voice, frames: int) -> Real:
    """Return the next `frames` frames of `voice` in SI units, float64 [frames, channels]."""
    return np.asarray(voice.render(frames).astype(float) * np.array(voice.full_scale))


def largest_step(samples: Block | Real) -> float:
    """Return the largest change from frame to frame of one channel, [frames] or [frames, 1]."""
    return float(np.max(np.abs(np.diff(samples.astype(float), axis=0))))
