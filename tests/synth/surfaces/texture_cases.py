"""Random textures of every kind except the sinusoid, as sections of a scene."""

from __future__ import annotations

import math
from typing import Any

import numpy as np


def random_texture(kind: str, random: np.random.Generator) -> dict[str, Any]:
    """Return a texture of `kind` with common sizes."""
    period = float(random.uniform(0.4e-3, 3e-3))
    if kind == "harmonics":
        orders = int(random.integers(2, 9))
        sizes = 20e-6 * random.uniform(0.1, 1.0, orders) / np.arange(1, orders + 1)
        phases = random.uniform(0.0, 2.0 * math.pi, orders)
        return {"kind": kind, "period": period, "amplitudes": sizes.tolist(), "phases": phases.tolist()}
    if kind == "grating":
        ramp = float(random.uniform(0.05, 0.25)) * period
        duty = float(random.uniform(0.35, 0.65))
        return {
            "kind": kind,
            "period": period,
            "height": float(random.uniform(10e-6, 60e-6)),
            "duty": duty,
            "ramp": ramp,
        }
    if kind == "rough":
        shape = {
            "period": 4.0 * period,
            "longest": period,
            "shortest": period / 16.0,
            "seed": int(random.integers(1000)),
        }
        return {"kind": kind, "hurst": float(random.uniform(0.5, 0.9)), "rms_height": 6e-6, **shape}
    heights = np.convolve(random.normal(0.0, 12e-6, 64), np.ones(4) / 4.0, "same")
    heights[0] = heights[-1]
    return {"kind": kind, "heights": heights.tolist(), "spacing": period / 64.0}
