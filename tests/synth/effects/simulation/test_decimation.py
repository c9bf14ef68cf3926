"""From steps to frames: the pass band is kept with its derivatives, the stop band is gone, and rest is exact."""

from __future__ import annotations

import numpy as np
import pytest

from synth.arrays import Array
from synth.effects.simulation.decimation import Decimator

RATE = 48000
FRAMES = 60
BANDS = [(2, 80.0, (0.40, 0.45)), (3, 100.0, (0.35, 0.49)), (12, 110.0, (0.40, 0.45)), (2, 90.0, (0.02, 0.03))]

every = pytest.mark.parametrize(("steps", "attenuation", "band"), BANDS)


def read(filters: Decimator, frequency: float, row: int) -> tuple[Array, Array]:
    """Return frames of a complex oscillation (cycles a frame), and what its derivative is there."""
    count = (FRAMES - 1 + 2 * filters.margin) * filters.steps + 1
    n = np.arange(count) / filters.steps - filters.margin
    y = np.exp(2j * np.pi * frequency * n)
    parts = [filters.read(np.ascontiguousarray(part), row, FRAMES) for part in (y.real, y.imag)]
    order = filters.orders[row]
    wanted = (2j * np.pi * frequency * RATE) ** order * np.exp(2j * np.pi * frequency * np.arange(FRAMES))
    return parts[0] + 1j * parts[1], wanted


@every
@pytest.mark.parametrize("order", [0, 1, 2])
def test_the_pass_band_keeps_its_derivatives_and_slow_motion_all_of_their_digits(
    steps: int, attenuation: float, band: tuple[float, float], order: int
) -> None:
    filters = Decimator.of((order,), RATE, steps, band, attenuation)
    for frequency in np.geomspace(1e-4, band[0], 25):
        found, wanted = read(filters, float(frequency), 0)
        assert np.max(np.abs(found / wanted - 1.0)) < 10.0 ** (-attenuation / 20.0)


@every
def test_the_stop_band_is_gone(steps: int, attenuation: float, band: tuple[float, float]) -> None:
    filters = Decimator.of((0,), RATE, steps, band, attenuation)
    for frequency in np.linspace(band[1], 0.5 * steps, 40):
        found, _wanted = read(filters, float(frequency), 0)
        # what stands still at the frame is taken out first, and put back
        assert np.max(np.abs(found)) < 10.0 ** (-attenuation / 20.0)


@pytest.mark.parametrize("order", [0, 1, 2])
def test_what_stands_still_is_exactly_still(order: int) -> None:
    filters = Decimator.of((order,), RATE, 2, (0.4, 0.45), 90.0)
    value = 1.0 / 3.0 * 1e-5
    frames = filters.read(np.full((FRAMES - 1 + 2 * filters.margin) * 2 + 1, value), 0, FRAMES)
    assert np.all(frames == (value if order == 0 else 0.0))


def test_a_mass_that_a_fast_force_drives_moves_as_far_as_it_should() -> None:
    """The midpoint rule makes z of a force of frequency f smaller; the filter makes up for it up to the pass band."""
    steps, band = 2, (0.40, 0.45)
    plain = Decimator.of((2,), RATE, steps, band, 90.0)
    made_up = Decimator.of((2,), RATE, steps, band, 90.0, of_mass=True)
    for frequency in (0.01, 0.1, 0.2, 0.3, 0.4):
        x = np.pi * frequency / steps
        moved = x**2 * np.cos(x) / np.sin(x) ** 2  # of what the mass should move by
        found, wanted = read(made_up, frequency, 0)
        assert np.max(np.abs(moved * found / wanted - 1.0)) < 1e-4
        if frequency >= 0.2:
            found, wanted = read(plain, frequency, 0)
            assert np.max(np.abs(moved * found / wanted - 1.0)) > 1e-3
