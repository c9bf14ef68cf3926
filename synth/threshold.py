"""The smallest vibration that a fingertip feels: the detection threshold over frequency.

Model   Peak displacement in dB re 1 um: 28 dB up to 3 Hz, then falling 5 dB an octave to 300 Hz (non-Pacinian), or
        -18 dB at 250 to 300 Hz with 12 dB an octave below (Pacinian), whichever is lower; both rise 10 dB an octave
        above 300 Hz.
Source  minimum of 0.13 um at 300 Hz: Bolanowski et al. (1988), as cited by Israr et al. (2006). The slopes and the
        non-Pacinian part are an unverified default.
Limits  one observer's fingertip, steady sinusoids; masking and contact force are left out.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

Array = np.ndarray[Any, np.dtype[np.floating[Any]]]

MICROMETRE = 1e-6
MARGIN = 0.5  # the error stays 6 dB below the threshold


def threshold_displacement(frequency_hz: Array) -> Array:
    """Return the smallest peak displacement (m) that is felt at each frequency (Hz, above 0)."""
    f = np.maximum(frequency_hz, 1e-9)
    above = 10.0 * np.maximum(np.log2(f / 300.0), 0.0)
    slow = 28.0 - 5.0 * np.maximum(np.log2(np.minimum(f, 300.0) / 3.0), 0.0) + above
    fast = -18.0 + 12.0 * np.maximum(np.log2(250.0 / f), 0.0) + above
    return np.asarray(MICROMETRE * 10.0 ** (np.minimum(slow, fast) / 20.0))


def imperceptible_tolerance(frequencies_hz: Array, order: int, extent: float) -> float:
    """Return the tolerance at which no error is felt.

    frequencies_hz: where error may stand. order: time derivative of the quantity. extent: its peak-to-peak (SI).
    The whole error, were it all at the worst of these frequencies, stays MARGIN below the threshold there.
    """
    felt = threshold_displacement(frequencies_hz) * (2.0 * math.pi * frequencies_hz) ** order
    return MARGIN * float(np.min(felt)) / extent if extent > 0.0 else math.inf
