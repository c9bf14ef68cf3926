"""The exact band-limited output of steady scanning: the samples of a perfect render.

Model   z(t) = Z(theta), theta = u t / lambda2, of eqs 1, 2, 4, 5. Displacement is relative to its mean over a texture
        period; velocity and acceleration are its time derivatives. All are limited to harmonics n of f0 = |u| / lambda2
        with n f0 < limit_hz and n <= n_max.
Source  Fagiani & Barbieri 2016; the limits are those of the design's section "What the samples are".
Method  ``period_oracle`` resolves a period over the float64 contact oracle. The period is sampled at 256 points or more
        per harmonic and transformed. Panels are refined and samples doubled until every quantity changes by less than
        the required error. ``error`` is the last change, relative to the quantity's peak-to-peak.
Limits  Fixed point: round-off of the solver, about 3e-16 (a1 + a2) per harmonic; ``error`` is larger where this is met.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline

from tests.reference.period_oracle import Period, Real, Response, refine, start_period
from tests.reference.stiffness_oracle import Touch, contact_in_metres

Complex = npt.NDArray[np.complex128]

#: Time derivatives of each quantity.
ORDERS = {"displacement": 0, "velocity": 1, "acceleration": 2}
#: First samples of the period per kept harmonic; folding falls with the 2.5th power of their number.
SAMPLES_PER_HARMONIC = 256
#: Points per shortest period in the search for peaks; the peak-to-peak is then low by 0.03 % at most.
PEAK_OVERSAMPLING = 128
#: The coefficients' tolerance, relative to a1 + a2: first, factor from round to round, and last.
FIRST_TOLERANCE, TIGHTEN, LAST_TOLERANCE = 1e-6, 1 / 30, 3e-16
#: Loads beyond which ``direct`` interpolates the mean over a period instead of solving it at each.
MEANS_SOLVED = 160


@dataclass(frozen=True)
class SteadySpectrum:
    """Harmonics of z in metres, ``harmonics[n - 1]`` = Z_n of Z = sum over n of Z_n exp(2 pi i n theta).

    ``mean`` in m; ``speed`` m/s; ``period`` m; ``error``: per quantity, largest change of the signal in the last
    refinement over its peak-to-peak (0 for a quantity that does not move).
    """

    harmonics: Complex
    mean: float
    speed: float
    period: float
    error: dict[str, float]

    @property
    def fundamental_hz(self) -> float:
        """Signed f0 = u / lambda2: negative when the surface moves backwards."""
        return self.speed / self.period

    def spectrum(self, quantity: str) -> Complex:
        """Harmonics of ``quantity`` in SI, n = 1, 2, ... KeyError names an unknown quantity."""
        order = np.arange(1, self.harmonics.size + 1)
        return np.asarray(self.harmonics * (2j * np.pi * self.fundamental_hz * order) ** ORDERS[quantity])

    def signal(self, quantity: str, frames: npt.ArrayLike, rate_hz: float) -> Real:
        """Values in SI at the frame numbers ``frames`` (any shape; frame 0 is t = 0 of eq. 2)."""
        turns = np.asarray(frames, dtype=np.longdouble) * np.longdouble(self.speed)
        turns = turns / (np.longdouble(self.period) * np.longdouble(rate_hz))
        return self.at_phase(quantity, np.asarray(turns - np.rint(turns), dtype=float))

    def at_phase(self, quantity: str, theta: npt.ArrayLike) -> Real:
        """Values in SI at phases in turns, summed by Horner's rule in exp(2 pi i theta)."""
        turn = np.exp(2j * np.pi * np.asarray(theta, dtype=float))
        total = np.zeros_like(turn)
        for coefficient in self.spectrum(quantity)[::-1]:
            total = (total + coefficient) * turn
        return np.asarray(2 * total.real)

    def peak_to_peak(self, quantity: str) -> float:
        """Peak-to-peak of the band-limited periodic signal, low by 0.03 % at most."""
        return float(np.ptp(_one_period(self.spectrum(quantity))))

    def peak(self, quantity: str) -> float:
        """Largest magnitude of the band-limited periodic signal, low by 0.03 % at most."""
        return float(np.max(np.abs(_one_period(self.spectrum(quantity)))))


def highest_harmonic(speed: float, period: float, limit_hz: float, n_max: int = 4096) -> int:
    """Largest n with n |u| / lambda2 < limit_hz and n <= n_max; n_max when nothing moves, 0 when f0 is too high."""
    fundamental = abs(speed) / period
    if fundamental * (n_max + 1) < limit_hz:
        return n_max
    highest = min(n_max, int(limit_hz / fundamental) + 1)
    while highest > 0 and not highest * fundamental < limit_hz:
        highest -= 1
    return highest


