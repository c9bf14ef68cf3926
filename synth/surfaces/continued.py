"""A map of heights that is continued below its pixel by synthetic waves.

Stage   SURFACES. `heightmap` asks for it with its fields `synthetic_hurst`, `synthetic_shortest` and `synthetic_seed`.
Model   One period of the map becomes a finer grid. Its Fourier series is that of the map, unchanged, and, beyond the
        waves that the map can hold, waves of the power of `pixel_spectrum` with random phases, down to `shortest`. Both
        repeat after the map's period, so there is no seam. The phases are drawn from PCG64(seed).
Source  The filter of Fourier series is a textbook's; the spectrum is that of `pixel_spectrum`.
Limits  MOST_POINTS points of the finer grid. With ends "mirror" the map is mirrored, the synthetic waves are not. A
        sharp edge of the map rings between its pixels, as in any band-limited interpolation: by 9 % of its height.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from synth.response_cache import kept
from synth.surfaces.measured_area import MeasuredArea
from synth.surfaces.pixel_spectrum import ROWS, SlopeSums, Waves, below_pixel, finest_wave, level_at_pixel
from synth.surfaces.profile import Array
from synth.surfaces.surface_data import SurfaceData

MOST_POINTS = 1 << 24  # of the finer grid: 64 MB, as for a map
SHORTEST = 60e-6  # m; usual shortest wave. A cell of a finger is some 40 um, and shorter waves count by its mean only
POINTS_A_WAVE = 2  # of the shortest wave


@dataclass(frozen=True, slots=True)
class Continuation:
    """How a map is continued.

    hurst: Hurst exponent of the synthetic waves, 0 to 1.
    shortest: the shortest of them, m.
    seed: of their phases.
    """

    hurst: float
    shortest: float = SHORTEST
    seed: int = 0


def grids(data: SurfaceData, ends: str, shortest: float) -> tuple[Waves, Waves]:
    """Return the waves of one period of the map, and those of the finer grid.

    The finer grid has a whole number of points per pixel. Without a wave below the pixel, both are the same.
    """
    rows, columns = data.heights.shape
    counts = (columns, rows) if ends == "join" else (2 * columns - 2, 2 * rows - 2)
    pixel = Waves(counts, (data.spacing[0], data.spacing[1]))
    finer = [max(1, math.ceil(POINTS_A_WAVE * step / shortest - 1e-9)) for step in data.spacing]
    fine = Waves((counts[0] * finer[0], counts[1] * finer[1]), (data.spacing[0] / finer[0], data.spacing[1] / finer[1]))
    return pixel, fine


def shortest_that_fits(data: SurfaceData, ends: str) -> float:
    """Return the shortest wave (m) for which the finer grid has at most MOST_POINTS points, SHORTEST at least."""
    points = math.prod(grids(data, ends, 1e9)[0].counts)
    finer = max(1, math.floor(math.sqrt(MOST_POINTS / points)))
    return max(SHORTEST, POINTS_A_WAVE * max(data.spacing) / finer)


def period_of(data: SurfaceData, ends: str) -> Array:
    """Return the heights of one period, m [rows, columns]."""
    heights = data.heights.astype(np.float64)
    if ends == "join":
        return heights
    heights = np.concatenate([heights, heights[-2:0:-1]])
    return np.concatenate([heights, heights[:, -2:0:-1]], axis=1)


@kept
def level_of(data: SurfaceData, ends: str) -> float:
    """Return the power (m^2) of a wave at the pixel's wave number; see `pixel_spectrum`."""
    return level_at_pixel(period_of(data, ends), grids(data, ends, 1e9)[0].steps)


def finest_of(data: SurfaceData, ends: str) -> float:
    """Return the length (m) of the waves from which on the map is empty; see `pixel_spectrum`."""
    return finest_wave(period_of(data, ends), grids(data, ends, 1e9)[0].steps)


@kept
def slope_sums(data: SurfaceData, ends: str, shortest: float) -> SlopeSums:
    """Return the sums from which the rms slope of the synthetic waves follows."""
    pixel, fine = grids(data, ends, shortest)
    return SlopeSums.of(fine, pixel, shortest)


def synthetic_slope(data: SurfaceData, ends: str, one: Continuation) -> float:
    """Return the rms slope of the synthetic waves along one axis."""
    return slope_sums(data, ends, one.shortest).slope(level_of(data, ends), one.hurst)


@kept
def continued(data: SurfaceData, ends: str, one: Continuation) -> SurfaceData:
    """Return one period of the map with its synthetic waves. Its ends join; y = 0 is where it was in the map."""
    pixel, fine = grids(data, ends, one.shortest)
    series = np.zeros((fine.counts[1], fine.counts[0] // 2 + 1), np.complex64)
    _put_map(series, period_of(data, ends), fine)
    middle = 0.5 * (data.heights.shape[0] - 1) * pixel.steps[1] - 0.5 * (fine.counts[1] - 1) * fine.steps[1]
    series *= np.exp(1j * fine.y * middle).astype(np.complex64)[:, np.newaxis]
    _put_synthetic(series, level_of(data, ends), pixel, fine, one)
    heights = np.fft.irfft2(series, s=fine.counts[::-1]).astype(np.float32, copy=False)
    return SurfaceData(heights * np.float32(heights.size), fine.steps)


def _put_map(series: np.ndarray[tuple[int, ...], np.dtype[np.complex64]], heights: Array, fine: Waves) -> None:
    """Put the Fourier series of the map into that of the finer grid. A wave at Nyquist's wave number is split."""
    rows, columns = heights.shape
    found = np.fft.rfft2(heights) / heights.size
    if columns % 2 == 0 and fine.counts[0] > columns:
        found[:, -1] *= 0.5
    up = (rows + 1) // 2  # rows of wave numbers from 0 up; from there on they are negative
    series[:up, : found.shape[1]] = found[:up]
    series[len(series) - (rows - up) :, : found.shape[1]] = found[up:]
    if rows % 2 == 0 and fine.counts[1] > rows:
        half = 0.5 * found[up]
        series[up, : found.shape[1]] = series[len(series) - up, : found.shape[1]] = half


def _put_synthetic(
    series: np.ndarray[tuple[int, ...], np.dtype[np.complex64]],
    level: float,
    pixel: Waves,
    fine: Waves,
    one: Continuation,
) -> None:
    """Put the waves of `below_pixel` into the series."""
    chance = np.random.Generator(np.random.PCG64(one.seed))
    for row in range(0, fine.counts[1], ROWS):
        held = below_pixel(fine, pixel, one.shortest, row)
        turns = chance.random(held.shape, np.float32)[held]
        q = np.hypot(fine.x, fine.y[row : row + ROWS, np.newaxis])[held] / pixel.pixel
        amplitudes = math.sqrt(level) * q ** (-1.0 - one.hurst)
        series[row : row + ROWS][held] = amplitudes * np.exp(2j * math.pi * turns)
    last = fine.counts[1] // 2
    column = series[1 : fine.counts[1] - last, 0]  # of a real surface, the waves along y come in pairs
    beyond = fine.y[1 : fine.counts[1] - last] > (1.0 + 1e-9) * math.pi / pixel.steps[1]
    series[: -len(column) - 1 : -1, 0] = np.where(beyond, np.conj(column), series[: -len(column) - 1 : -1, 0])


def continued_area(data: SurfaceData, ends: str, phase: float, one: Continuation) -> MeasuredArea:
    """Return the texture of a map that is continued; phase: rad."""
    return MeasuredArea(continued(data, ends, one), "join", phase)
