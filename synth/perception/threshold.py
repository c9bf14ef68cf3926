"""Detection thresholds: the smallest vibration that is felt at each frequency, by name.

Model   A threshold is the peak displacement of a steady sinusoid in dB re 1 um. It is piecewise linear over the
        logarithm of the frequency.
        `fingertip`: the lower of two lines. One falls by 5 dB per octave from 28 dB at 3 Hz (non-Pacinian). The other
        falls by 12 dB per octave to -18 dB at 250 Hz (Pacinian). Both rise by 10 dB per octave above 300 Hz.
        `probe`: 28 dB up to 30 Hz, -12 dB per octave up to 300 Hz, then 10 dB per octave.
        `pen`: 26 um at 10 Hz, -13 dB per octave up to 160 Hz, 0.06 um at 320 Hz, then 10 dB per octave.
Source  fingertip: 0.13 um at 300 Hz, Bolanowski et al. (1988), as cited by Israr et al. (2006).
        probe: Bolanowski et al. (1988), as cited by Tan et al. (1994), normal indentation with a surround.
        pen: Israr, Choi & Tan (2006), mean slope for a pen held in the hand.
        All rises of 10 dB, and the slopes of fingertip, are unverified defaults.
Limits  The thresholds are those of one observer's hand, for steady sinusoids. They do not depend on masking, contact
        area or force. Below 1 Hz no threshold is known, and the lines are extended.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

Array = np.ndarray[Any, np.dtype[np.floating[Any]]]
Levels = Callable[[Array], Array]

MICROMETRE = 1e-6
FAINTEST_DB = -120.0  # dB: a level below it is the rounding of numbers, and counts as no motion
MARGIN_DB = 6.0  # dB by which an imperceptible error stays below the threshold
DEFAULT = "fingertip"
LARGEST_LINE = 4.0 / math.pi  # largest harmonic of a signal bounded by 1: the fundamental of a square wave
RISE = 10.0  # dB per octave above the frequency of the lowest threshold; an unverified default


def _above(f: Array, corner: float) -> Array:
    """Return how many octaves `f` is above `corner`; 0 below it."""
    return np.asarray(np.maximum(np.log2(f / corner), 0.0))


def non_pacinian(f: Array) -> Array:
    """Return the line of `fingertip` that falls slowly, dB re 1 um."""
    slow = 28.0 - 5.0 * np.maximum(np.log2(np.minimum(f, 300.0) / 3.0), 0.0)
    return np.asarray(slow + RISE * _above(f, 300.0))


def pacinian(f: Array) -> Array:
    """Return the line of `fingertip` that falls fast, dB re 1 um."""
    fast = -18.0 + 12.0 * np.maximum(np.log2(250.0 / f), 0.0)
    return np.asarray(fast + RISE * _above(f, 300.0))


def _fingertip(f: Array) -> Array:
    return np.asarray(np.minimum(non_pacinian(f), pacinian(f)))


def _probe(f: Array) -> Array:
    return np.asarray(28.0 - 12.0 * _above(np.minimum(f, 300.0), 30.0) + RISE * _above(f, 300.0))


def _pen(f: Array) -> Array:
    first, lowest = 20.0 * math.log10(26.0), 20.0 * math.log10(0.06)
    at_160 = first - 13.0 * 4.0
    falling = first - 13.0 * _above(np.minimum(f, 160.0), 10.0)
    return np.asarray(falling + (lowest - at_160) * _above(np.minimum(f, 320.0), 160.0) + RISE * _above(f, 320.0))


THRESHOLDS: Mapping[str, Levels] = {"fingertip": _fingertip, "probe": _probe, "pen": _pen}
"""Functions from frequency (Hz) to dB re 1 um, by name. CONTRIBUTING.md lists where a new name must be added."""


def threshold_displacement(frequency_hz: Array, name: str = DEFAULT) -> Array:
    """Return the smallest peak displacement (m) that is felt at each frequency (Hz, above 0).

    Raises KeyError for an unknown name.
    """
    f = np.maximum(frequency_hz, 1e-9)
    return np.asarray(MICROMETRE * 10.0 ** (THRESHOLDS[name](f) / 20.0))


def imperceptible_tolerance(frequencies_hz: Array, order: int, extent: float, name: str = DEFAULT) -> float:
    """Return the tolerance at which no error is felt.

    frequencies_hz: frequencies at which the error can have components.
    order: order of the time derivative.
    extent: peak-to-peak of the quantity, SI.

    An error within a bound contains no sinusoid larger than LARGEST_LINE times the bound. The tolerance is the bound at
    which such a sinusoid is MARGIN_DB below the threshold at the worst of these frequencies, relative to the extent.
    """
    felt = threshold_displacement(frequencies_hz, name) * (2.0 * math.pi * frequencies_hz) ** order
    return 10.0 ** (-MARGIN_DB / 20.0) / LARGEST_LINE * float(np.min(felt)) / extent if extent > 0.0 else math.inf