def synthesise(
    touch: Touch, speed: float, limit_hz: float, n_max: int = 4096, relative_error: float = 1e-6
) -> SteadySpectrum:
    """The exact spectrum of steady scanning at ``speed`` (m/s, signed), to ``relative_error`` of each peak-to-peak.

    Only round-off (LAST_TOLERANCE) stops it earlier; ``error`` of the result is the error that was reached.
    """
    count = highest_harmonic(speed, touch.texture_period, limit_hz, n_max)
    tall = touch.ridge_amplitude + touch.texture_amplitude
    response = response_in_metres(touch)
    if touch.texture_amplitude == 0:
        level = float(response(np.zeros(1))[0]) if tall > 0 else 0.0
        return SteadySpectrum(np.zeros(count, complex), level, speed, touch.texture_period, dict.fromkeys(ORDERS, 0.0))
    period = start_period(response)
    tolerance, samples = FIRST_TOLERANCE, _power_of_two(SAMPLES_PER_HARMONIC * max(count, 64))
    period = refine(period, response, tolerance * tall)
    harmonics, mean = _transform(period, samples, count)
    while True:
        tolerance, samples = tolerance * TIGHTEN, min(2 * samples, 1 << 21)
        period = refine(period, response, tolerance * tall)
        better, mean = _transform(period, samples, count)
        error = _movement(harmonics, better)
        harmonics = better
        if max(error.values()) <= relative_error or tolerance <= LAST_TOLERANCE:
            return SteadySpectrum(harmonics, mean, speed, touch.texture_period, error)


def response_in_metres(touch: Touch) -> Response:
    """Z in metres as a function of phase, by the float64 contact oracle."""

    def response(theta: Real) -> Real:
        return np.asarray(contact_in_metres(touch, theta, dtype=np.float64).approach, dtype=float)

    return response


def direct(touch: Touch, position: npt.ArrayLike, load: npt.ArrayLike, mean_phases: int = 512) -> Real:
    """z(p, w) minus its mean over a texture period at that load, in metres and without any band limit.

    ``position`` (m, of the surface along the finger, p = u t) and ``load`` (N) broadcast. The mean is taken over
    ``mean_phases`` phases at each load (error 3e-8 (a1 + a2) on the default scene). For more than MEANS_SOLVED
    different loads, it is a spline in w^(1/3) through MEANS_SOLVED of them (error 2e-7 (a1 + a2)).
    """
    places, loads = np.broadcast_arrays(np.asarray(position, dtype=np.longdouble), np.asarray(load, dtype=float))
    contact = contact_in_metres(touch, places / np.longdouble(touch.texture_period), loads, dtype=np.float64)
    return np.asarray(contact.approach, dtype=float) - mean_approach(touch, loads, mean_phases)


def mean_approach(touch: Touch, loads: npt.ArrayLike, phases: int = 512) -> Real:
    """Mean of z over a texture period at each load (N), in metres, by the same rules as ``direct``."""
    wanted = np.asarray(loads, dtype=float)
    different: Real = np.unique(wanted)
    if different.size <= MEANS_SOLVED:
        return _means(touch, different, phases)[np.searchsorted(different, wanted)]
    roots = np.linspace(np.cbrt(different[0]), np.cbrt(different[-1]), MEANS_SOLVED)
    return np.asarray(CubicSpline(roots, _means(touch, roots**3, phases))(np.cbrt(wanted)))


def _means(touch: Touch, loads: Real, phases: int) -> Real:
    theta = np.arange(phases) / phases
    solved = contact_in_metres(touch, theta[None, :], loads[:, None], dtype=np.float64)
    return np.asarray(solved.approach.mean(axis=1), dtype=float)


def _transform(period: Period, samples: int, count: int) -> tuple[Complex, float]:
    """Harmonics 1 .. count and the mean of a resolved period, from ``samples`` values of it."""
    spectrum = np.fft.rfft(period.dense(samples)) / samples
    return spectrum[1 : count + 1], float(spectrum[0].real)


def _movement(before: Complex, after: Complex) -> dict[str, float]:
    """Per quantity, largest difference of the two signals over the peak-to-peak of the second (0 without motion)."""
    order = np.arange(1, after.size + 1)
    moved = {}
    for quantity, derivatives in ORDERS.items():
        weight = (1j * order) ** derivatives
        swing = np.ptp(_one_period(after * weight))
        moved[quantity] = float(np.max(np.abs(_one_period((after - before) * weight))) / swing) if swing > 0 else 0.0
    return moved


def _one_period(harmonics: Complex) -> Real:
    """The real signal of these harmonics at PEAK_OVERSAMPLING points per shortest period."""
    if harmonics.size == 0:
        return np.zeros(1)
    points = _power_of_two(PEAK_OVERSAMPLING * harmonics.size)
    return np.asarray(np.fft.irfft(np.concatenate([[0.0], harmonics]), points) * points)


def _power_of_two(number: int) -> int:
    return 1 << (number - 1).bit_length()
