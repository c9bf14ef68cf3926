"""Stiffness, period and synthesis oracles against closed forms and brute force."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

from tests.reference.period_oracle import Real, refine, start_period
from tests.reference.sampled_baseline import sampled_signal
from tests.reference.stiffness_oracle import Touch, amplitude_of_roughness, contact_in_metres, stiffness
from tests.reference.synthesis_oracle import ORDERS, direct, highest_harmonic, mean_approach, synthesise

DEFAULT = Touch(contact_length=2.5e-3)
SPEED = 0.08


def test_the_groups_of_a_published_row_come_out() -> None:
    amplitudes = amplitude_of_roughness(20e-6), amplitude_of_roughness(10e-6)
    row = Touch(0.5, 10e-3, 0.5e-3, 1.0e-3, *amplitudes)
    groups = stiffness(row)
    assert groups.effective_modulus == pytest.approx(134.9e3, rel=1e-3)
    assert groups.half_width == pytest.approx(75e-6, rel=0.01)
    assert groups.k == pytest.approx(212e3, rel=0.01)
    assert pytest.approx(1.50, rel=0.01) == groups.W
    assert groups.w_star * groups.W == pytest.approx(0.5, rel=1e-12)
    assert groups.indentation == pytest.approx(0.5 / groups.k, rel=1e-12)
    heavier = stiffness(replace(row, load=2.0))
    assert pytest.approx(8 * groups.W, rel=1e-12) == heavier.W
    soft = stiffness(replace(row, texture_modulus=101.2e3))
    assert soft.effective_modulus == pytest.approx(groups.effective_modulus / 2, rel=1e-12)


def test_no_load_has_no_indentation_and_no_amplitude_is_refused() -> None:
    assert stiffness(replace(DEFAULT, load=0.0)).indentation == 0
    with pytest.raises(ValueError, match="flat"):
        stiffness(replace(DEFAULT, ridge_amplitude=0.0, texture_amplitude=0.0))


def test_the_approach_in_metres_has_the_slopes_of_its_own_differences() -> None:
    here = contact_in_metres(DEFAULT, 0.37)
    loads = np.array([0.3 * (1 - 1e-5), 0.3 * (1 + 1e-5)])
    z = contact_in_metres(DEFAULT, 0.37, loads).approach
    assert float((z[1] - z[0]) / (loads[1] - loads[0])) == pytest.approx(float(here.load_slope), rel=1e-6)
    turned = contact_in_metres(DEFAULT, np.array([0.37 - 1e-6, 0.37 + 1e-6])).approach
    assert float((turned[1] - turned[0]) / 2e-6) == pytest.approx(float(here.phase_slope), rel=1e-5)


def test_a_period_with_kinks_is_resolved_to_the_error_asked_for() -> None:
    def kinked(theta: Real) -> Real:
        return np.asarray(np.maximum(np.sin(2 * np.pi * theta) - 0.3, 0.0) ** 1.5)

    period = refine(start_period(kinked, 16), kinked, 1e-12)
    born, gone = np.arcsin(0.3) / (2 * np.pi), 0.5 - np.arcsin(0.3) / (2 * np.pi)
    spectrum = np.fft.rfft(period.dense(1 << 18)) / (1 << 18)
    for order in (0, 1, 7, 40):
        real, _ = quad(kinked, born, gone, weight="cos", wvar=2 * np.pi * order, epsabs=1e-14, limit=400)
        assert spectrum[order].real == pytest.approx(real, abs=1e-11)


def test_harmonics_agree_with_brute_force() -> None:
    spectrum = synthesise(DEFAULT, SPEED, 19200.0)
    points = 4096
    z = np.asarray(contact_in_metres(DEFAULT, np.arange(points) / points, dtype=np.float64).approach, dtype=float)
    brute = np.fft.rfft(z)[: spectrum.harmonics.size + 1] / points
    assert spectrum.mean == pytest.approx(brute[0].real, abs=3e-9 * np.ptp(z) + 2e-14)
    assert np.max(np.abs(spectrum.harmonics[:20] - brute[1:21])) < 1e-7 * np.ptp(z)
    assert spectrum.peak_to_peak("displacement") == pytest.approx(np.ptp(z), rel=1e-3)
    assert max(spectrum.error.values()) <= 1e-6


def test_the_stated_error_holds_against_a_closer_synthesis() -> None:
    rough = synthesise(DEFAULT, SPEED, 19200.0, relative_error=1e-4)
    fine = synthesise(DEFAULT, SPEED, 19200.0, relative_error=1e-8)
    theta = np.arange(8192) / 8192
    for quantity in ORDERS:
        difference = np.max(np.abs(rough.at_phase(quantity, theta) - fine.at_phase(quantity, theta)))
        assert difference <= rough.error[quantity] * fine.peak_to_peak(quantity)


def test_many_harmonics_approach_the_motion_itself() -> None:
    frames, rate = np.arange(500), 8000.0
    spectrum = synthesise(DEFAULT, 0.002, 1e9, n_max=512)
    motion = direct(DEFAULT, 0.002 * frames / rate, DEFAULT.load)
    assert np.max(np.abs(spectrum.signal("displacement", frames, rate) - motion)) < 1e-5 * np.ptp(motion)
    slope = np.asarray(contact_in_metres(DEFAULT, 0.3, dtype=np.float64).phase_slope, dtype=float)
    velocity = spectrum.at_phase("velocity", 0.3)
    assert float(velocity) == pytest.approx(float(slope) * spectrum.fundamental_hz, rel=1e-2)


def test_heavy_touch_is_one_sinusoid_with_the_closed_amplitude() -> None:
    heavy = replace(DEFAULT, load=60.0, contact_length=7.9e-3)
    spectrum = synthesise(heavy, -SPEED, 3200.0)
    amplitude = 20e-6 * abs(np.sinc(7.9e-3 / 0.8e-3))
    assert 2 * abs(spectrum.harmonics[0]) == pytest.approx(amplitude, rel=1e-9)
    assert np.max(np.abs(spectrum.harmonics[1:])) < 1e-9 * amplitude
    assert spectrum.peak("acceleration") == pytest.approx(amplitude * (2 * np.pi * 100) ** 2, rel=1e-3)


def test_moving_back_is_the_same_heights_backwards() -> None:
    forward = synthesise(DEFAULT, SPEED, 3200.0, relative_error=1e-4)
    back = synthesise(DEFAULT, -SPEED, 3200.0, relative_error=1e-4)
    frames = np.arange(300)
    for quantity, sign in (("displacement", 1), ("velocity", -1), ("acceleration", 1)):
        returned = sign * forward.signal(quantity, -frames, 48000.0)
        assert np.max(np.abs(back.signal(quantity, frames, 48000.0) - returned)) < 1e-12 * np.ptp(returned)


def test_frames_a_day_away_keep_their_phase() -> None:
    spectrum = synthesise(DEFAULT, SPEED, 3200.0, relative_error=1e-4)
    later = 480 * 8_640_000 + np.arange(480)  # 100 Hz at 48 kHz: 480 frames a period, but for u and lambda2 in binary
    drift = float(np.longdouble(later[0]) * np.longdouble(SPEED) / (np.longdouble(0.8e-3) * 48000) - 8_640_000)
    near = spectrum.at_phase("velocity", np.arange(480) / 480 + drift)
    assert np.max(np.abs(spectrum.signal("velocity", later, 48000.0) - near)) < 1e-10 * np.ptp(near)


@pytest.mark.parametrize(
    ("speed", "limit", "highest"), [(0.08, 19200.0, 191), (0.08, 19201.0, 192), (0.0, 100.0, 4096), (8.0, 3200.0, 0)]
)
def test_the_limit_keeps_harmonics_below_it(speed: float, limit: float, highest: int) -> None:
    assert highest_harmonic(-speed, 2.0**-10 * 0.8192, limit) == highest


def test_nothing_moves_without_texture_or_speed() -> None:
    flat = synthesise(replace(DEFAULT, texture_amplitude=0.0), SPEED, 19200.0)
    assert np.all(flat.signal("acceleration", np.arange(10), 48000.0) == 0)
    still = synthesise(DEFAULT, 0.0, 19200.0, n_max=64, relative_error=1e-3)
    assert np.all(still.signal("velocity", np.arange(10), 48000.0) == 0)
    assert np.ptp(still.signal("displacement", np.arange(10), 48000.0)) == 0


def test_the_mean_at_many_loads_is_interpolated_closely() -> None:
    loads = np.linspace(0.05, 1.8, 200)
    means = mean_approach(DEFAULT, loads, phases=64)
    picked = [0, 7, 63, 77, 130, 199]
    solved = mean_approach(DEFAULT, loads[picked], phases=64)
    assert np.max(np.abs(means[picked] - solved)) < 1e-5 * 60e-6


def test_the_sampled_baseline_renders_roughly_the_same_motion() -> None:
    sampled = sampled_signal(DEFAULT, SPEED, 8000.0, 80, points_per_ridge=100)
    exact = direct(DEFAULT, SPEED * np.arange(80) / 8000.0, DEFAULT.load)
    difference = sampled - (exact - exact.mean())
    assert np.max(np.abs(difference)) < 0.02 * np.ptp(exact)
