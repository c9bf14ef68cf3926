"""Masking: which components of a vibration are felt beside stronger ones.

Model   A component of the level H (dB) at f0 (Hz) raises the threshold at f to
            H - 5 + 5 / 1400 f0 - 30 ((f - f0) / f0)^2.
        The powers of the threshold and of the masks of all other components add up. A component is felt if it is above
        the sum. Components more than RANGE below the strongest one mask nothing.
Source  The formula and RANGE: the psychohaptic model of the MPEG haptics reference software (ISO/IEC 23090-31).
Limits  Levels there are those of a digital signal; here they are displacements, as of the thresholds. A component does
        not mask itself. One channel does not mask another.
"""

from __future__ import annotations

import numpy as np

from synth.arrays import Array

RANGE = 45.0  # dB
BELOW, RISE, FALL = 5.0, 5.0 / 1400.0, 30.0  # dB; dB/Hz; dB for a distance of f0
MOST = 4096  # strongest components that are looked at, which bounds the time


def mask_of(level: Array, masker: Array, frequency: Array) -> Array:
    """Return the raised threshold (dB) at each frequency [frequencies, maskers] by each masker.

    level: of the maskers, dB. masker: their frequencies, Hz. frequency: Hz.
    """
    away = (np.asarray(frequency)[:, np.newaxis] - masker) / masker
    return np.asarray(level - BELOW + RISE * masker - FALL * away**2)


def unmasked(frequency: Array, level: Array, threshold: Array) -> int:
    """Return how many components are felt.

    frequency: Hz, above 0. level, threshold: dB of the same reference.
    """
    strong = np.flatnonzero(level > threshold)
    if not len(strong):
        return 0
    strong = strong[np.argsort(level[strong])[::-1][:MOST]]
    f, h = frequency[strong], level[strong]
    maskers = np.flatnonzero(h >= h[0] - RANGE)
    masks = mask_of(h[maskers], f[maskers], f)
    masks[maskers, np.arange(len(maskers))] = -np.inf  # not of itself
    raised = 10.0 ** (threshold[strong] / 10.0) + np.sum(10.0 ** (masks / 10.0), axis=1)
    return int(np.count_nonzero(h > 10.0 * np.log10(raised)))
