"""The numbers beside a sound: peak, RMS, largest step, spectral centroid."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

HEADER = f"{'channel':14} {'full scale':>12} {'peak':>8} {'rms':>8} {'step':>8} {'centroid':>10}"


@dataclass(frozen=True, slots=True)
class Numbers:
    """peak, rms, step (the largest change from frame to frame): parts of full scale. centroid: Hz, 0 of silence."""

    peak: float
    rms: float
    step: float
    centroid: float


def numbers(samples: npt.NDArray[Any], rate: int) -> Numbers:
    """Return the numbers of one channel [frames], at least two frames."""
    values = np.asarray(samples, dtype=np.float64)
    power = np.abs(np.fft.rfft(values * np.hanning(len(values)))) ** 2
    frequencies = np.fft.rfftfreq(len(values), 1.0 / rate)
    total = float(power.sum())
    return Numbers(
        peak=float(np.max(np.abs(values))),
        rms=float(np.sqrt(np.mean(values**2))),
        step=float(np.max(np.abs(np.diff(values)))),
        centroid=float(frequencies @ power) / total if total > 0.0 else 0.0,
    )


def line(quantity: str, full_scale: float, unit: str, found: Numbers) -> str:
    """Return a channel's line of the report."""
    scale = f"{full_scale:.4g} {unit}"
    return f"{quantity:14} {scale:>12} {found.peak:8.4f} {found.rms:8.4f} {found.step:8.4f} {found.centroid:7.0f} Hz"
