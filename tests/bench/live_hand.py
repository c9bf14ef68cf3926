"""Scenes and hands of the load generator's streams: scenes that differ, and strokes back and forth.

Model: position A sin(2 pi f t + phase), or minimum-jerk sweeps of the same length and time (10 s^3 - 15 s^4 + 6 s^5).
    The load varies slowly about its mean. Streams differ in phase and pace, so their updates are never alike.
Source: Flash and Hogan (1985), J. Neurosci. 5(7), for minimum jerk; the rest are unverified defaults.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

REACH = 0.03  # m to either side: the usual sweep of a finger; a much longer one is that of an arm
PACE_HZ = 0.7  # sweeps there and back per second: with REACH, 0.13 m/s at the middle; no hand exceeds 3 Hz
FASTEST = 0.16  # m/s, of a sine: 2 pi REACH PACE_HZ, plus the fifth by which paces differ
LOAD = 0.4  # N, the middle
LOAD_SWING = 0.3  # of the middle
LOAD_HZ = 0.23  # slow compared with the strokes, and not a simple fraction of them
GOLDEN = 0.6180339887498949  # steps of it, modulo 1, spread any number of scenes evenly

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Hand:
    """The strokes of one stream; smooth: minimum-jerk sweeps instead of a sine."""

    index: int
    smooth: bool = False

    def position(self, times: Array) -> Array:
        """Return the position of the finger (m) at `times` (s)."""
        turns = PACE_HZ * (1.0 + 0.2 * (self.index * GOLDEN % 1.0)) * times + self.index * GOLDEN
        if not self.smooth:
            return np.asarray(REACH * np.sin(2.0 * np.pi * turns))
        s = 2.0 * np.abs(turns % 1.0 - 0.5)
        return np.asarray(REACH * (2.0 * s**3 * (10.0 - 15.0 * s + 6.0 * s**2) - 1.0))

    def load(self, times: Array) -> Array:
        """Return the load (N) at `times` (s)."""
        return np.asarray(LOAD * (1.0 + LOAD_SWING * np.sin(2.0 * np.pi * (LOAD_HZ * times + self.index * GOLDEN))))


def scene(index: int, sample_rate: int) -> dict[str, Any]:
    """Return one of the scenes that streams use in turn; 0 is the default scene at the speed of these hands.

    Full scale is that of a scan at FASTEST, so that the limiter has little to do.
    """
    output = {"sample_rate": sample_rate}
    if index == 0:
        return {"scan": {"speed": FASTEST}, "output": output}
    share = index * GOLDEN % 1.0
    texture = {"period": round(0.5e-3 + 1.1e-3 * share, 6), "amplitude": round(30e-6 - 20e-6 * share, 7)}
    scan = {"speed": FASTEST, "load": round(0.2 + 0.4 * (1.0 - share), 3)}
    return {"texture": texture, "scan": scan, "output": output}
