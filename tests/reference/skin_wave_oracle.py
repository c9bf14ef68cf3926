"""The wave in the skin, slowly: its gain over frequency, and any motion at the place by Fourier transform.

Model   gain = W + B (1 - W). W: amplitude (r / R)^-(near + 0.2) times a resonance at 225 Hz that makes it (r / R)^-near
        there, late by (r - R) / c. B: a Butterworth low-pass of second order at `body` Hz, or 0. Within R: gain = 1.
Source  The same papers as the engine's `synth.voice.skin_wave`; written from the equations in docs/effects.md.
Limits  `travelled` takes the motion as zero before the first frame. Its frames are exact where the motion has no
        frequency above half the rate, but for the ringing of an end that is not zero, some hundred frames long.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.signal import butter, freqs, lfilter

Real = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]


@dataclass(frozen=True)
class Way:
    """From a contact of `radius` (m) to `distance` (m). `speed`: m/s. `near`: exponent at 225 Hz. `body`: Hz."""

    distance: float
    radius: float
    speed: float = 7.0
    near: float = 1.1
    body: float = 0.0

    def gain(self, hertz: Real) -> Complex:
        """Return the complex gain at each frequency."""
        if self.distance <= self.radius:
            return np.ones(len(hertz), complex)
        ratio, omega, best = self.distance / self.radius, 2.0 * np.pi * hertz, 2.0 * np.pi * 225.0
        top = [1.0, best * ratio**0.1, best**2]
        bottom = [1.0, best / ratio**0.1, best**2]
        _omega, shape = freqs(top, bottom, omega)
        wave = ratio ** -(self.near + 0.2) * shape
        wave = wave * np.exp(-1j * omega * (self.distance - self.radius) / self.speed)
        if not self.body:
            return np.asarray(wave)
        _omega, whole = freqs(*butter(2, 2.0 * np.pi * self.body, analog=True), omega)
        return np.asarray(whole + (1.0 - whole) * wave)

    def travelled(self, motion: Real, rate: float) -> Real:
        """Return `motion` [frames] at the place, for a motion that is zero before its first frame."""
        count = 4 * len(motion)
        gains = self.gain(np.asarray(np.fft.rfftfreq(count, 1.0 / rate), dtype=np.float64))
        spectrum = np.asarray(np.fft.rfft(motion, count), dtype=np.complex128)
        return np.asarray(np.fft.irfft(np.multiply(spectrum, gains), count)[: len(motion)])


def filtered(values: Real, first: int, taps: Real, wave: Real, body: Real) -> Real:
    """Return what the engine's filter makes of `values` from rest: the compiled loop's readable twin."""
    late = np.concatenate([np.zeros(first), np.convolve(values, taps)])[: len(values)]
    moved = lfilter(wave[:3], [1.0, *wave[3:]], late)
    return np.asarray(moved + lfilter(body[:3], [1.0, *body[3:]], values - moved))
