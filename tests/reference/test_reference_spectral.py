"""The alias meter measures an alias, and measures nothing where there is none."""

from __future__ import annotations

import numpy as np
import pytest

from tests.reference.spectral_checks import HarmonicFit, alias_residue, fit_harmonics, fold_distance, limited

CASES = [(48000.0, 103.7, 24000), (8000.0, 61.3, 8000), (44100.0, 41.03, 44100), (48000.0, 1234.5, 4800)]


def harmonic_signal(rate: float, fundamental: float, share: float) -> HarmonicFit:
    """Harmonics below ``share`` of the rate with amplitudes n^-1/2 and random phases, and a mean."""
    random = np.random.default_rng(3)
    order = np.arange(1, int(share * rate / fundamental) + 1)
    coefficients = order**-0.5 * np.exp(2j * np.pi * random.uniform(size=order.size))
    return HarmonicFit(np.concatenate([[0.3], coefficients]), fundamental, rate)


@pytest.mark.parametrize(("rate", "fundamental", "frames"), CASES)
def test_true_harmonics_leave_nothing(rate: float, fundamental: float, frames: int) -> None:
    signal = harmonic_signal(rate, fundamental, 0.45).signal(np.arange(frames), mean=True)
    assert alias_residue(signal, rate, fundamental).relative_peak < 1e-12
    rounded = alias_residue(signal.astype(np.float32), rate, fundamental)
    assert rounded.relative_peak < 6e-8


@pytest.mark.parametrize(("rate", "fundamental", "frames"), CASES)
def test_an_alias_is_measured_where_it_stands(rate: float, fundamental: float, frames: int) -> None:
    assert fold_distance(rate, fundamental, frames) > 6
    signal = harmonic_signal(rate, fundamental, 0.45).signal(np.arange(frames), mean=True)
    order = round(0.62 * rate / fundamental)
    folded = rate - order * fundamental
    alias = 1e-6 * np.ptp(signal) * np.cos(2 * np.pi * order * fundamental / rate * np.arange(frames))
    residue = alias_residue(signal + alias, rate, -fundamental)
    assert residue.relative_peak == pytest.approx(1e-6, rel=0.02)
    assert residue.strongest_hz == pytest.approx(folded, abs=1.5 * rate / frames)
    assert residue.energy_share == pytest.approx(np.var(alias) / np.var(signal), rel=0.02)


@pytest.mark.parametrize(("rate", "fundamental", "frames"), CASES)
def test_limiting_keeps_what_is_below_and_drops_what_is_above(rate: float, fundamental: float, frames: int) -> None:
    fit = harmonic_signal(rate, fundamental, 0.47)
    place = np.arange(frames)
    kept = limited(fit.signal(place, mean=True), rate, fundamental)
    assert np.max(np.abs(kept - fit.signal(place, 0.40 * rate))) < 1e-11 * np.ptp(kept)


def test_coefficients_come_back() -> None:
    fit = harmonic_signal(8000.0, 61.3, 0.4)
    found = fit_harmonics(fit.signal(np.arange(4000), mean=True), 8000.0, 61.3, 0.45 * 8000)
    assert np.max(np.abs(found.coefficients[: fit.coefficients.size] - fit.coefficients)) < 1e-12
    assert np.max(np.abs(found.coefficients[fit.coefficients.size :])) < 1e-12


def test_silence_is_silence() -> None:
    residue = alias_residue(np.zeros(4000), 8000.0, 61.3)
    assert (residue.peak, residue.rms, residue.relative_peak, residue.energy_share) == (0, 0, 0, 0)


def test_what_cannot_be_told_apart_is_refused() -> None:
    with pytest.raises(ValueError, match="periods"):
        fit_harmonics(np.zeros(100), 8000.0, 61.3, 3600.0)
    with pytest.raises(ValueError, match="images"):
        fit_harmonics(np.zeros(4000), 8000.0, 63.49, 3999.99)
    assert fold_distance(48000.0, 100.0, 48000) == pytest.approx(0, abs=1e-9)
