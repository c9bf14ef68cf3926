"""A level's coefficients over place: a periodic quintic spline whose harmonics are exactly those that it is made of.

Stage   RESPONSE, one level of a table.
Model   s(theta) = sum over i of c_i B(P theta - i), B the centred B-spline of degree 5, has at the harmonic n the size
        C_n sinc(n / P)^6, C_n that of the coefficients. So C_n = Z_n / sinc(n / P)^6 makes harmonics 1 to N exact.
Source  Unser, Splines: a perfect fit for signal and image processing (1999).
Limits  images stand at P - n, (n / (P - n))^6 as strong: 1e-4 of the highest harmonic with 5.5 places a harmonic, 2e-3
        of it in acceleration, most of which the reading filter takes off.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from synth.arrays import Array
from synth.response.spectrum import Complex

TAPS = 6  # coefficients that make a value
FIRST = 2  # of them stand before the cell that a place is in
PADDING = 8  # coefficients repeated at the end of a period, so that a reader need not wrap round


def spline_coefficients(harmonics: Complex, highest: int, places: int) -> Array:
    """Return the coefficients [rows, places] of the series [rows, more than highest], without their mean."""
    series = np.zeros((len(harmonics), places // 2 + 1), dtype=np.complex128)
    n = np.arange(1, highest + 1)
    series[:, 1 : highest + 1] = harmonics[:, 1 : highest + 1] / np.sinc(n / places) ** TAPS
    return np.asarray(np.fft.irfft(series, places, axis=1) * places)


def padded(coefficients: Any) -> Any:
    """Return coefficients [..., places + PADDING], the i-th that of place i - FIRST: where the taps of cell i begin."""
    places = coefficients.shape[-1]
    return coefficients[..., (np.arange(places + PADDING) - FIRST) % places]
