"""The smallest vibration that a fingertip feels: detection thresholds over frequency, by name.

Model   Peak displacement of a steady sinusoid in dB re 1 um, in straight lines over the logarithm of the frequency.
        `fingertip`: the lower of a line of -5 dB an octave from 28 dB at 3 Hz (non-Pacinian) and of one of -12 dB an
        octave to -18 dB at 250 Hz (Pacinian); both rise by 10 dB an octave above 300 Hz. `probe`: 28 dB up to 30 Hz,
        -12 dB an octave to 300 Hz, then 10 dB an octave. `pen`: 26 um at 10 Hz, -13 dB an octave to 160 Hz, 0.06 um at
        320 Hz, then 10 dB an octave.
Source  fingertip: 0.13 um at 300 Hz, Bolanowski et al. (1988), as cited by Israr et al. (2006). probe: Bolanowski et
        al. (1988), as cited by Tan et al. (1994), normal indentation with a surround. pen: Israr, Choi & Tan (2006),
        mean slope for a pen held in the hand. All rises of 10 dB, and the slopes of fingertip, are unverified defaults.
Limits  one observer's hand, steady sinusoids; masking, contact area and force are left out. Below 1 Hz nothing is
        known: the lines go on.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

Array = np.ndarray[Any, np.dtype[np.floating[Any]]]
Levels = Callable[[Array], Array]

MICROMETRE = 1e-6
MARGIN_DB = 6.0  # dB by which an imperceptible error stays below the threshold
DEFAULT = "fingertip"
LARGEST_LINE = 4.0 / math.pi  # of the bound of a periodic signal: the fundamental of a square wave
RISE = 10.0  # dB an octave above the frequency of the lowest threshold; an unverified default


def _above(f: Array, corner: float) -> Array:
    """Return the octaves of `f` above `corner`, 0 below it."""
    return np.asarray(np.maximum(np.log2(f / corner), 0.0))


def _fingertip(f: Array) -> Array:
    slow = 28.0 - 5.0 * np.maximum(np.log2(np.minimum(f, 300.0) / 3.0), 0.0)
    fast = -18.0 + 12.0 * np.maximum(np.log2(250.0 / f), 0.0)
    return np.asarray(np.minimum(slow, fast) + RISE * _above(f, 300.0))


def _probe(f: Array) -> Array:
    return np.asarray(28.0 - 12.0 * _above(np.minimum(f, 300.0), 30.0) + RISE * _above(f, 300.0))


def _pen(f: Array) -> Array:
    first, lowest = 20.0 * math.log10(26.0), 20.0 * math.log10(0.06)
    at_160 = first - 13.0 * 4.0
    falling = first - 13.0 * _above(np.minimum(f, 160.0), 10.0)
    return np.asarray(falling + (lowest - at_160) * _above(np.minimum(f, 320.0), 160.0) + RISE * _above(f, 320.0))


THRESHOLDS: Mapping[str, Levels] = {"fingertip": _fingertip, "probe": _probe, "pen": _pen}
"""dB re 1 um over the frequency (Hz), by name; the sources are above. A new curve is a line here and in the scene."""


def threshold_displacement(frequency_hz: Array, name: str = DEFAULT) -> Array:
    """Return the smallest peak displacement (m) that is felt at each frequency (Hz, above 0); KeyError for a name."""
    f = np.maximum(frequency_hz, 1e-9)
    return np.asarray(MICROMETRE * 10.0 ** (THRESHOLDS[name](f) / 20.0))


def imperceptible_tolerance(frequencies_hz: Array, order: int, extent: float, name: str = DEFAULT) -> float:
    """Return the tolerance at which no error is felt.

    frequencies_hz: where error may stand. order: time derivative of the quantity. extent: its peak-to-peak (SI).
    An error within a bound holds no sinusoid larger than LARGEST_LINE times that bound; at the worst of these
    frequencies it still stays MARGIN_DB below the threshold.
    """
    felt = threshold_displacement(frequencies_hz, name) * (2.0 * math.pi * frequencies_hz) ** order
    return 10.0 ** (-MARGIN_DB / 20.0) / LARGEST_LINE * float(np.min(felt)) / extent if extent > 0.0 else math.inf
