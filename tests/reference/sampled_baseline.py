"""A straightforward implementation of the paper: a trapezoid rule and SciPy's ``brentq``, frame by frame.

Model   integral_0^tau max(h - Z, 0) dX = W of eq. 7 on equally spaced points, solved anew at every frame.
Source  Fagiani & Barbieri 2016, eqs 1 to 7.
Limits  The error relative to the peak-to-peak of z on the default scene is 1 to 3 % with 25 points per ridge, 0.1 to
        0.2 % with 100 and 1e-6 with 6000. Solved at the output frames only, it also aliases. It is independent of the
        engine's own `synth.accuracy.baseline`, which the benchmarks and the accuracy report time.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq

from tests.reference.stiffness_oracle import Touch, stiffness

Real = npt.NDArray[np.float64]


def sampled_approach(
    tau: float, period_ratio: float, amplitude_ratio: float, load: float, theta: float, phi: float,
    points_per_ridge: float = 100.0, ridge: float = 1.0,
) -> float:  # fmt: skip
    """Z of eq. 7 at one phase (turns) from ``points_per_ridge`` points on each finger ridge; load W above zero."""
    x = np.linspace(0.0, tau, math.ceil(points_per_ridge * tau) + 1)
    angle = 2 * np.pi * (x / period_ratio - theta) + phi
    height = amplitude_ratio * np.cos(angle) - ridge * np.cos(2 * np.pi * x)

    def missing(approach: float) -> float:
        return float(np.trapezoid(np.maximum(height - approach, 0.0), x)) - load

    lowest = float(height.min()) - load / tau - 1e-6
    return float(brentq(missing, lowest, float(height.max()), xtol=1e-15, rtol=4 * np.finfo(float).eps))


def sampled_signal(
    touch: Touch, speed: float, rate_hz: float, frames: int, quantity: str = "displacement",
    points_per_ridge: float = 100.0,
) -> Real:  # fmt: skip
    """``frames`` values in SI, solved at the frames only, derivatives by central differences; shape [frames].

    Displacement is relative to the mean of the rendered frames. KeyError names an unknown quantity.
    """
    order = {"displacement": 0, "velocity": 1, "acceleration": 2}[quantity]
    groups = stiffness(touch)
    tall = touch.ridge_amplitude + touch.texture_amplitude
    times = np.arange(-1, frames + 1) / rate_hz
    approach = np.array(
        [
            sampled_approach(
                groups.tau, groups.period_ratio, touch.texture_amplitude / tall, groups.indentation_load,
                speed * time / touch.texture_period, touch.phase, points_per_ridge, touch.ridge_amplitude / tall,
            )
            for time in times
        ]
    )  # fmt: skip
    z = tall * approach
    if order == 0:
        return np.asarray(z[1:-1] - z[1:-1].mean())
    if order == 1:
        return np.asarray((z[2:] - z[:-2]) * rate_hz / 2)
    return np.asarray((z[2:] - 2 * z[1:-1] + z[:-2]) * rate_hz**2)
