"""The harmonics of a rendered periodic signal, and the rest of the signal: aliases.

Model   signal[k] = sum over n of c_n exp(2 pi i n f0 k / rate) + residue.
Method  Least squares under a Kaiser window. The normal equations are Toeplitz, so thousands of harmonics over any
        length of signal are solved exactly, also where the period is not a whole number of frames.
Limits  Floor: a float64 signal of true harmonics leaves less than 1e-12 of its peak-to-peak; a float32 signal leaves
        its rounding, 3e-8 of its peak. The fit needs WINDOW_PERIODS periods of f0. Where rate / f0 is close to a whole
        number, the aliases coincide with true harmonics and cannot be measured: check with ``fold_distance``, and
        choose a different speed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.linalg import solve_toeplitz

Real = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]

#: Shape of the Kaiser window; its main lobe is 5.2 / duration wide to each side, its side lobes are below 1e-6.
KAISER_BETA = 16.0
#: Required periods of f0 in a signal, so that neighbouring harmonics lie outside each other's main lobe.
WINDOW_PERIODS = 6.0
#: Share of the rate up to which true harmonics are fitted before some of them are kept.
FITTED_SHARE = 0.495
_RESYNC = 32


@dataclass(frozen=True)
class HarmonicFit:
    """``coefficients[n]`` = c_n, n = 0 the mean; c_-n is its conjugate."""

    coefficients: Complex
    fundamental_hz: float
    rate_hz: float

    def signal(self, frames: npt.ArrayLike, below_hz: float = np.inf, mean: bool = False) -> Real:
        """The fitted harmonics n >= 1 with n f0 < below_hz at frame numbers ``frames`` (and c_0 if ``mean``)."""
        turns = _turns(np.asarray(frames), self.fundamental_hz, self.rate_hz)
        order = np.arange(1, self.coefficients.size)
        kept = int(np.count_nonzero(order * self.fundamental_hz < below_hz))
        turn = np.exp(2j * np.pi * turns)
        total = np.zeros_like(turn)
        for coefficient in self.coefficients[kept:0:-1]:
            total = (total + coefficient) * turn
        return np.asarray(2 * total.real + (self.coefficients[0].real if mean else 0.0))


@dataclass(frozen=True)
class AliasResidue:
    """The rest of a signal without its true harmonics, over the middle half.

    ``peak`` and ``rms`` in the unit of the signal; ``relative_peak`` to its peak-to-peak; ``energy_share`` of its
    variance; ``strongest_hz`` the frequency at which the residue's spectrum is highest.
    """

    peak: float
    rms: float
    relative_peak: float
    energy_share: float
    strongest_hz: float


def fit_harmonics(signal: npt.ArrayLike, rate_hz: float, fundamental_hz: float, below_hz: float) -> HarmonicFit:
    """Least-squares harmonics of ``fundamental_hz`` (its sign is ignored) below ``below_hz`` and the mean.

    ``signal`` [frames], frame 0 first. ValueError when it has fewer than WINDOW_PERIODS periods, or when the highest
    harmonic is closer to its own image about half the rate than the window can separate.
    """
    samples = np.asarray(signal, dtype=float)
    fundamental = abs(fundamental_hz)
    if not fundamental * samples.size / rate_hz >= WINDOW_PERIODS:
        raise ValueError(f"at least {WINDOW_PERIODS} periods of {fundamental} Hz are needed")
    count = int(np.ceil(below_hz / fundamental)) - 1
    if not rate_hz - 2 * count * fundamental >= WINDOW_PERIODS * rate_hz / samples.size:
        raise ValueError(f"harmonics up to {below_hz} Hz cannot be told from their images at a rate of {rate_hz} Hz")
    window = np.kaiser(samples.size, KAISER_BETA)
    turns = _turns(np.arange(samples.size), fundamental, rate_hz)
    gram, right = _projections(turns, window, window * samples, 2 * count, count)
    solved = solve_toeplitz((gram, gram.conj()), np.concatenate([right[:0:-1].conj(), right]))
    return HarmonicFit(solved[count:], fundamental, rate_hz)


def limited(signal: npt.ArrayLike, rate_hz: float, fundamental_hz: float, limit_hz: float | None = None) -> Real:
    """A rendered periodic signal [frames] cut to its harmonics below ``limit_hz`` (0.40 of the rate), without its mean.

    All harmonics below FITTED_SHARE of the rate are fitted together, so that the removed ones do not affect the others.
    """
    samples = np.asarray(signal, dtype=float)
    fit = fit_harmonics(samples, rate_hz, fundamental_hz, FITTED_SHARE * rate_hz)
    return fit.signal(np.arange(samples.size), 0.40 * rate_hz if limit_hz is None else limit_hz)


def alias_residue(
    signal: npt.ArrayLike, rate_hz: float, fundamental_hz: float, limit_hz: float | None = None
) -> AliasResidue:
    """The rest of a steady render without its mean and its true harmonics below ``limit_hz`` (0.45 of the rate).

    The fit's own floor is 1e-12 of the peak-to-peak. ValueError as ``fit_harmonics``.
    """
    samples = np.asarray(signal, dtype=float)
    below = 0.45 * rate_hz if limit_hz is None else limit_hz
    fit = fit_harmonics(samples, rate_hz, fundamental_hz, below)
    residue = samples - fit.signal(np.arange(samples.size), mean=True)
    middle = slice(samples.size // 4, samples.size - samples.size // 4)
    peak = float(np.max(np.abs(residue[middle])))
    rms = float(np.sqrt(np.mean(residue[middle] ** 2)))
    swing, variance = float(np.ptp(samples)), float(np.var(samples))
    spectrum = np.abs(np.fft.rfft(residue * np.kaiser(samples.size, KAISER_BETA)))
    return AliasResidue(
        peak=peak,
        rms=rms,
        relative_peak=peak / swing if swing > 0 else 0.0,
        energy_share=rms**2 / variance if variance > 0 else 0.0,
        strongest_hz=float(np.argmax(spectrum)) * rate_hz / samples.size,
    )


def fold_distance(rate_hz: float, fundamental_hz: float, frames: int) -> float:
    """Distance of the harmonics folded once from the true ones, in bins of rate / frames; above 6 the fit works."""
    periods = rate_hz / abs(fundamental_hz)
    return abs(periods - round(periods)) * abs(fundamental_hz) * frames / rate_hz


def _turns(frames: npt.NDArray[np.int_], fundamental_hz: float, rate_hz: float) -> Real:
    """Phase of the fundamental in turns within [-1/2, 1/2], from extended precision."""
    turns = frames * (np.longdouble(fundamental_hz) / np.longdouble(rate_hz))
    return np.asarray(turns - np.rint(turns), dtype=float)


def _projections(turns: Real, window: Real, weighted: Real, window_count: int, count: int) -> tuple[Complex, Complex]:
    """Sums of window and weighted signal against exp(-2 pi i n turns), n from 0 to their counts, inclusive."""
    gram = np.empty(window_count + 1, complex)
    right = np.empty(count + 1, complex)
    turn = np.exp(-2j * np.pi * turns)
    for order in range(window_count + 1):
        if order % _RESYNC == 0:
            wave = np.exp(-2j * np.pi * (order * turns - np.rint(order * turns)))
        gram[order] = np.einsum("k,k->", window, wave)  # not BLAS, whose threads are slow on a busy machine
        if order <= count:
            right[order] = np.einsum("k,k->", weighted, wave)
        wave *= turn
    return gram, right
